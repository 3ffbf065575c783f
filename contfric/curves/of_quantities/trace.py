"""A quantity held at a value while two parameters vary: the curve of such orbits, both ways, to its ends.

A curve ends at the edge of the ranges, at a limit of the model's parameters, and where a margin of its orbits
vanishes; all three are zeros of one function, the least of what has to be positive.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.continuation.points import FIRST_STEP, MOST_POINTS, Point
from contfric.continuation.trace import continue_orbit
from contfric.curves.codimension_two.locating import CurveStep
from contfric.curves.of_quantities.curve import QuantityCurve
from contfric.curves.of_quantities.step import Held
from contfric.curves.points import end_of_march, march_on
from contfric.curves.ranges import PlaneRanges, Ranges, box_of
from contfric.curves.special import CurveEnd, CurveEndReason
from contfric.curves.trace import Progress, checked_options
from contfric.errors import (
    ConvergenceError,
    ParameterError,
    real_number,
)
from contfric.events.bifurcation import EndReason
from contfric.events.sliding_kinds import kind_of_margin
from contfric.orbit.canonical.sections import canonical
from contfric.orbit.orbit import Orbit
from contfric.quantities.measure import differentiated
from contfric.quantities.registry import Quantity, QuantityLike, number_quantity

#: A start whose quantity is this near to the value (relative to 1 + its size) is on the curve.
_AT_VALUE = 1e-9


def continue_quantity(
    orbit: Orbit,
    quantity: QuantityLike,
    value: float,
    parameters: tuple[str, str],
    ranges: Mapping[str, tuple[float, float]],
    *,
    max_step: float | None = None,
    max_points: int = MOST_POINTS,
    progress: Progress | None = None,
) -> QuantityCurve:
    """Continue the orbits on which a quantity has one value, in two parameters.

    Where the start has another value, the first orbit that has it is looked for along the branch in the first
    parameter, then in the second.

    Parameters
    ----------
    orbit : Orbit
        Where to start.
    quantity : str or callable
        A quantity by its name or as an expression, such as ``"x_max"``, or a function of an orbit.
    value : float
        What it is held at.
    parameters : (str, str)
        The two parameters that vary.
    ranges : dict
        Where each of them may go.
    max_step : float, optional
        Largest step, as for :func:`contfric.continue_bifurcation`.
    max_points : int
        Most points of each side.
    progress : callable, optional
        Called with one line of text now and then.

    Returns
    -------
    QuantityCurve
        With k points: ``values`` of both parameters, shape (k, 2), ``stable`` (k,), and two ``ends``.

    Raises
    ------
    ParameterError
        If the quantity, the parameters or the ranges are not valid.
    ConvergenceError
        If no orbit with that value is found.

    Notes
    -----
    The curve ends where the signature of its orbits does (at CS, SS, AS or GS), with the
    reason MEETS. Stability is that of the points; where it changes between two of them is not located.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.solve_orbit("coulomb", "1a", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> ranges = {"Omega": (0.48, 0.55), "S": (0.25, 0.35)}
    >>> curve = cf.continue_quantity(orbit, "x_max", 1.43, ("Omega", "S"), ranges)
    >>> bool(abs(curve[-1].x_max - 1.43) < 1e-12)
    True
    """
    if not isinstance(orbit, Orbit):
        raise ParameterError(f"continuation starts from an Orbit, got {type(orbit).__name__}")
    held_quantity = number_quantity(quantity, orbit.model, "a curve")
    value = real_number("value", value)
    box = box_of(orbit.model, parameters, ranges)
    largest = checked_options(orbit.model, max_step, max_points, progress)
    start = _start(orbit, held_quantity, value, box, progress)
    held = Held(start, held_quantity, value, box)
    first = None if held.still() else held.first()
    if first is None:
        raise ConvergenceError(
            f"the orbits with {held_quantity.name} = {value:g} have no unique direction at the start: it may "
            f"not depend on {' and '.join(box.names)}, or be extreme there",
            start,
        )
    return both_sides(held, first, largest, max_points, progress)


def both_sides(
    held: Held, first: Point, largest: float, max_points: int, progress: Progress | None = None
) -> QuantityCurve:
    """Trace a curve from its first point both ways."""
    points, arc, ends = trace_both(held, first, largest, max_points, progress)
    directions = held.orbit.model.directions
    return QuantityCurve(
        held.quantity.name if held.quantity else "",
        held.value,
        held.box.names,
        held.orbit.system,
        held.orbit.vector,
        np.array([point.w for point in points]),
        np.array([point.joints for point in points]),
        arc,
        np.array([np.all(np.abs(point.mu[:directions]) < 1.0) for point in points]),
        ends,
    )


def trace_both(
    held: Held, first: Point, largest: float, max_points: int, progress: Progress | None = None
) -> tuple[list[Point], FloatArray, tuple[CurveEnd, CurveEnd]]:
    """Return the points of a curve in one direction, with arclengths, and why it ends at both."""
    ahead = HeldSide(held, [first], largest, progress)
    ahead.trace(max_points)
    behind = HeldSide(held, [first.reversed()], largest, progress)
    if ahead.end.reason in (CurveEndReason.CLOSED, CurveEndReason.INTERRUPTED):
        behind.end = CurveEnd(ahead.end.reason)
    else:
        behind.trace(max_points)
    back = [replace(p.reversed(), arc=-p.arc) for p in behind.points[:0:-1]]
    points = [*back, *ahead.points]
    arc = np.array([point.arc for point in points])
    return points, arc - arc[0], (behind.end, ahead.end)


def check_orbit(orbit: Orbit, box: Ranges) -> None:
    """Check that a curve may begin at an orbit.

    Raises
    ------
    ConvergenceError
        If it is not solved.
    ParameterError
        If it is outside of the ranges.
    """
    if not orbit.converged:
        raise ConvergenceError(f"the orbit is not solved: {orbit.status.value}", orbit)
    box.check_holds("the orbit", orbit.params)


def _start(
    orbit: Orbit, quantity: Quantity, value: float, box: PlaneRanges, progress: Progress | None
) -> Orbit:
    """Return an orbit on the curve: the given one, or one of a branch through it."""
    check_orbit(orbit, box)
    miss = differentiated(quantity, orbit, None).value - value
    if abs(miss) < _AT_VALUE * (1.0 + abs(value)):
        return canonical(orbit).as_half()
    seen: list[str] = []
    for k, name in enumerate(box.names):
        bounds = float(box.low[k]), float(box.high[k])
        stop_at = {quantity.asked: value}
        branch = continue_orbit(
            orbit, name, bounds, stability=False, stop_at=stop_at, progress=progress
        )
        stopped = [
            i for i, end in zip((0, -1), branch.ends, strict=True) if end.reason is EndReason.STOP
        ]
        if stopped:
            return branch[stopped[0]]
        values = branch.quantity(quantity.asked)
        values = values[np.isfinite(values)]
        seen.append(
            f"from {np.min(values):.6g} to {np.max(values):.6g} along {name}"
            if len(values)
            else f"not finite along {name}"
        )
    raise ConvergenceError(
        f"no orbit of this signature with {quantity.name} = {value:g} was found: it is {' and '.join(seen)}",
        orbit,
    )


@dataclass(eq=False)
class HeldSide:
    """One side of a curve while it grows."""

    held: Held
    points: list[Point]
    largest: float
    progress: Progress | None = None
    end: CurveEnd = field(default_factory=lambda: CurveEnd(CurveEndReason.POINTS))

    def trace(self, most: int) -> None:
        """March on until the curve ends; Ctrl-C ends it where it is."""
        step: float | None = FIRST_STEP * self.largest
        try:
            while step is not None and len(self.points) < most:
                step = self._advance(step, most)
                self._say()
        except KeyboardInterrupt:
            self.end = CurveEnd(CurveEndReason.INTERRUPTED)

    def _advance(self, step: float, most: int) -> float | None:
        """March once and keep the points up to an end; return the next step, None if there is one."""
        found = march_on(self.held, self.points, self.held.border, step, self.largest, most)
        for point in found.rows.points(found.first, found.stop):
            if min(self.held.inside(point)) < 0.0:
                self._finish(self.points[-1], point)
                return None
            self.points.append(point)
        reason = end_of_march(found.why)
        if reason is not None:
            self.end = CurveEnd(reason)
            return None
        return found.step

    def _say(self) -> None:
        """Say how far it is, if anybody listens."""
        if self.progress is not None:
            where = self.held.box.text(self.points[-1].w)
            self.progress(f"{self.held.title}: {len(self.points)} points, {where}")

    def _finish(self, before: Point, after: Point) -> None:
        """Locate where the orbits leave what is allowed, and end there."""

        def least(point: Point) -> float:
            return min(self.held.inside(point))

        fine = True
        if least(before) > 0.0:
            found, fine = CurveStep(self.held, before, after, self.held.border).zero_of(least)
            self.points += [found] if found is not before else []
        stopped = CurveEnd(CurveEndReason.STEP)
        self.end = _end_at(self.held, self.points[-1]) if fine else stopped


def _end_at(held: Held, point: Point) -> CurveEnd:
    """Return why a curve ends at a located point."""
    least = held.inside(point)
    first = int(np.argmin(least))
    if first < 2:
        return CurveEnd((CurveEndReason.RANGE, CurveEndReason.LIMIT)[first])
    if first == 3:
        return held.end_at_bound(point)
    system = held.orbit.system
    test = system.tests[int(np.argmin(point.tests[: len(system.tests)]))]
    kind = kind_of_margin(system, test, held.orbit_of(point))
    return CurveEnd(CurveEndReason.MEETS, f"{kind.value}: beyond it the orbits are not admissible")
