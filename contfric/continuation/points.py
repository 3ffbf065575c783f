"""Points of a branch while it is being traced, and the settings of the trace."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contfric.errors import ParameterError
from contfric.models.definition import FloatArray
from contfric.orbit.counts import TALLY
from contfric.orbit.orbit import Orbit
from contfric.orbit.system import IntArray, System

#: Largest step by default, where the range of the parameter counts 1 (and grows with the size of the
#: state): about 100 points over the range.
LARGEST_STEP = 0.01
#: First step, in largest steps: the curvature is not known yet.
FIRST_STEP = 0.1
#: Smallest step: at the resolution of a branch in double precision, far below any feature of one.
SMALLEST_STEP = 1e-10
#: Most points of one side of a branch by default.
MOST_POINTS = 20_000
#: Extra columns of the tests behind the margins; the first is the slope of the parameter. (Repeated
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
    stability : whether multipliers are evaluated (and BP and PD detected)
    most_points : most points of one side
    """

    parameter: str
    low: float
    high: float
    low_reason: str
    high_reason: str
    width: float
    largest: float = LARGEST_STEP
    stability: bool = True
    most_points: int = MOST_POINTS

    @property
    def scale(self) -> float:
        """Weight of the parameter in the scaled product."""
        return 1.0 / self.width**2


@dataclass(eq=False)
class Point:
    """One solved point with its unit tangent and everything that is watched."""

    joints: FloatArray
    value: float
    tangent: FloatArray
    slope: float
    tests: FloatArray
    labels: IntArray
    mu: NDArray[np.complex128]
    arc: float = 0.0
    lost: bool = False

    def orbit(self, system: System, vector: FloatArray, active: int) -> Orbit:
        """Return the point as an orbit."""
        full = vector.copy()
        full[active] = self.value
        return Orbit(system, self.joints.copy(), full, 0.0)

    def reversed(self) -> Point:
        """Return the same point with the opposite tangent."""
        tests = self.tests.copy()
        tests[-EXTRA] *= -1.0
        return Point(
            self.joints,
            self.value,
            -self.tangent,
            -self.slope,
            tests,
            self.labels,
            self.mu,
            self.arc,
        )


def settings_of(
    orbit: Orbit,
    parameter: str,
    bounds: tuple[float, float],
    max_step: float | None,
    stability: bool,
    max_points: int,
) -> Settings:
    """Check what the user asked for and clip the range to the model's limits.

    Raises
    ------
    ParameterError
        For an unknown parameter, an empty, reversed or not finite range, or one without the orbit.
    """
    model = orbit.model
    model.index_of(parameter)
    low, high = float(bounds[0]), float(bounds[1])
    if not (math.isfinite(low) and math.isfinite(high)) or not low < high:
        raise ParameterError(
            f"the range of '{parameter}' must be two finite numbers, lower first, got ({low}, {high})"
        )
    if max_step is not None and not 0.0 < max_step <= 1.0:
        raise ParameterError(f"max_step is a share of the range, in (0, 1], got {max_step!r}")
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
    return Settings(
        parameter,
        clipped_low,
        clipped_high,
        why_bottom if bottom >= low else "",
        why_top if top <= high else "",
        width,
        max_step or LARGEST_STEP,
        stability,
        max_points,
    )


def first_point(
    orbit: Orbit,
    settings: Settings,
    tangent: FloatArray | None = None,
    slope: float = 1.0,
) -> Point | None:
    """Solve for the first point of a branch; None if it has no unique tangent there.

    Parameters
    ----------
    tangent, slope : direction to solve normal to; by default along the parameter
    """
    from contfric.continuation.march import begin

    system = orbit.system
    layout = system.layout
    active = orbit.model.index_of(settings.parameter)
    joints, vector = orbit.joints.copy(), orbit.vector.copy()
    direction = np.zeros_like(joints) if tangent is None else tangent.copy()
    tests = np.zeros(len(system.tests) + EXTRA)
    labels = np.zeros(len(layout.labels), dtype=np.int64)
    mu = np.zeros(len(system.model.states), dtype=np.complex128)
    solved, new_slope = begin(
        system.functions(),
        layout,
        joints,
        vector,
        active,
        direction,
        slope,
        settings.scale,
        settings.stability,
        tests,
        labels,
        mu,
        TALLY,
    )
    if not solved:
        return None
    return Point(joints, float(vector[active]), direction, float(new_slope), tests, labels, mu)
