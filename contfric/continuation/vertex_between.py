"""A vertex between two orbits: the first asymmetric (doubled), the second symmetric (undoubled) already.

Where a vertex has a sharp tip, orbits become symmetric too fast to be met by shorter steps: near a touch
of a kink multipliers change with the root of the parameter. What vanishes at the vertex is defined on the
symmetric orbits on both sides of it, and changes sign there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from contfric.continuation.doubling_point import moved, opening
from contfric.continuation.points import Point, Settings, displaced
from contfric.continuation.side import first_point
from contfric.continuation.vertices import joints_like, symmetrised, undoubled
from contfric.orbit.orbit import Orbit

#: Halvings of a step to the resolution of the parameter.
_HALVINGS = 40
#: What vanishes at a vertex is rounding below this.
_NOTHING = 1e-12


def left_at(before: Point, after: Orbit, settings: Settings) -> Point | None:
    """Return the vertex at which a step went over from asymmetric orbits to symmetric ones, if it did.

    The simpler orbits between its ends are found at fixed parameters from the far one; where they turn on the
    way (a fold may lie near the vertex), along the chord between both ends.
    """
    active = after.model.index_of(settings.parameter)
    found = _at_values(before, after, active) or _along_chord(before, after, settings, active)
    if found is None:
        return None
    there = joints_like(found, before.joints)
    value = float(found.vector[active])
    gap = there - before.joints
    far = np.sum(gap * gap) / len(gap) + (value - before.value) ** 2 * settings.scale
    return replace(before, joints=there, w=np.array([value]), arc=before.arc + float(np.sqrt(far)))


def _simpler(orbit: Orbit) -> Orbit | None:
    return symmetrised(orbit) or undoubled(orbit)


def _at_values(before: Point, after: Orbit, active: int) -> Orbit | None:
    """Return the vertex between the parameters of two orbits; None if no orbit between is found."""
    part = _simpler(after)
    if part is None:
        return None
    low, high = before.value, float(after.vector[active])

    def between(share: float, near: Orbit | None) -> Orbit | None:
        return moved(near or part, active, low + share * (high - low))

    return _vanishing(between)


def _along_chord(before: Point, after: Orbit, settings: Settings, active: int) -> Orbit | None:
    """Return the vertex between two orbits, the orbits between being normal to their chord."""
    low = _simpler(before.orbit(after, active))
    high = _simpler(after)
    if low is None or high is None or low.joints.shape != high.joints.shape:
        return None
    chord = high.joints - low.joints
    rise = float(high.vector[active] - low.vector[active])
    length = np.sqrt(np.sum(chord * chord) / len(chord) + rise * rise * settings.scale)
    if not length > 0.0:
        return None
    plain = replace(settings, stability=False)

    def between(share: float, _: Orbit | None) -> Orbit | None:
        guess = displaced(low, active, share * chord, share * rise)
        point = first_point(guess, plain, chord / length, rise / length)
        return None if point is None else point.orbit(low, active)

    return _vanishing(between)


def _vanishing(orbit_at: Callable[[float, Orbit | None], Orbit | None]) -> Orbit | None:
    """Return the orbit at which a disturbance opens, between the shares 0 and 1 of a step; None if none does.

    By the method of false position and by halving in turn: what vanishes may change with a root.

    Parameters
    ----------
    orbit_at : the orbit at a share of the step, from one that is known nearby
    """
    low, high = 0.0, 1.0
    start, best = orbit_at(low, None), orbit_at(high, None)
    below, above = _opens(start), _opens(best)
    if not below * above < 0.0:
        return None
    for k in range(2 * _HALVINGS):
        share = below / (below - above) if k % 2 == 0 else 0.5
        share = low + share * (high - low)
        middle = orbit_at(share, best)
        here = _opens(middle)
        if np.isnan(here):
            return None
        if abs(here) < _NOTHING:
            return middle
        if below * here > 0.0:
            low, below = share, here
        else:
            high, above, best = share, here, middle
        if high - low < 0.5**_HALVINGS:
            break
    return best


def _opens(orbit: Orbit | None) -> float:
    return np.nan if orbit is None else opening(orbit)
