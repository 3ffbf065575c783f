"""A quantity held at a value while two parameters vary: the curve of such orbits, both ways, to its ends.

The march is that of :mod:`contfric.continuation.march`, step for step, with the corrector of
:mod:`contfric.curves.quantity_step`. A curve ends at the edge of the ranges, at a limit of the model's
parameters, and where a margin of its orbits vanishes; all three are zeros of one function, the least of
what has to be positive, and are located by Brent's method.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from contfric.continuation.events import EndReason, kind_of_margin
from contfric.continuation.points import MOST_POINTS, SMALLEST_STEP
from contfric.continuation.trace import continue_orbit
from contfric.curves.problem import Box, box_of
from contfric.curves.quantity_curve import QuantityCurve
from contfric.curves.quantity_step import Held, Solved, solve_held
from contfric.curves.special import CurveEnd, CurveEndReason
from contfric.curves.trace import largest_step
from contfric.errors import ConvergenceError, ParameterError, real_number, whole_number
from contfric.models.definition import FloatArray
from contfric.orbit.orbit import Orbit
from contfric.orbit.sections import canonical
from contfric.quantities.measure import differentiated
from contfric.quantities.registry import Quantity, number_quantity

#: Angle between tangents (rad), wanted and accepted, and most that a step grows by: as along branches.
_WANTED, _MOST_ANGLE, _GROWTH = 0.12, 0.35, 2.5
#: First step, in largest steps: the curvature is not known yet.
_FIRST = 0.1
#: A start whose quantity is this near to the value (relative to 1 + its size) is on the curve.
_AT_VALUE = 1e-9


def continue_quantity(
    orbit: Orbit,
    quantity: str,
    value: float,
    parameters: tuple[str, str],
    ranges: Mapping[str, tuple[float, float]],
    *,
    max_step: float | None = None,
    max_points: int = MOST_POINTS,
) -> QuantityCurve:
    """Continue the orbits on which a quantity has one value, in two parameters.

    Where the start has another value, the first orbit that has it is looked for along the branch in the first
    parameter, then in the second.

    Parameters
    ----------
    orbit : Orbit
        Where to start.
    quantity : str
        A quantity by its name or as an expression, such as ``"x_max"``.
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
    largest = largest_step(max_step, orbit.model)
    whole_number("max_points", max_points, least=2)
    start = _start(orbit, held_quantity, value, box)
    held = Held(start, held_quantity, value, box)
    first = solve_held(held, held.scaled(start), None)
    if first is None:
        raise ConvergenceError(
            f"the orbits with {quantity} = {value:g} have no unique direction at the start", start
        )
    return both_sides(held, first, largest, max_points)


def both_sides(held: Held, first: Solved, largest: float, max_points: int) -> QuantityCurve:
    """Trace a curve from its first point both ways."""
    ahead = HeldSide(held, [first], largest)
    ahead.trace(max_points)
    behind = HeldSide(held, [Solved(first.x, -first.tangent, first.orbit)], largest)
    if ahead.end.reason in (CurveEndReason.CLOSED, CurveEndReason.INTERRUPTED):
        behind.end = ahead.end
    else:
        behind.trace(max_points)
    return _joined(held, behind, ahead)


def _start(orbit: Orbit, quantity: Quantity, value: float, box: Box) -> Orbit:
    """Return an orbit on the curve: the given one, or one of a branch through it."""
    if not orbit.converged:
        raise ConvergenceError(f"the orbit is not solved: {orbit.status.value}", orbit)
    here = np.array([orbit.params[name] for name in box.names])
    if not box.contains(here):
        where = ", ".join(f"{n} = {v:.6g}" for n, v in zip(box.names, here, strict=True))
        raise ParameterError(f"the orbit is at {where}, outside of the ranges")
    miss = differentiated(quantity, orbit, None).value - value
    if abs(miss) < _AT_VALUE * (1.0 + abs(value)):
        return canonical(orbit).as_half()
    seen: list[str] = []
    for k, name in enumerate(box.names):
        bounds = float(box.low[k]), float(box.high[k])
        branch = continue_orbit(
            orbit, name, bounds, stability=False, stop_at={quantity.name: value}
        )
        stopped = [
            i for i, end in zip((0, -1), branch.ends, strict=True) if end.reason is EndReason.STOP
        ]
        if stopped:
            return branch[stopped[0]]
        values = branch.quantity(quantity.name)
        seen.append(f"from {np.min(values):.6g} to {np.max(values):.6g} along {name}")
    raise ConvergenceError(
        f"no orbit of this signature with {quantity.name} = {value:g} was found: it is {' and '.join(seen)}",
        orbit,
    )


@dataclass(eq=False)
class HeldSide:
    """One side of a curve while it grows."""

    held: Held
    points: list[Solved]
    largest: float
    end: CurveEnd = field(default_factory=lambda: CurveEnd(CurveEndReason.POINTS))
    arc: list[float] = field(default_factory=lambda: [0.0])

    def trace(self, most: int) -> None:
        """March on until the curve ends; Ctrl-C ends it where it is."""
        step = _FIRST * self.largest
        try:
            while len(self.points) < most:
                step, finished = self._advance(step)
                if finished:
                    return
        except KeyboardInterrupt:
            self.end = CurveEnd(CurveEndReason.INTERRUPTED)

    def _advance(self, step: float) -> tuple[float, bool]:
        """Take one step; (next step, whether the side is finished)."""
        last = self.points[-1]
        while True:
            if step < SMALLEST_STEP:
                self.end = CurveEnd(CurveEndReason.STEP)
                return step, True
            found = solve_held(self.held, self._predicted(step), last.tangent)
            angle = np.inf if found is None else _angle(last, found)
            if found is not None and angle <= _MOST_ANGLE:
                break
            step *= 0.5
        taken = float(np.linalg.norm(found.x - last.x))
        if inside(self.held, found) < 0.0:
            self._finish(last, found)
            return step, True
        self.points.append(found)
        self.held.solved()
        self.arc.append(self.arc[-1] + taken * (1.0 + angle**2 / 24.0))
        if len(self.points) > 4 and self._returned(taken):
            self.end = CurveEnd(CurveEndReason.CLOSED)
            return step, True
        size = 1.0 + float(np.max(np.abs(found.orbit.joints[:, 1:])))
        factor = min(_GROWTH, max(0.4, _WANTED / max(angle, 1e-6)))
        return min(self.largest * size, step * factor), False

    def _predicted(self, step: float) -> FloatArray:
        """Return the prediction: along the tangent, bent as over the last step."""
        last = self.points[-1]
        guess = last.x + step * last.tangent
        if len(self.points) > 1:
            back = float(np.linalg.norm(last.x - self.points[-2].x))
            guess = guess + 0.5 * step**2 / back * (last.tangent - self.points[-2].tangent)
        return np.asarray(guess)

    def _returned(self, step: float) -> bool:
        """Tell whether the last step has passed the start again, in its direction."""
        first, turns = self.points[0], self._turns()
        before, last = (self._folded(point, turns) for point in self.points[-2:])
        if np.linalg.norm(last - first.x) > 1.5 * step:
            return False
        passed = [float(x @ first.tangent) for x in (before, first.x, last)]
        return passed[0] < passed[1] <= passed[2]

    def _turns(self) -> int:
        """Return the whole periods by which the last point is later than the first.

        Around a resonance the phase of the motion turns once, and the same orbit is met a period later.
        """
        first, last = self.points[0].orbit, self.points[-1].orbit
        if first.model.autonomous:
            return 0
        return round(float(last.joints[0, 0] - first.joints[0, 0]) / first.flow.period)

    def _folded(self, point: Solved, turns: int) -> FloatArray:
        """Return a point so many of its own periods earlier: a period changes along the curve."""
        if not turns:
            return point.x
        joints = point.orbit.joints.copy()
        joints[:, 0] -= turns * point.orbit.flow.period
        return self.held.scaled(replace(point.orbit, joints=joints))

    def _finish(self, before: Solved, after: Solved) -> None:
        """Locate where the orbits leave what is allowed, and end there."""
        from scipy.optimize import brentq

        chord = after.x - before.x

        def solved_at(share: float) -> Solved:
            found = solve_held(self.held, before.x + share * chord, before.tangent)
            if found is None:
                raise ArithmeticError
            return found

        def inside_at(share: float) -> float:
            return inside(self.held, solved_at(share)) if share < 1.0 else inside(self.held, after)

        try:
            if inside(self.held, before) > 0.0:
                # to the last digits of a step
                share = float(brentq(inside_at, 0.0, 1.0, xtol=1e-15, rtol=1e-14))
                point = solved_at(share)
                self.points.append(point)
                self.arc.append(self.arc[-1] + float(np.linalg.norm(point.x - before.x)))
        except ArithmeticError:
            self.end = CurveEnd(CurveEndReason.STEP)
            return
        self.end = _end_at(self.held, self.points[-1])


def _angle(one: Solved, other: Solved) -> float:
    return math.acos(min(1.0, max(-1.0, float(one.tangent @ other.tangent))))


def _bounds(held: Held, point: Solved) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return what has to be positive: distances to the edges, to the model's limits, and the margins."""
    w = point.orbit.vector[held.which]
    edges = held.box.edges[:, :-1] @ w + held.box.edges[:, -1]
    params = point.orbit.params
    varying = set(held.box.names)
    constraints = held.orbit.model.constraints
    limits = [c.value(params) for c in constraints if varying & set(c.coefficients)]
    return edges, np.array(limits), point.orbit.margins


def inside(held: Held, point: Solved) -> float:
    """Return the least of what has to be positive."""
    least = [np.min(part, initial=np.inf) for part in _bounds(held, point)]
    least.append(np.min(held.bounds(point.orbit), initial=np.inf))
    return float(np.nan_to_num(min(least), nan=-1.0, posinf=1e3))


def _end_at(held: Held, point: Solved) -> CurveEnd:
    """Return why a curve ends at a located point."""
    edges, limits, margins = _bounds(held, point)
    least = [float(np.min(part, initial=np.inf)) for part in (edges, limits, margins)]
    first = int(np.argmin(least))
    if first < 2:
        return CurveEnd((CurveEndReason.RANGE, CurveEndReason.LIMIT)[first])
    if np.min(held.bounds(point.orbit), initial=np.inf) < least[2]:
        return held.end_at_bound(point.orbit)
    test = held.orbit.system.tests[int(np.argmin(margins))]
    kind = kind_of_margin(held.orbit.system, test, point.orbit)
    return CurveEnd(CurveEndReason.MEETS, f"{kind.value}: beyond it the orbits are not admissible")


def _joined(held: Held, behind: HeldSide, ahead: HeldSide) -> QuantityCurve:
    """Return one curve from the two sides of its start."""
    points = [*behind.points[:0:-1], *ahead.points]
    arc = np.array([*(-a for a in behind.arc[:0:-1]), *ahead.arc])
    orbits = [point.orbit for point in points]
    return QuantityCurve(
        held.quantity.name if held.quantity else "",
        held.value,
        held.box.names,
        held.orbit.system,
        held.orbit.vector,
        np.array([orbit.vector[held.which] for orbit in orbits]),
        np.array([orbit.joints for orbit in orbits]),
        arc - arc[0],
        np.array([orbit.stable for orbit in orbits]),
        (behind.end, ahead.end),
    )
