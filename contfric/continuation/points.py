"""Points of a branch while it is being traced, and the settings of the trace."""

from __future__ import annotations

import operator
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray, IntArray, with_entries
from contfric.base.attributes import altered
from contfric.bvp.system import System
from contfric.errors import (
    ParameterError,
    checked_range,
    mapping_of,
    real_number,
    truth,
    whole_number,
)
from contfric.models.definition import Model
from contfric.orbit.canonical.sections import is_smooth
from contfric.orbit.orbit import Orbit
from contfric.quantities.registry import number_quantity
from contfric.simulation.excitation import check_excitation

if TYPE_CHECKING:
    from contfric.continuation.branch import Branch
    from contfric.continuation.core.geometry import Points
    from contfric.quantities.registry import QuantityLike

#: Largest step of models that declare none, where the range of the parameter counts 1 (and grows with the
#: size of the state): about 100 points over the range.
LARGEST_STEP = 0.01
#: That of orbits of one smooth field, on which only folds and multipliers are watched, where nobody asks for
#: less: their steps follow the curvature, and this is for what a step might jump over.
SMOOTH_STEP = 0.1
#: First step, in largest steps: the curvature is not known yet.
FIRST_STEP = 0.1
#: Smallest step: at the resolution of a branch in double precision, far below any feature of one.
SMALLEST_STEP = 1e-10
#: Smallest largest step: below it a branch is millions of points long.
_LEAST_STEP = 1e-8
#: Widest range for a parameter of this size (1 at least): the smallest step is a tenth of it.
_RESOLVED = 1e9
#: Share of the way to the farther end of a range at which the period of the excitation is looked at.
_BESIDE = 1e-3
#: Most points of one side of a branch by default.
MOST_POINTS = 20_000
#: Extra columns of the tests after the margins and the distances of the labels; the first is the slope
#: of the parameter. (Repeated
#: from the compiled steps, which are not imported before something is traced; a test compares them.)
EXTRA = 4


@dataclass(frozen=True)
class Settings:
    """How a branch is traced.

    Attributes
    ----------
    parameter : the parameter that varies
    low, high : where it may go, after the model's limits
    low_reason, high_reason : the model's constraint that limits it there; empty for the range
    width : width of the range asked for; arclength counts it as 1
    largest : largest step
    grows : whether smooth orbits may take longer ones, as neither the user nor the model limits them
    stability : whether multipliers are evaluated (and PD detected)
    most_points : most points of one side
    copies : most copies of its shortest period that an orbit of the diagram has at a sliding event
    stop_at : quantities, and the value at which a branch ends
    up_to_mirror : whether it ends as well where its mirror image has that value
    """

    parameter: str
    low: float
    high: float
    low_reason: str
    high_reason: str
    width: float
    largest: float = LARGEST_STEP
    grows: bool = False
    stability: bool = True
    most_points: int = MOST_POINTS
    copies: int = 1
    stop_at: tuple[tuple[QuantityLike, float], ...] = ()
    up_to_mirror: bool = False

    @property
    def scale(self) -> float:
        """Weight of the parameter in the scaled product."""
        return 1.0 / self.width**2

    def largest_of(self, system: System) -> float:
        """Return the largest step along a branch of a system's orbits."""
        layout = system.layout
        if not self.grows or any(map(len, (layout.interior, layout.joint, layout.labels))):
            return self.largest
        return (
            max(self.largest, SMOOTH_STEP)
            if is_smooth(system.model, system.itinerary)
            else self.largest
        )

    @property
    def box(self) -> FloatArray:
        """Lower limit, upper limit and width, shape (3, 1)."""
        return np.array([[self.low], [self.high], [self.width]])


@dataclass(eq=False)
class Point:
    """One solved point of a branch or curve with its unit tangent and everything that is watched.

    Attributes
    ----------
    joints, w : joints, shape (N, m), and the q parameters that are free: one on a branch, two on a curve
    tangent, direction : the unit tangent, of the joints and of the parameters
    tests, labels, mu : what is watched
    arc : arclength
    lost : whether Newton fails after it before what is sought is reached
    rough : whether that is reached to the root of rounding only
    """

    joints: FloatArray
    w: FloatArray
    tangent: FloatArray
    direction: FloatArray
    tests: FloatArray
    labels: IntArray
    mu: NDArray[np.complex128]
    arc: float = 0.0
    lost: bool = False
    rough: bool = False

    @property
    def value(self) -> float:
        """The parameter of a branch."""
        return float(self.w[0])

    @property
    def slope(self) -> float:
        """The rate of the parameter of a branch."""
        return float(self.direction[0])

    def orbit(self, of: Orbit | Branch, active: int) -> Orbit:
        """Return the point of the branch through an orbit as an orbit; the same one for the same question."""
        asked, own = (of.system, of.vector, active, self.joints, self.w), vars(self)
        last: tuple[tuple[object, ...], Orbit] | None = own.get("_orbit")
        if last is not None and all(map(operator.is_, asked, last[0])):
            return last[1]
        full = with_entries(of.vector, active, self.w[0])
        found = Orbit(of.system, self.joints.copy(), full, 0.0)
        own["_orbit"] = asked, found
        return found

    def along(self, of: Orbit | Branch, active: int, distance: float) -> Orbit:
        """Return the orbit at a distance along the tangent, not solved."""
        here = self.orbit(of, active)
        return displaced(here, active, distance * self.tangent, distance * self.slope)

    def as_start(self) -> tuple[FloatArray, FloatArray]:
        """Return (joints, tangent) and (parameters, direction) as the march takes them."""
        return np.array([self.joints, self.tangent]), np.array([self.w, self.direction])

    def reversed(self) -> Point:
        """Return the same point with the opposite tangent."""
        tests = self.tests
        if len(self.w) == 1:  # a branch watches the slope of its parameter
            tests = tests.copy()
            tests[-EXTRA] *= -1.0
        found = altered(self, tangent=-self.tangent, direction=-self.direction, tests=tests)
        found.lost = found.rough = False
        return found

    def on_other_side(self) -> Point:
        """Return the same point with the arclength counted the other way."""
        return altered(self, arc=-self.arc)


@dataclass(eq=False)
class PointRows:
    """Arrays that the compiled march writes to, a point in each row."""

    joints: FloatArray
    w: FloatArray
    tangents: FloatArray
    directions: FloatArray
    arc: FloatArray
    tests: FloatArray
    labels: IntArray
    mu: NDArray[np.complex128]

    @classmethod
    def empty(cls, system: System, count: int, free: int = 1) -> PointRows:
        """Return rows for points of a system with so many free parameters."""
        shape = (count, system.segments, 1 + len(system.model.states))
        labels = len(system.layout.labels)
        return cls(
            np.empty(shape),
            np.empty((count, free)),
            np.empty(shape),
            np.empty((count, free)),
            np.zeros(count),
            np.zeros((count, len(system.tests) + labels + EXTRA)),
            np.zeros((count, labels), dtype=np.int64),
            np.zeros((count, len(system.model.states)), dtype=np.complex128),
        )

    @property
    def values(self) -> FloatArray:
        """The parameter of a branch, one value a row."""
        return self.w[:, 0]

    def arrays(self, stop: int | None = None) -> Points:
        """Return the arrays up to a row, as the march takes them."""
        from contfric.continuation.core.geometry import Points

        arrays = vars(self).values()
        return Points(*(arrays if stop is None else [array[:stop] for array in arrays]))

    def first(self, count: int) -> PointRows:
        """Return the first rows."""
        return PointRows(*[array[:count].copy() for array in vars(self).values()])

    def point(self, k: int) -> Point:
        """Return one row as a point of its own."""
        return Point(
            self.joints[k].copy(),
            self.w[k].copy(),
            self.tangents[k].copy(),
            self.directions[k].copy(),
            self.tests[k].copy(),
            self.labels[k].copy(),
            self.mu[k].copy(),
            float(self.arc[k]),
        )

    def only(self) -> Point:
        """Return the first row as a point that shares the arrays: of rows that nothing else is written to."""
        return self._shared(0)

    def points(self, start: int, stop: int) -> list[Point]:
        """Return rows as points of their own, which share one copy of each array."""
        rows = PointRows(*[array[start:stop].copy() for array in vars(self).values()])
        return [rows._shared(k) for k in range(stop - start)]

    def _shared(self, k: int) -> Point:
        """Return one row as a point that shares the arrays."""
        return Point(
            self.joints[k],
            self.w[k],
            self.tangents[k],
            self.directions[k],
            self.tests[k],
            self.labels[k],
            self.mu[k],
            float(self.arc[k]),
        )

    def put(self, k: int, point: Point) -> None:
        """Write a point to one row."""
        self.joints[k], self.w[k] = point.joints, point.w
        self.tangents[k], self.directions[k] = point.tangent, point.direction
        self.tests[k], self.labels[k] = point.tests, point.labels
        self.mu[k], self.arc[k] = point.mu, point.arc


def displaced(orbit: Orbit, active: int, joints: FloatArray, rise: float) -> Orbit:
    """Return an orbit, not solved, of which the joints and one parameter have moved by this much."""
    vector = orbit.vector.copy()
    vector[active] += rise
    return altered(orbit, joints=orbit.joints + joints, vector=vector)


def next_to(orbit: Orbit, settings: Settings, share: float) -> Orbit | None:
    """Return an orbit, not solved, at a value this share of the range away; None outside of the range."""
    active = orbit.model.index_of(settings.parameter)
    vector = orbit.vector.copy()
    vector[active] += share * settings.width
    if not settings.low <= vector[active] <= settings.high:
        return None
    return Orbit(orbit.system, orbit.joints, vector, np.inf)


def settings_of(
    orbit: Orbit,
    parameter: str,
    bounds: tuple[float, float],
    max_step: float | None,
    stability: bool,
    max_points: int,
    stop_at: Mapping[Any, float] | None = None,
) -> Settings:
    """Check what the user asked for and clip the range to the model's limits.

    Raises
    ------
    ParameterError
        For an unknown parameter, an empty, reversed or not finite range, or one without the orbit; or if
        the excitation has not the model's period along it.
    """
    if not isinstance(orbit, Orbit):
        raise ParameterError(f"continuation starts from an Orbit, got {type(orbit).__name__}")
    model = orbit.model
    model.index_of(parameter)
    low, high = checked_range(parameter, bounds)
    max_points = whole_number("max_points", max_points, least=2)
    stability = truth("stability", stability)
    if max_step is not None:
        max_step = real_number("max_step", max_step, wanted="is a share of the range, in (0, 1]")
        if not _LEAST_STEP <= max_step <= 1.0:
            raise ParameterError(
                f"max_step is a share of the range, from {_LEAST_STEP:g} to 1, got {max_step!r}"
            )
    width = high - low
    bottom, top, why_bottom, why_top = model.limits(parameter, orbit.params)
    clipped_low, clipped_high = max(low, bottom), min(high, top)
    if clipped_low >= clipped_high:
        raise ParameterError(
            f"the model allows '{parameter}' only from {bottom:g} to {top:g} ({why_bottom}"
            f"{'; ' if why_bottom and why_top else ''}{why_top}); the range is ({low:g}, {high:g})"
        )
    slack = 1e-12 * width
    value = orbit.params[parameter]
    if not clipped_low - slack <= value <= clipped_high + slack:
        raise ParameterError(
            f"the orbit is at {parameter} = {value:g}, outside of the range ({low:g}, {high:g}): "
            "start from an orbit inside"
        )
    if width > _RESOLVED * max(1.0, abs(value)):
        raise ParameterError(
            f"the orbit is at {parameter} = {value:g}, and the range ({low:g}, {high:g}) is so wide that no "
            "step along it would be short there: give the part of it that is of interest"
        )
    beside = orbit.vector.copy()  # where the parameter is another one, the period may be, too
    ends = (clipped_low - value, clipped_high - value)
    beside[model.index_of(parameter)] += _BESIDE * max(ends, key=abs)
    check_excitation(model, beside)
    return Settings(
        parameter,
        clipped_low,
        clipped_high,
        why_bottom if bottom >= low else "",
        why_top if top <= high else "",
        width,
        max_step or model.max_step or LARGEST_STEP,
        max_step is None and model.max_step is None,
        stability and not orbit.system.holds,
        max_points,
        stop_at=_stops(orbit.model, stop_at),
    )


def _stops(model: Model, stop_at: object) -> tuple[tuple[QuantityLike, float], ...]:
    """Return the quantities to stop at with their values, checked."""
    if stop_at is None:
        return ()
    given = mapping_of("stop_at", stop_at, "{'x_max': 1.4}")
    return tuple(
        (found.asked, real_number(f"stop_at['{found.name}']", value))
        for found, value in (
            (number_quantity(name, model, "stop_at"), value) for name, value in given.items()
        )
    )
