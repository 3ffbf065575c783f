r"""Conditions on quantities of orbits, for the compiled march: what vanishes along a curve, and its points.

The unknowns are the joints z and q parameters w, of which q - 1 conditions leave a curve. An extremum over
the orbit is differentiated in compiled code (:mod:`contfric.curves.equations.lagrangian`). Any other
quantity is a function of Python that the march calls. In the scaled product of
:mod:`contfric.continuation.core.geometry` z and w are one vector x. The null space of F' has q directions T,
from a QR factorisation of the transpose; with the shortest step :math:`\delta_0` to the orbits,
:math:`F'\delta_0 = -F`, the row

.. math:: r = C'T\,T^T + \frac{C'\delta_0\,\delta_0^T}{\delta_0^T\delta_0}

takes the place of C': both agree in all directions that a step of Newton's method may have. So conditions are
differentiated in q + 1 directions only. Of integrals and extrema the row itself is known
(:mod:`contfric.orbit.functionals.integrals`), and nothing of this is needed.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray, IntArray, with_entries
from contfric.base.interrupts import held_back
from contfric.bvp.linear import equations_at
from contfric.bvp.system import System
from contfric.continuation.points import Point, PointRows
from contfric.curves.points import solve_point
from contfric.curves.ranges import Ranges, limits_of
from contfric.curves.special import CurveEnd, CurveEndReason
from contfric.errors import ConvergenceError
from contfric.orbit.orbit import Orbit
from contfric.quantities.extreme import in_rows, peak_of
from contfric.quantities.measure import differentiated
from contfric.quantities.motion import Directions
from contfric.quantities.registry import Quantity

if TYPE_CHECKING:
    from contfric.curves.equations.conditions import Condition
    from contfric.curves.equations.held_conditions import Conditions
    from contfric.orbit.functionals.peak import Extreme

#: A first point this near to the orbit (scaled) is the one that belongs to it.
_NEAR = 0.02
#: Slopes along the orbits this small next to those by joints and parameters, which cancel, or next to the
#: quantity itself, over the ranges: rounding. Orbits are solved to 1e-13, and a fold amplifies that.
_STILL = 1e-10
#: Step of the central differences in scaled unknowns: the cube root of rounding balances both errors, 1e-10.
_STEP = 6e-6


class Defects(NamedTuple):
    """What vanishes on the curve, shape (c,), and its scaled rows, shape (c, N m + q)."""

    values: FloatArray
    rows: FloatArray


class _Called:
    """A function of Python that compiled code calls by its address; what it raises is kept.

    Parameters
    ----------
    fill : returns whether it has filled its arrays
    """

    def __init__(self, fill: Callable[[], bool]) -> None:
        self.raised: BaseException | None = None
        self._fill = fill
        self._function = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(self._call)

    @property
    def address(self) -> int:
        """Where it is called."""
        return int(ctypes.cast(self._function, ctypes.c_void_p).value or 0)

    def _call(self, _: int) -> int:
        if self.raised is not None:
            return 0
        try:
            return int(self._fill())
        except ConvergenceError:  # at a fold: a shorter step may do
            return 0
        except BaseException as error:  # raised again when the compiled code has returned
            self.raised = error
            return 0


@dataclass(frozen=True, eq=False)
class Held:
    """A quantity that is held at a value while two parameters vary.

    Attributes
    ----------
    orbit : any orbit of the curve: its equations, and the parameters that do not vary
    quantity, value : what is held, and at what; None where :meth:`defects` are others
    box : the parameters that vary
    """

    orbit: Orbit
    quantity: Quantity | None
    value: float
    box: Ranges

    @cached_property
    def which(self) -> IntArray:
        """Indices of the parameters that vary."""
        return np.array([self.orbit.model.index_of(n) for n in self.box.names], dtype=np.int64)

    @property
    def title(self) -> str:
        """What the orbits of the curve have in common."""
        return f"{self.quantity.name} = {self.value:g}" if self.quantity else ""

    @property
    def system(self) -> System:
        """Boundary-value problem of the orbits."""
        return self.orbit.system

    @property
    def vector(self) -> FloatArray:
        """All parameters of the orbit."""
        return self.orbit.vector

    @property
    def border(self) -> FloatArray:
        """Space where a bifurcation has its null vectors, shape (2, N, m)."""
        return np.zeros((2, *self.orbit.joints.shape))

    @cached_property
    def weights(self) -> FloatArray:
        """What the unknowns are divided by to become the scaled vector, shape (N m + q,)."""
        root = np.sqrt(len(self.orbit.joints))
        return np.concatenate([np.full(self.orbit.joints.size, root), self.box.widths])

    def scaled(self, orbit: Orbit) -> FloatArray:
        """Return an orbit as a scaled vector."""
        return np.concatenate([orbit.joints.ravel(), orbit.vector[self.which]]) / self.weights

    def at(self, x: FloatArray) -> Orbit:
        """Return a scaled vector as an orbit."""
        plain, size = x * self.weights, self.orbit.joints.size
        return self.orbit_at(plain[:size].reshape(self.orbit.joints.shape), plain[size:])

    def orbit_at(self, joints: FloatArray, w: FloatArray) -> Orbit:
        """Return the orbit with these joints and parameters."""
        moved = with_entries(self.orbit.vector, self.which, w)
        return replace(self.orbit, joints=joints, vector=moved)

    def orbit_of(self, point: Point) -> Orbit:
        """Return a point as an orbit."""
        return self.orbit_at(point.joints, point.w)

    # ------------------------------------------------------------------ what vanishes

    def defects(self, orbit: Orbit) -> Defects:
        """Return what vanishes along the curve, with its rows."""
        assert self.quantity is not None
        if in_rows(self.quantity):
            found = differentiated(self.quantity, orbit, self._every)
            return Defects(np.array([found.value - self.value]), found.ahead[None])
        columns = self.in_plane(orbit)
        found = differentiated(self.quantity, orbit, self.directions(columns))
        return Defects(np.array([found.value - self.value]), found.ahead[None] @ spread(columns))

    @cached_property
    def _every(self) -> Directions:
        """All scaled directions, one by one: for quantities whose rows are known, whatever the direction."""
        return self.directions(np.eye(len(self.weights)))

    def still(self) -> bool:
        """Tell whether the quantity does not move with the orbits: its slopes are rounding.

        Next to their parts, the quantity, or (of one that is rounding itself) the states.
        """
        assert self.quantity is not None
        orbit = self.orbit
        try:
            columns, row = self.in_plane(orbit), self.defects(orbit).rows[0]
        except ConvergenceError:  # that is for the march to say
            return False
        slope = float(np.linalg.norm(row @ columns[:, 1:]))
        parts = float(np.linalg.norm(row)) if in_rows(self.quantity) else 0.0
        states = float(np.max(np.abs(orbit.joints[:, 1:])))
        value = abs(self.value) if abs(self.value) > _STILL * states else states
        return slope <= _STILL * max(parts, value)

    def in_plane(self, orbit: Orbit) -> FloatArray:
        """Return the shortest step to the orbits and the plane of them, scaled, shape (N m + q, 1 + q)."""
        at = orbit.system, orbit.joints, orbit.vector
        left, on_joints, on_parameters = equations_at(*at, self.which)
        jacobian = np.hstack([on_joints, on_parameters]) * self.weights
        if not (np.all(np.isfinite(jacobian)) and np.all(np.isfinite(left))):
            raise ConvergenceError("the equations of the orbit are not finite", orbit)
        basis, upper = np.linalg.qr(jacobian.T, mode="complete")
        rows = len(left)
        try:
            shortest = -basis[:, :rows] @ np.linalg.solve(upper[:rows].T, left)
        except np.linalg.LinAlgError as error:
            raise ConvergenceError("the orbits have no tangent plane", orbit) from error
        return np.column_stack([shortest, basis[:, rows:]])

    def differences(self, orbit: Orbit, value: Callable[[Orbit], Any]) -> FloatArray:
        """Return rows of one or more values in the tangent plane of the orbits, by central differences."""
        x, plane = self.scaled(orbit), self.in_plane(orbit)[:, 1:]
        slopes = [
            (value(self.at(x + _STEP * c)) - value(self.at(x - _STEP * c))) / (2.0 * _STEP)
            for c in plane.T
        ]
        return np.asarray(np.atleast_2d(np.array(slopes).T) @ plane.T)

    def directions(self, columns: FloatArray) -> Directions:
        """Return scaled directions, shape (N m + q, D), as solutions of joints and parameters."""
        plain, size = columns * self.weights[:, None], self.orbit.joints.size
        vector = np.zeros((len(self.orbit.vector), columns.shape[1]))
        vector[self.which] = plain[size:]
        return Directions(plain[:size].reshape(*self.orbit.joints.shape, -1), vector)

    @cached_property
    def extreme(self) -> Extreme | None:
        """The quantity as an extremum that compiled code differentiates, if it is one."""
        peak = None if self.quantity is None else peak_of(self.quantity)
        if peak is None:
            return None
        from contfric.orbit.functionals.peak import Extreme

        return Extreme(*peak, self.orbit.as_whole().system.layout)

    @property
    def kind(self) -> int:
        """What is asked of an extremum."""
        from contfric.curves.equations.held_conditions import AT_VALUE

        return AT_VALUE

    def conditions(self) -> tuple[Condition, Conditions]:
        """Return what vanishes, as the compiled engine takes it."""
        return self._compiled[:2]

    @contextmanager
    def calling(self) -> Iterator[None]:
        """Hold Ctrl-C back, which compiled code would print and drop; raise what a function has raised."""
        with held_back():
            yield
        called = self._compiled[2]
        if called.raised is not None:
            error, called.raised = called.raised, None
            raise error

    @cached_property
    def _compiled(self) -> tuple[Condition, Conditions, _Called, object]:
        """The conditions as the march takes them, what it calls, and what keeps that alive."""
        from contfric.curves.equations.conditions import QUANTITY, Condition
        from contfric.curves.equations.held_conditions import CALLED, FILL, Conditions
        from contfric.handle import Block
        from contfric.orbit.functionals.peak import Extreme

        shape, q = self.orbit.joints.shape, len(self.box.names)
        joints, vector = np.empty(shape), np.empty(len(self.orbit.vector))
        values, on_joints, on_parameters = (
            np.empty(q - 1),
            np.empty((q - 1, *shape)),
            np.empty((q - 1, q)),
        )

        def fill() -> bool:
            found = self.defects(replace(self.orbit, joints=joints.copy(), vector=vector.copy()))
            plain = found.rows / self.weights
            values[:] = found.values
            on_joints[:] = plain[:, : joints.size].reshape(on_joints.shape)
            on_parameters[:] = plain[:, joints.size :]
            return bool(np.all(np.isfinite(plain)))

        called = _Called(fill)
        block = Block(FILL, {"fill": called})
        extreme = self.extreme or Extreme(-1, 0, 1.0, self.orbit.system.layout)
        kind = CALLED if self.extreme is None else self.kind
        arrays = joints, vector, values, on_joints, on_parameters
        held = Conditions(kind, self.value, extreme, block.address, *arrays)
        quiet = np.arange(len(self.system.layout.labels))
        condition = Condition(QUANTITY, 0, 0, 1.0, -1, np.empty(0, dtype=np.int64), quiet)
        return condition, held, called, block

    # ------------------------------------------------------------------ points of the curve

    def solve(self, guess: Point) -> Point | None:
        """Solve for the point normal to the tangent of a guess, through it; None if Newton fails."""
        given = guess.joints, guess.w, guess.tangent, guess.direction
        return solve_point(self, *given, self.border)

    def first(self) -> Point | None:
        """Return the point next to the orbit, with one of the parameters fixed: the last, if it goes."""
        widths, best, gap = self.box.widths, None, np.inf
        empty = PointRows.empty(self.orbit.system, 1, len(widths)).point(0)
        here = replace(
            empty,
            joints=self.orbit.joints,
            w=self.orbit.vector[self.which],
            tangent=0 * self.orbit.joints,
        )
        for k in reversed(range(len(widths))):
            found = self.solve(replace(here, direction=np.eye(len(widths))[k] * widths))
            away = np.inf if found is None else self.apart(here, found)
            if away < gap:
                best, gap = found, away
            if gap < _NEAR:
                break
        return best

    def apart(self, one: Point, other: Point) -> float:
        """Return the distance of two points in the scaled product."""
        joints = float(np.sum((one.joints - other.joints) ** 2)) / len(one.joints)
        w = float(np.sum(((one.w - other.w) / self.box.widths) ** 2))
        return float(np.sqrt(joints + w))

    # ------------------------------------------------------------------ where it ends

    @cached_property
    def sides(self) -> tuple[FloatArray, FloatArray]:
        """Rows (a, c) with ``a . w + c >= 0`` inside of the ranges, and inside of the model's limits."""
        return self.box.edges, limits_of(self.orbit.model, self.orbit.vector, self.box)

    def inside(self, point: Point) -> tuple[float, float, float, float]:
        """Return the least distance to the ranges and to the model's limits, margin, and further bound."""
        ends = [np.min(rows[:, :-1] @ point.w + rows[:, -1], initial=np.inf) for rows in self.sides]
        margins = point.tests[: len(self.orbit.system.tests)]
        found = (*ends, np.min(margins, initial=np.inf), self.bound(point))
        a, b, c, d = (float(np.nan_to_num(value, nan=-1.0, posinf=1e3)) for value in found)
        return a, b, c, d

    def bound(self, point: Point) -> float:
        """Return what else has to be positive along the curve."""
        return np.inf

    def end_at_bound(self, point: Point) -> CurveEnd:
        """Return why the curve ends where that is zero."""
        return CurveEnd(CurveEndReason.LOST)


def spread(columns: FloatArray) -> FloatArray:
    """Return what makes rows of slopes in a direction and in an orthonormal basis normal to it."""
    square = float(columns[:, 0] @ columns[:, 0])
    found = columns.T.copy()
    found[0] /= square if square > 0.0 else 1.0
    return found
