"""Where no further step of a branch is possible: what is singular there, in words."""

from __future__ import annotations

import numpy as np

from contfric.continuation.crossing import crossing_near
from contfric.continuation.events import Bifurcation, EndReason, Kind
from contfric.continuation.points import Point, Settings
from contfric.continuation.report import bifurcation_at
from contfric.orbit.orbit import Orbit

#: A step fails as near to a branch point as the last step was long, 1e-10, or as predictors are good, 1e-4:
#: what is farther from the last point (scaled product) is another one.
_NEAR = 1e-2
#: A multiplier this near to 1 is one of the singular orbit next to the last point: it is as far from 1 as
#: the point is from there.
_AT_ONE = 1e-2


def stalled_at(orbit: Orbit, tip: Point, settings: Settings) -> tuple[str, Bifurcation | None]:
    """Return why a branch stalls at a point, and the branch point at which its parameter turns, if it is one.

    Parameters
    ----------
    orbit : an orbit of the branch
    tip : the last point
    """
    active = orbit.model.index_of(settings.parameter)
    here = tip.orbit(orbit, active)
    crossing = crossing_near(here, settings, _NEAR)
    if crossing is None:
        return _multipliers(here), None
    found = crossing.orbit
    where = f"{settings.parameter} = {found.params[settings.parameter]:.12g}"
    message = f"{EndReason.STEP.value}; a multiplier is at +1: a branch point is at {where}"
    turns = crossing.nearest(tip.tangent, tip.slope, settings.scale).turns
    if not turns:
        return message, None
    return message, bifurcation_at(Kind.BP, found, tip, None, tip, settings)


def _multipliers(here: Orbit) -> str:
    """Return whether a multiplier is at +1, in words."""
    stalled = EndReason.STEP.value
    if here.system.holds:  # a bridge has none
        return stalled
    mu = here.turn_multipliers
    if not np.isfinite(mu).all():
        return f"{stalled}; a multiplier is infinite: an exit is tangential there"
    nearest = complex(mu[np.argmin(np.abs(mu - 1.0))])
    text = f"{nearest.real:.6g}" + (f"{nearest.imag:+.6g}i" if nearest.imag else "")
    if abs(nearest - 1.0) < _AT_ONE:
        return f"{stalled}; a multiplier is at +1 ({text}): a fold or a branch point is near"
    return f"{stalled}; no multiplier is at +1 (the nearest is {text})"
