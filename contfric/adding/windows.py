"""Period adding: itineraries over the two orbits that a bridge joins.

Where a branch a ends at SS and, beyond a gap in the parameter, a branch b of the other outcome begins,
the return map of the stop has a jump: above it a turn follows a, below it b. In between live orbits of
several turns, each of which follows one of the two, ``a-b``, ``a-b-b`` and so on; which itineraries there are
follows the arithmetic of a circle map (period adding: V. Avrutin et al., Continuous and Discontinuous
Piecewise-Smooth One-Dimensional Maps, World Scientific 2019, chapter 3).

Itineraries that the return map of the release excludes are not tried
(:mod:`contfric.adding.two_orbit_itineraries`).

Each itinerary is an ordinary boundary-value problem, solved from the two orbits run through one after the
other: at the pinned stop their states nearly agree. The problem has a solution also where it is not
admissible, so the window of an itinerary is bounded by the parameters at which one of its stops meets the
surface, and these are found by bracketing the zeros of the margins.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from contfric.adding.two_orbit_itineraries import itineraries_with_ranges
from contfric.base.arrays import FloatArray, with_entries
from contfric.base.renamed import renamed
from contfric.base.shown import Shown
from contfric.bvp.prescribed_outcomes import follow_itinerary
from contfric.bvp.system import Margin, build_system
from contfric.continuation.branch import Branch
from contfric.continuation.points import MOST_POINTS, settings_of
from contfric.continuation.trace import follow_orbit
from contfric.errors import ConvergenceError, ParameterError, shown, whole_number
from contfric.events.bifurcation import Bifurcation
from contfric.events.incident.candidates import candidates
from contfric.orbit.orbit import Orbit, Status
from contfric.orbit.solve import refine
from contfric.signature.edits import concatenate

#: Places over the gap at which the margins of an itinerary are looked at: they are smooth curves there, with
#: a few changes of sign for an itinerary of six turns.
_GRID = 48
#: Rounds of the motion before Newton: a stable itinerary contracts the error of 1e-3 to far below the length
#: of its sticks.
_ROUNDS = 4
#: Steps towards one change of sign, and the resolution of its place: the method needs about ten.
_MOST_STEPS, _RESOLUTION = 60, 1e-15


@dataclass(frozen=True, eq=False)
class Window(Shown):
    """The orbits of one itinerary, from one end of its window to the other.

    Attributes
    ----------
    itinerary : str
        The orbits that follow each other, such as ``1a-1a-2a``.
    turns : str
        The same in letters, a and b.
    branch : Branch
        The branch of the itinerary; its range is the window.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> found = cf.explore(orbit, "Omega", (0.48, 0.55))
    >>> bridge = next(branch for branch in found.branches if branch.bridge)
    >>> window = cf.period_adding(bridge, longest=2)[0]
    >>> window.itinerary, round(window.range[0], 6)
    ('1a-2a', 0.491752)
    """

    itinerary: str
    turns: str
    branch: Branch

    word = renamed("word", "itinerary")

    @property
    def range(self) -> tuple[float, float]:
        """The window: the range of the parameter."""
        return float(self.branch.values.min()), float(self.branch.values.max())

    def __repr__(self) -> str:
        low, high = self.range
        stable = "stable" if np.all(self.branch.stable) else "in part unstable"
        return (
            f"<{self.itinerary}: {self.branch.parameter} from {low:.13g} to {high:.13g}, {stable}>"
        )


def period_adding(bridge: Branch, longest: int = 6) -> tuple[Window, ...]:
    """Return the windows of all itineraries over the two orbits that a bridge joins, in order.

    Parameters
    ----------
    bridge : Branch
        A bridge between two SS ends, from :func:`contfric.explore`.
    longest : int
        Most turns of an itinerary. The time doubles with each turn more where all itineraries have to be
        tried (docs/bridges.md, several periods).

    Returns
    -------
    tuple of Window
        In the order of the parameter; itineraries that have no admissible orbit are left out.

    Raises
    ------
    ParameterError
        If the branch is no bridge between two regular orbits.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> found = cf.explore(orbit, "Omega", (0.48, 0.55))
    >>> bridge = next(branch for branch in found.branches if branch.bridge)
    >>> [window.itinerary for window in cf.period_adding(bridge, longest=3)]
    ['1a-2a-2a', '1a-2a', '1a-1a-2a']
    """
    whole_number("longest", longest, least=2)
    given: object = bridge  # whatever the user gave
    if not isinstance(given, Branch):
        raise ParameterError(
            f"period adding starts from a bridge, a Branch of explore(...), got {shown(given)}"
        )
    if bridge.model.autonomous or bridge.model.resets:
        raise ParameterError(
            f"model '{bridge.model.name}': period adding is offered for excited models without impacts"
        )
    if not bridge.bridge:
        raise ParameterError(f"{bridge!r} is no bridge: its orbits have no hold")
    letters = {}
    for letter, end in zip("ab", bridge.ends, strict=True):
        if end.bifurcation is None:
            raise ParameterError(f"the bridge does not end at an event: {end}")
        letters[letter] = _regular(end.bifurcation, bridge)
    low, high = float(bridge.values.min()), float(bridge.values.max())
    grid = np.linspace(low, high, _GRID + 2)[1:-1]
    windows = [
        window
        for turns, near in itineraries_with_ranges(letters, bridge, grid, longest)
        if (window := _window(turns, letters, bridge, near)) is not None
    ]
    return tuple(sorted(windows, key=lambda w: w.range))


def _regular(event: Bifurcation, bridge: Branch) -> Orbit:
    """Return the orbit without holds at an end of a bridge, from its pinned stop on."""
    if not event.orbit.system.holds:  # located on the regular branch itself
        return _from_stop(event.orbit.as_whole(), bridge)
    for candidate in candidates(event):
        orbit = candidate.orbit
        if orbit is not None and not orbit.system.holds:
            return _from_stop(orbit.as_whole(), bridge)
    raise ParameterError(f"no regular orbit meets the bridge at {event!r}")


def _from_stop(orbit: Orbit, bridge: Branch) -> Orbit:
    """Return an orbit rotated to start with the slide that ends at the pinned stop."""
    hold = bridge.system.holds[0]
    if len(bridge.system.holds) != 1 or hold.pin is None:
        raise ParameterError(
            "period adding needs a bridge with one hold, at a stop on a surface (SS)"
        )
    near = bridge[0].cycle[hold.segment]
    period = orbit.period / orbit.periods
    apart = [
        abs((end[0] - near[0] + 0.5 * period) % period - 0.5 * period)
        + np.abs(end[1:] - near[1:]).max()
        for end in orbit.ends
    ]
    slides = [i for i, (mode, _) in enumerate(orbit.itinerary) if not _rests(orbit, mode)]
    stop = min(slides, key=lambda i: apart[i])
    itinerary = orbit.itinerary[stop:] + orbit.itinerary[:stop]
    joints = np.concatenate([orbit.cycle[stop:], orbit.cycle[:stop]])
    joints[len(joints) - stop :, 0] += orbit.period
    joints[:, 0] -= np.round((orbit.ends[stop, 0] - near[0]) / period) * period
    system = build_system(orbit.model, itinerary, orbit.periods)
    return replace(orbit, system=system, joints=joints)


def _rests(orbit: Orbit, mode: str) -> bool:
    return orbit.model.mode_by_name[mode].sliding


def _window(
    turns: str, letters: dict[str, Orbit], bridge: Branch, grid: FloatArray
) -> Window | None:
    """Return the window of an itinerary over some parameters, None if it has none."""
    start = _in_turn([letters[letter] for letter in turns])
    low, high = _bounds(start, turns, letters, bridge, grid)
    if not low < high:
        return None
    middle = _at(start, bridge.parameter, 0.5 * (low + high))
    if not (middle.converged and middle.admissible):
        return None
    width = bridge.values.max() - bridge.values.min()
    try:
        bounds, step = (low - width, high + width), min(1.0, (high - low) / width)
        settings = settings_of(middle, bridge.parameter, bounds, step, True, MOST_POINTS)
        branch = follow_orbit(middle, settings)
    except ConvergenceError:
        return None
    name = "-".join(letters[letter].name for letter in turns)
    return Window(name, turns, branch)


def _in_turn(orbits: list[Orbit]) -> Orbit:
    """Return orbits run through one after the other, as one that is not solved yet."""
    periods, joints = 0, []
    for orbit in orbits:
        shifted = orbit.joints.copy()
        shifted[:, 0] += periods * orbit.period / orbit.periods
        joints.append(shifted)
        periods += orbit.periods
    itinerary = concatenate(*(orbit.system.itinerary for orbit in orbits))
    system = build_system(orbits[0].model, itinerary, periods)
    vector = orbits[0].vector.copy()
    return Orbit(system, np.concatenate(joints), vector, np.inf, Status.NOT_CONVERGED)


def _at(orbit: Orbit, parameter: str, value: float) -> Orbit:
    """Return the orbit of an itinerary at a parameter.

    Newton alone may take the wrong root where a stick of a turn is short: its load falls through the
    limit before it grows through it. So the joints are first those of the solution itself.
    """
    vector = with_entries(orbit.vector, orbit.model.index_of(parameter), value)
    return refine(_with_own_joints(replace(orbit, vector=vector)))


def _with_own_joints(orbit: Orbit) -> Orbit:
    """Return an orbit with the joints of the solution that takes its outcomes, after some rounds."""
    joints, end, system = orbit.joints.copy(), np.empty(orbit.joints.shape[1]), orbit.system
    found = follow_itinerary(system.functions(), system.layout, joints, orbit.vector, _ROUNDS, end)
    return replace(orbit, joints=joints) if found else orbit


def _bounds(
    start: Orbit, turns: str, letters: dict[str, Orbit], bridge: Branch, grid: FloatArray
) -> tuple[float, float]:
    """Return the range in which every turn follows its letter: its stops have positive margins.

    The margins change sign where a stop meets the surface; between two such locations that follow each
    other all of them keep their signs. At the ends of the bridge sticks of length zero solve every itinerary.
    """
    stops = list(_stops(start, turns, letters, bridge))
    rows = np.array([_margins(start, bridge.parameter, x, stops) for x in grid])
    locations = [grid[0], grid[-1]]
    for k in range(len(stops)):
        for i in np.flatnonzero(rows[:-1, k] * rows[1:, k] < 0.0):
            locations.append(_root(start, bridge.parameter, grid[i], grid[i + 1], stops[k]))
    locations.sort()
    for low, high in pairwise(locations):
        middle = _margins(start, bridge.parameter, 0.5 * (low + high), stops)
        if np.all(middle > 0.0):
            return float(low), float(high)
    return 0.0, 0.0


def _stops(start: Orbit, turns: str, letters: dict[str, Orbit], bridge: Branch) -> Iterator[int]:
    """Yield the margin at the pinned stop of each turn."""
    surface = bridge.system.holds[0].pin
    at = 0
    for letter in turns:
        yield next(
            k
            for k, test in enumerate(start.system.tests)
            if test.margin is Margin.JOINT and test.segment == at and test.surface == surface
        )
        at += letters[letter].system.segments


def _margins(start: Orbit, parameter: str, value: float, stops: list[int]) -> FloatArray:
    """Return the margins of the stops at a parameter, shape (turns,); nan where Newton fails."""
    orbit = _at(start, parameter, value)
    return orbit.margins[stops] if orbit.converged else np.full(len(stops), np.nan)


def _root(start: Orbit, parameter: str, low: float, high: float, stop: int) -> float:
    """Return where a margin vanishes in a bracket, by the Illinois method."""

    def margin(value: float) -> float:
        return float(_margins(start, parameter, value, [stop])[0])

    a, b, fa, fb = low, high, margin(low), margin(high)
    for _ in range(_MOST_STEPS):
        x = (a * fb - b * fa) / (fb - fa)
        fx = margin(x)
        if not np.isfinite(fx) or fx == 0.0 or abs(b - a) <= _RESOLUTION:
            return x
        if fx * fb < 0.0:
            a, fa = b, fb
        else:
            fa *= 0.5
        b, fb = x, fx
    return b
