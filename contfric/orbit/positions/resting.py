r"""Positions of contacts that never slip, and the interval of other positions that they may have.

What an orbit conserves (:mod:`contfric.bvp.conserved`) is, in a structure, the position of each contact
that sticks all along: the displacement of friction, the place of a Jenkins element's slider. Elsewhere it is
a linear function of the states without a name, that of the reduced basis.

One of them moves by d while the others stay: all joints are moved by a vector e with ``w . e`` = d for it and
0 for the others, and Newton's method, which leaves these functions alone, solves for the rest. An end of the
interval is where the contact, or one that is to stay, begins to slip. Where all is linear and nothing else
slips, the orbit and its margins are affine in d, so that the first line through two orbits gives the end
exactly. Where a gap closes, or something else happens to what moves anyway, the interval does not end: a
simulation says with which segments it goes on.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.conserved import conserved
from contfric.errors import ContfricError, ParameterError
from contfric.orbit.positions.kept import (
    Position,
    at_rest,
    checked_positions,
    places_of,
    positions_of,
)
from contfric.orbit.solve import refine, refine_with_symmetry
from contfric.orbit.tolerances import margin_slack

if TYPE_CHECKING:
    from contfric.orbit.orbit import Orbit

#: The first step, relative to 1 + the states: a line has eight digits, and nothing has happened yet.
_FIRST = 1e-6
#: An end is known to this, relative to 1 + the states: what a solved orbit and its margins are known to.
_KNOWN = 1e-13
#: Steps to an end with one itinerary: of the secant, safeguarded by halving a double has 52 of.
_STEPS = 120
#: A step that Newton's method does not take is cut by this, and the next ones grow by it.
_SHORTER = 4.0
#: A line from inside that leads to an orbit beyond the end, or nearly, is worse than one from there.
_CLEARLY = 0.99
#: Beyond an event of something else, relative to 1 + the states: a simulation tells it from the event.
_BEYOND = 1e-5
#: Periods that it takes at most: what attracts has come near by then, and what does not is not found so.
_PERIODS = 2000
#: Such events on the way to one end; more leave the interval open, and it says so.
_EVENTS = 40
#: A position this far away, in units of 1 + the states, at which nothing has happened: there is no end.
_FAR = 1e6


@dataclass(frozen=True)
class RestingPosition:
    """Where a contact rests that never slips along an orbit.

    Attributes
    ----------
    contact : str
        Its name; in a model without contacts the function of the states that is kept.
    text : str
        What is kept: a displacement, for a Jenkins element the place of its slider.
    value : float
        Its value along the orbit.
    lower, upper : float
        Between these values it may be, all others kept; infinite where nothing limits it.
    limits : (str, str)
        What is met at the two ends; empty at an infinite one. A name in brackets is an event of something
        else beyond which no orbit was found that keeps the position: the interval may go on there.

    Examples
    --------
    >>> import contfric as cf
    >>> brake = {"kind": "friction", "velocity": "v1", "kinetic": "S", "static": "S0"}
    >>> stiffness, parameters = [[2.0, -1.0], [-1.0, 2.0]], {"w": 0.7, "S": 0.5, "S0": 0.6}
    >>> model = cf.Mechanism("identity", [[0.1, 0.0], [0.0, 0.1]], stiffness, contacts={"brake": brake},
    ...                      force={"q2": "0.2*cos(w*t)"}, parameters=parameters, period="2*pi/w")
    >>> orbit = cf.find_orbit(model, at={"brake": 0.05})
    >>> print(orbit.resting[0])
    contact 'brake' rests at q1 = 0.05, may rest in [-0.311795, 0.311795]
    >>> orbit.resting_at({"brake": 0.1}).resting[0].value
    0.1
    """

    contact: str
    text: str
    value: float
    lower: float
    upper: float
    limits: tuple[str, str]

    def __str__(self) -> str:
        ends = [f"{end:.6g}" for end in (self.lower, self.upper)]
        found = f"[{ends[0]}, {ends[1]}]"
        known = "at least " if any(limit.startswith("(") for limit in self.limits) else ""
        may = "rest" if self.contact != self.text else "be"
        return f"{at_rest(self.contact, self.text, self.value)}, may {may} {known}in {found}"


def resting_of(orbit: Orbit) -> tuple[RestingPosition, ...]:
    """Return where the contacts rest that never slip, and where they may."""
    found, whole = [], orbit.as_whole()
    positions = positions_of(orbit)
    for k, position in enumerate(positions):
        value = position.value(whole)
        moving = _directions(positions, whole)[:, k]
        ends = [_Course(whole, position, moving * sign).end(np.inf) for sign in (-1.0, 1.0)]
        lower, upper = value - ends[0].offset, value + ends[1].offset
        found.append(
            RestingPosition(
                position.contact, position.text, value, lower, upper, (ends[0].met, ends[1].met)
            )
        )
    return tuple(found)


def resting_at(orbit: Orbit, at: Mapping[str, float]) -> Orbit:
    """Return the orbit of the same parameters whose contacts rest elsewhere, all others where they are.

    Raises
    ------
    ParameterError
        If a contact is unknown, slips along the orbit, or cannot rest there.
    """
    wanted = checked_positions(orbit.model, at)
    if not wanted:
        return orbit
    positions = positions_of(orbit)
    names = [p.contact for p in positions]
    for name in wanted:
        if name not in names:
            keeps = f"; it keeps {', '.join(names)}" if names else ""
            raise ParameterError(
                f"'{name}' has no position of rest along the orbit {orbit.name}, it slips there{keeps}: "
                "leave 'at' out, or start elsewhere (state=...)"
            )
    whole = orbit.as_whole()
    by = np.array([wanted.get(p.contact, v) - v for p in positions for v in [p.value(whole)]])
    far = float(np.max(np.abs(by), initial=0.0))
    if far <= _rounding(whole):
        return orbit
    moving = _directions(positions, whole) @ by / far
    leading = positions[int(np.argmax(np.abs(by)))]
    end = _Course(whole, leading, moving).end(far)
    if end.offset < far - _rounding(whole):
        where = _where(resting_of(orbit), wanted)
        raise ParameterError(f"{where}: choose a position inside, or other parameters")
    return refine_with_symmetry(end.orbit)


# -------------------------------------------------------------------------------- one end


class _End(NamedTuple):
    """How far a position goes.

    Attributes
    ----------
    orbit, offset : the last admissible orbit, and how far it is moved
    met : the surface of the margin that vanishes there, in brackets if it may go on; empty without one
    """

    orbit: Orbit
    offset: float
    met: str


#: An orbit, and how far it is moved.
_Place = tuple["Orbit", float]


class _Course:
    """The orbits along which a position moves one way."""

    def __init__(self, orbit: Orbit, position: Position, moving: FloatArray) -> None:
        self.position, self.moving = position, moving
        self.begin, self.offset = orbit, 0.0
        self.kept = [p.contact for p in positions_of(orbit)]
        self.size = 1.0 + float(np.max(np.abs(orbit.joints[:, 1:])))

    def end(self, target: float) -> _End:
        """Return the end, or where the offset is reached."""
        for _ in range(_EVENTS):
            reached = self._with_these_segments(target)
            if reached.offset >= target or not reached.met or self._slips_at(reached.met):
                return reached
            beyond = self._beyond(reached)
            if beyond is None:
                return reached._replace(met=self._as_met(reached.met))
            self.begin, self.offset = beyond, reached.offset + _BEYOND * self.size
        return reached._replace(met=f"({reached.met})")

    def _moved(self, before: _Place, inside: _Place, at: float) -> Orbit:
        """Return the orbit at an offset, from the line through two others; what is kept is exact."""
        (old, a), (new, b) = before, inside
        joints = (
            new.joints + (at - b) / (b - a) * (new.joints - old.joints)
            if b > a
            else new.joints.copy()
        )
        kept = new.joints[:, 1:] + (at - b) * self.moving - joints[:, 1:]
        still = conserved(new.model, new.itinerary)
        joints[:, 1:] += kept @ still.T @ still
        return refine(replace(new, joints=joints))

    def _with_these_segments(self, target: float) -> _End:
        """Return the end of the family of orbits with one itinerary, or where the offset is reached."""
        before = inside = (self.begin, self.offset)
        outside: _Place | None = None
        step, most, met, longer = _FIRST * self.size, np.inf, "", np.inf
        for _ in range(_STEPS):
            at = min(inside[1] + min(step, most), target)
            found = self._moved(before, inside, at)
            if not found.converged:  # which says nothing of an end
                most, longer = (at - inside[1]) / _SHORTER, _SHORTER
            elif found.admissible:
                most = longer * (at - inside[1])
                before, inside = inside, (found, at)
                if at >= target:
                    return _End(found, at, "")
                if at > _FAR * self.size:
                    return _End(found, np.inf, "")
            else:
                outside, met = (found, at), self._missed(found)
            step, name = self._next(before, inside, outside)
            met = name or met
            if min(step, most) <= _KNOWN * self.size:
                break
        if step < 0.0:  # inequalities hold a little beyond, by their slack
            before, inside = (
                inside,
                (self._moved(before, inside, inside[1] + step), inside[1] + step),
            )
        return _End(*(inside if inside[0].converged else before), met)

    def _next(self, before: _Place, inside: _Place, outside: _Place | None) -> tuple[float, str]:
        """Return how far it is to where a margin vanishes first, and its surface, by lines through orbits."""
        (old, a), (new, b) = before, inside
        step, name = _crossing(old, new, b - a) if b > a else (np.inf, "")
        if outside is None:
            return (step, name) if np.isfinite(step) else (10.0 * (b - a) + self.size, "")
        wrong, c = outside
        if step < _CLEARLY * (c - b):
            return step, name
        apart, name = _crossing(new, wrong, c - b)
        return (c - b + apart if apart < 0.0 else 0.5 * (c - b)), name

    @staticmethod
    def _missed(found: Orbit) -> str:
        """Return the surface of the margin that an orbit violates most."""
        if not found.system.tests:
            return ""
        margins = found.margins - margin_slack(found.system, found.joints)
        margins = np.where(np.isnan(margins), -np.inf, margins)
        return found.system.tests[int(np.argmin(margins))].surface

    def _slips_at(self, surface: str) -> bool:
        """Tell whether a surface is a limit of what a contact carries that keeps its position."""
        return any(surface.startswith((f"{name}+", f"{name}-")) for name in self.kept)

    def _as_met(self, surface: str) -> str:
        """Return an end by its surface; in brackets where something else happens and it may go on."""
        return f"({surface})" if places_of(self.begin.model) else surface

    def _beyond(self, end: _End) -> Orbit | None:
        """Return the orbit that a simulation from beyond an event comes to, if it keeps its place."""
        from contfric.orbit.finding.find import simulated_orbit

        model, params = end.orbit.model, end.orbit.params
        lasts = end.orbit.durations
        k = int(np.argmax(lasts))  # in the middle of a segment no surface is near
        time = float(end.orbit.cycle[k, 0] + 0.5 * lasts[k])
        state = end.orbit.state(time) + _BEYOND * self.size * self.moving
        wanted = float(self.position.weights @ state)
        try:
            found = simulated_orbit(model, params, state, time, _PERIODS).as_whole()
        except ContfricError:
            return None
        kept = self.position.contact in [p.contact for p in positions_of(found)]
        if not kept or abs(self.position.value(found) - wanted) > 1e-3 * _BEYOND * self.size:
            return None
        return found


def _crossing(old: Orbit, new: Orbit, apart: float) -> tuple[float, str]:
    """Return how far beyond the second orbit a margin vanishes first that falls, and its surface.

    So does what a segment lasts. Negative if one is violated there; infinite if none falls.
    """
    (first, _), (last, surfaces) = _heights(old), _heights(new)
    both = np.isfinite(first) & np.isfinite(last)
    falls = np.where(both, first, 0.0) - np.where(both, last, 0.0)
    known = (falls > 0.0) & (first > 0.0)
    if not np.any(known):
        return np.inf, ""
    left = np.full(len(last), np.inf)
    left[known] = last[known] * apart / falls[known]
    k = int(np.argmin(left))
    return float(left[k]), surfaces[k]


def _heights(orbit: Orbit) -> tuple[FloatArray, list[str]]:
    """Return the margins of an orbit and how long its segments last, and the surface of each."""
    lasts = orbit.durations
    surfaces = [t.surface for t in orbit.system.tests] + [exit_ for _, exit_ in orbit.itinerary]
    return np.concatenate([orbit.margins, lasts]), surfaces


# -------------------------------------------------------------------------------- directions


def _rounding(orbit: Orbit) -> float:
    return _KNOWN * (1.0 + float(np.max(np.abs(orbit.joints[:, 1:]))))


def _directions(positions: tuple[Position, ...], orbit: Orbit) -> FloatArray:
    """Return how the state moves as each position moves by 1 and all else that is kept stays, (n, k)."""
    weights = np.array([p.weights for p in positions])
    still = conserved(orbit.model, orbit.itinerary)
    # along what is kept: all else follows by the equations
    found: FloatArray = still.T @ np.linalg.pinv(weights @ still.T)
    return found


def _where(resting: tuple[RestingPosition, ...], wanted: Mapping[str, float]) -> str:
    """Return where contacts may rest that are wanted elsewhere."""
    lines = [
        f"'{r.contact}' may rest with {r.text} in [{r.lower:.6g}, {r.upper:.6g}], "
        f"not at {wanted[r.contact]:.6g}"
        for r in resting
        if r.contact in wanted and not r.lower <= wanted[r.contact] <= r.upper
    ]
    together = "the contacts cannot rest at " + ", ".join(f"{k} = {v:g}" for k, v in wanted.items())
    return "; ".join(lines) or f"{together} together"
