"""Curves of Neimark-Sacker points (NS): a complex pair of multipliers stays on the unit circle.

The condition is that the logarithm of the product of the pair vanishes, ``log(mu_1 mu_2) = 0``. The
product is a smooth function of the orbit also where the pair meets on the real axis, at 1 (R1) or at -1
(R2): there the curve of NS ends, and what goes on is a neutral saddle, no bifurcation. With the angle
theta of the pair, the points theta = 2 pi / 3 and pi / 2 are the strong resonances 1:3 and 1:4. As
everywhere on curves, multipliers are those of a turn: of the half map, for a symmetric orbit.

The orbits and the march are those of a quantity that is held (:mod:`contfric.curves.of_quantities.step`).
The value is computed from the multipliers to rounding; its slopes, in the tangent plane of the orbits,
are central differences: a point is as accurate as its multipliers, and only the speed of
convergence depends on the slopes.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.continuation.points import MOST_POINTS, Point
from contfric.curves.codimension_two.locating import CurveStep
from contfric.curves.curve import Curve, CurvePart
from contfric.curves.of_quantities.step import Defects, Held
from contfric.curves.of_quantities.trace import trace_both
from contfric.curves.ranges import PlaneRanges
from contfric.curves.special import CodimTwo, CurveEnd, CurveEndReason, SpecialPoint
from contfric.curves.trace import Progress
from contfric.errors import ConvergenceError, ParameterError
from contfric.events.bifurcation import Bifurcation, Kind
from contfric.orbit.orbit import Orbit

#: A multiplier this far from the unit circle does not belong to a located NS.
_MULTIPLIER = 1e-6
#: Angles of the strong resonances that a curve passes.
_RESONANCES = {CodimTwo.R3: 2.0 * math.pi / 3.0, CodimTwo.R4: math.pi / 2.0}


def critical_pair(orbit: Orbit) -> tuple[complex, complex]:
    """Return the two multipliers of a turn whose product is a real number nearest to 1.

    Two conjugate ones, or two real ones of the same sign.
    """

    def distance(pair: tuple[complex, complex]) -> float:
        product = pair[0] * pair[1]
        if abs(product.imag) > 1e-9 * abs(product) or product.real <= 0.0:
            return math.inf  # of two pairs, or of a real one and one of a pair: not conjugate
        return abs(math.log(product.real))

    return min(itertools.combinations(orbit.turn_multipliers.tolist(), 2), key=distance)


@dataclass(frozen=True, eq=False)
class OnCircle(Held):
    """The condition of a curve of NS, in place of a quantity that is held."""

    box: PlaneRanges

    @property
    def title(self) -> str:
        """What the orbits of the curve have in common."""
        return Kind.NS.value

    def defects(self, orbit: Orbit) -> Defects:
        """Return log(mu_1 mu_2) and its row."""
        value = np.array([self.defect(orbit)])
        return Defects(value, self.differences(orbit, self.defect))

    def defect(self, orbit: Orbit) -> float:
        """Return log(mu_1 mu_2) of the critical pair."""
        one, other = critical_pair(orbit)
        return math.log(abs(one * other))

    def bound(self, point: Point) -> float:
        """Return the discriminant of the pair, 1 - (trace / 2)^2 / determinant: positive if complex."""
        one, other = critical_pair(self.orbit_of(point))
        return 1.0 - ((one + other) ** 2 / (4.0 * one * other)).real

    def end_at_bound(self, point: Point) -> CurveEnd:
        """Return the end where the pair is real."""
        orbit = self.orbit_of(point)
        kind = CodimTwo.R1 if critical_pair(orbit)[0].real > 0.0 else CodimTwo.R2
        special = SpecialPoint(kind, kind.name, orbit.params, orbit)
        return CurveEnd(CurveEndReason.MEETS, f"{kind.value}: a neutral saddle follows", special)


def angle_of(orbit: Orbit) -> float:
    """Return the angle of the critical pair, in [0, pi]."""
    return abs(float(np.angle(critical_pair(orbit)[0])))


def continue_torus(
    bifurcation: Bifurcation,
    box: PlaneRanges,
    largest: float,
    max_points: int = MOST_POINTS,
    progress: Progress | None = None,
) -> Curve:
    """Continue an NS in two parameters, both ways.

    Raises
    ------
    ParameterError
        If no complex pair lies on the unit circle.
    ConvergenceError
        If the curve has no unique direction at the start.
    """
    orbit = bifurcation.orbit
    mu = orbit.turn_multipliers
    if not np.any((np.abs(np.abs(mu) - 1.0) < _MULTIPLIER) & (np.abs(mu.imag) > 0.0)):
        raise ParameterError(
            f"{bifurcation!r} is no NS: the multipliers of a turn are "
            f"{', '.join(f'{m:.6g}' for m in mu)}, and no complex pair is on the unit circle"
        )
    held = OnCircle(orbit, None, 0.0, box)
    first = held.first()
    if first is None:
        raise ConvergenceError(f"{bifurcation!r} has no curve with a unique direction", orbit)
    return _joined(held, *trace_both(held, first, largest, max_points, progress))


def _joined(
    held: OnCircle, points: list[Point], arc: FloatArray, both: tuple[CurveEnd, CurveEnd]
) -> Curve:
    orbits = [held.orbit_of(point) for point in points]
    part = CurvePart(
        Kind.NS,
        None,
        held.orbit.system,
        None,
        np.array([orbit.vector[held.which] for orbit in orbits]),
        np.array([orbit.joints for orbit in orbits]),
        arc,
        np.array([orbit.labels for orbit in orbits], dtype=np.int64).reshape(len(orbits), -1),
        np.array([orbit.turn_multipliers for orbit in orbits]),
    )
    special = _resonances(held, points)
    ends = []
    for end, position in zip(both, (0.0, float(arc[-1])), strict=True):
        if end.special is not None:
            kind = end.special.kind
            location = _special(kind, end.special.orbit, position)
            special.append(location)
            ends.append(CurveEnd(end.reason, end.message, location))
        else:
            ends.append(end)
    special.sort(key=lambda s: s.position)
    return Curve(held.box.names, held.orbit.vector, (part,), tuple(special), (ends[0], ends[1]))


def _special(kind: CodimTwo, orbit: Orbit, position: float) -> SpecialPoint:
    return SpecialPoint(kind, kind.name, orbit.params, orbit, position=position)


def _resonances(held: OnCircle, points: list[Point]) -> list[SpecialPoint]:
    """Return the strong resonances 1:3 and 1:4 between the points, located."""
    found = []
    angles = [_angle_at(held, point) for point in points]
    for k, (a, b) in enumerate(itertools.pairwise(points)):
        for kind, angle in _RESONANCES.items():
            if not (angles[k] - angle) * (angles[k + 1] - angle) < 0.0:
                continue

            def beyond(point: Point, angle: float = angle) -> float:
                return _angle_at(held, point) - angle

            point, fine = CurveStep(held, a, b, held.border).zero_of(beyond)
            if fine and point is not a and min(held.inside(point)) >= 0.0:
                found.append(_special(kind, held.orbit_of(point), point.arc - points[0].arc))
    return found


def _angle_at(held: OnCircle, point: Point) -> float:
    return angle_of(held.orbit_of(point))
