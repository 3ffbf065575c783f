"""From a bifurcation to the problem of its curve: what varies, what vanishes, what is not watched."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from contfric.base.arrays import FloatArray, IntArray, with_entries
from contfric.bvp.linear import jacobian_blocks, stacked
from contfric.bvp.system import EventFunction, Margin, System
from contfric.curves.ranges import PlaneRanges, limits_of
from contfric.errors import ParameterError
from contfric.events.bifurcation import TERMINAL, Bifurcation, Kind
from contfric.events.local.jumps import nothing_jumps
from contfric.events.local.touching import rest_at
from contfric.events.sliding_kinds import kind_of_margin
from contfric.models.definition import Model
from contfric.orbit.measured.samples import stationary_within
from contfric.orbit.orbit import Orbit

if TYPE_CHECKING:
    from contfric.curves.equations.conditions import Condition
    from contfric.curves.equations.held_conditions import Conditions

#: Margins below this at the start (nondimensional) vanish along the curve, with its condition: located
#: events are zero to about 1e-12, and those of a group agree to their conditioning.
_VANISHES = 1e-6
#: Distance from a physical limit (relative to the ranges) within which it cannot be told from what meets it.
_AT_LIMIT = 1e-6
#: A multiplier this far from +-1 does not belong to a located bifurcation.
_MULTIPLIER = 1e-2


@dataclass(frozen=True, eq=False)
class Problem:
    """A curve to follow: the equations of its orbits, and the condition.

    Attributes
    ----------
    kind : the bifurcation
    system : boundary-value problem of its orbits
    vector : all parameters at the start
    box : the plane
    condition : what vanishes, as the compiled engine takes it
    test : the margin that vanishes; None for SN, BP and PD
    """

    kind: Kind
    system: System
    vector: FloatArray
    box: PlaneRanges
    condition: Condition
    test: EventFunction | None

    @property
    def model(self) -> Model:
        """The model that moves."""
        return self.system.model

    @cached_property
    def which(self) -> IntArray:
        """Indices of the two parameters."""
        return np.array([self.model.index_of(n) for n in self.box.names], dtype=np.int64)

    def conditions(self) -> tuple[Condition, Conditions]:
        """Return what vanishes, as the compiled engine takes it: nothing is asked of a quantity."""
        from contfric.curves.equations.held_conditions import no_quantity

        return self.condition, no_quantity()

    def calling(self) -> AbstractContextManager[None]:
        """Return the context of a march that calls no function of Python: none is needed."""
        return nullcontext()

    @cached_property
    def limits(self) -> FloatArray:
        """The model's constraints that bound the plane: rows (a, b, c) with ``a p + b q + c >= 0``."""
        return limits_of(self.model, self.vector, self.box)

    def within_limits(self, values: FloatArray) -> FloatArray:
        """Return the least left-hand side of the model's constraints at points (k, 2) of the plane."""
        if not len(self.limits):
            return np.full(len(values), np.inf)
        return np.asarray(np.min(values @ self.limits[:, :2].T + self.limits[:, 2], axis=1))

    def at_limit(self, w: FloatArray) -> bool:
        """Tell whether a point is at a physical limit (S0 = S), where conditions degenerate together."""
        return bool(self.within_limits(w[None, :])[0] < _AT_LIMIT * np.min(self.box.widths))

    def joints_of(self, orbit: Orbit) -> FloatArray:
        """Return the joints of an event's orbit in this problem, which may be that of its half."""
        return orbit.joints if orbit.system is self.system else orbit.as_half().joints

    def orbit(self, joints: FloatArray, w: FloatArray) -> Orbit:
        """Return a point as an orbit."""
        return Orbit(self.system, joints.copy(), with_entries(self.vector, self.which, w), 0.0)


def problem_of(bifurcation: Bifurcation, box: PlaneRanges) -> Problem:
    """Return the problem of a bifurcation's curve.

    Raises
    ------
    ParameterError
        If the bifurcation has no curve of its own, or is not what it says.
    """
    check_start(bifurcation, box)
    kind, orbit = bifurcation.kind, bifurcation.orbit
    make = _sliding_problem if kind in TERMINAL or kind is Kind.T else _spectral_problem
    return make(bifurcation, orbit, box)


def check_start(bifurcation: Bifurcation, box: PlaneRanges) -> None:
    """Refuse what no curve starts from.

    Raises
    ------
    ParameterError
        For what is no located bifurcation inside the plane, or lies on a bridge.
    """
    if not bifurcation.located:
        raise ParameterError(f"{bifurcation!r} is not located: its curve has no start")
    kind, orbit = bifurcation.kind, bifurcation.orbit
    if orbit.system.holds:
        raise ParameterError(
            f"{bifurcation!r} lies on a bridge: curves of orbits with holds are not"
        )
    box.check_holds(kind.value, orbit.params)


def _spectral_problem(bifurcation: Bifurcation, orbit: Orbit, box: PlaneRanges) -> Problem:
    from contfric.curves.equations.conditions import SPECTRAL, Condition

    kind = bifurcation.kind
    orbit = orbit.as_half() if kind is Kind.BP else orbit
    sign = 1.0 if kind is Kind.SN else -1.0
    if kind is Kind.BP and not orbit.system.half:
        raise ParameterError(
            f"{bifurcation!r} breaks no symmetry: such a point is of codimension two, and has no curve"
        )
    mu = orbit.turn_multipliers
    if not np.any(np.abs(mu - sign) < _MULTIPLIER):
        raise ParameterError(
            f"{bifurcation!r} is no {kind.value}: the multipliers of a turn are "
            f"{', '.join(f'{m:.6g}' for m in mu)}, and none is {sign:g}"
        )
    none = np.empty(0, dtype=np.int64)
    condition = Condition(SPECTRAL, 0, 0, sign, -1, none, none)
    return Problem(kind, orbit.system, orbit.vector.copy(), box, condition, None)


def _sliding_problem(bifurcation: Bifurcation, orbit: Orbit, box: PlaneRanges) -> Problem:
    from contfric.curves.equations.conditions import EXIT, INTERIOR, JOINT, START, Condition

    kind, system, model = bifurcation.kind, orbit.system, orbit.model
    if not bifurcation.tests:
        raise ParameterError(f"{bifurcation!r} does not say which margin vanishes")
    test = _chosen(bifurcation)
    if kind is Kind.T:
        location, segment, surface = tangency(orbit, test)
    else:
        if test not in system.tests:
            raise ParameterError(f"{bifurcation!r}: its orbit has no margin {test}")
        margin = float(orbit.margins[system.tests.index(test)])
        if not abs(margin) < _VANISHES:
            raise ParameterError(
                f"{bifurcation!r} is no bifurcation: its margin is {margin:.3g}, not zero"
            )
        locations = {
            Margin.JOINT: JOINT,
            Margin.EXIT: EXIT,
            Margin.INTERIOR: INTERIOR,
            Margin.ENTRY: START,
        }
        location, segment, surface = locations[test.margin], test.segment, test.surface
        if test not in bifurcation.tests:
            kind = kind_of_margin(system, test, orbit)
    pinned = [] if kind is Kind.T else _vanishing(orbit)
    rest = -1
    if kind in (Kind.CS, Kind.SS) and location == JOINT:
        rest = _rest_mode(orbit, test)
    condition = Condition(
        location,
        segment,
        model.surface_index[surface],
        1.0,
        rest,
        np.array(pinned, dtype=np.int64),
        _quiet(system, kind, segment, [system.tests[k] for k in pinned]),
    )
    return Problem(kind, system, orbit.vector.copy(), box, condition, test)


def _vanishing(orbit: Orbit) -> list[int]:
    return [int(k) for k in np.flatnonzero(np.abs(orbit.margins) < _VANISHES)]


def _chosen(bifurcation: Bifurcation) -> EventFunction:
    """Return the margin of an event that its curve follows: one at a joint whose exit is not tangential.

    Where nothing jumps a stop without acceleration is one at which the load is on its limit, and an
    impact without speed is one at which the speed is zero: one condition by two names. The row of the exit
    is singular there, and only as a tangential exit does it get its rate. So a margin without one comes
    first, and where all have one the exit itself is taken.
    """
    tests = bifurcation.tests
    exits = [_tangential(test, bifurcation.orbit) for test in tests]
    plain = next((test for test, exit_ in zip(tests, exits, strict=True) if exit_ is None), None)
    return plain or exits[0] or tests[0]


def _tangential(test: EventFunction, orbit: Orbit) -> EventFunction | None:
    """Return the exit whose tangency is the same condition as a margin at its joint; None if none is."""
    model, itinerary = orbit.model, orbit.system.itinerary
    if test.margin is not Margin.JOINT or not (
        nothing_jumps(orbit) or model.reset_at(*itinerary[test.segment]) is not None
    ):
        return None
    exits = (
        t
        for t, value in zip(orbit.system.tests, orbit.margins, strict=True)
        if t.margin is Margin.EXIT and t.segment == test.segment and abs(value) < _VANISHES
    )
    return next(exits, None)


def _rest_mode(orbit: Orbit, test: EventFunction) -> int:
    """Return the mode of rest whose rate at a stop tells CS from SS; -1 where there is no rest."""
    resting = rest_at(test, orbit)
    return -1 if resting is None else orbit.model.mode_index[resting.mode]


def _quiet(system: System, kind: Kind, segment: int, pinned: list[EventFunction]) -> IntArray:
    """Return the rows of labels that say nothing along the curve: a joint lies on the surface."""
    count = system.segments
    near = {segment} if kind is Kind.T else set()
    for test in pinned:
        near |= {test.segment, (test.segment + 1) % count}
    rows = [k for k, row in enumerate(system.layout.labels) if int(row[0]) in near]
    return np.array(rows, dtype=np.int64)


def tangency(orbit: Orbit, test: EventFunction) -> tuple[int, int, str]:
    """Return (location, segment, surface) of a tangency: where an observable is nearest to a surface."""
    from contfric.curves.equations.conditions import INTERIOR, JOINT, START

    model, segment = orbit.model, test.segment
    named = [s for s in model.surfaces if s.observable == test.surface]
    start, end = orbit.begins[segment], orbit.ends[segment]
    _, values = stationary_within(orbit, segment, test.surface)
    reached: list[tuple[float, int, str]] = []
    entry, exit_ = orbit.itinerary[segment - 1][1], orbit.itinerary[segment][1]
    ends = {START: (start, entry), JOINT: (end, exit_)}
    for surface in named:
        level = orbit.flow.level(surface.name)
        reached += [(abs(v - level), INTERIOR, surface.name) for v in values]
        for location, (joint, on) in ends.items():
            if on != surface.name:
                value = orbit.flow.observe(test.surface, float(joint[0]), joint[1:])
                reached.append((abs(value - level), location, surface.name))
    gap, location, name = min(reached)
    if gap > _VANISHES:
        raise ParameterError(f"there is no tangency in segment {segment + 1}: the gap is {gap:.3g}")
    return location, segment, name


def border_of(problem: Problem, joints: FloatArray, vector: FloatArray) -> FloatArray:
    """Return the vectors b and c for a first point, shape (2, N, m): the singular vectors of the chain."""
    border = np.zeros((2, *joints.shape))
    if problem.test is not None:
        return border
    a, b, _, close = jacobian_blocks(problem.system, joints, vector)
    count, m = joints.shape
    u, _, vh = np.linalg.svd(stacked(a, b, problem.condition.sign * close))
    border[0], border[1] = u[:, -1].reshape(count, m), vh[-1].reshape(count, m)
    return border
