r"""Extrema of a quantity along a branch: where its derivative by arclength is zero, located.

With the unit tangent (z', p') of the branch, dQ/ds = Q_z z' + Q_p p' is exact, and finite at folds too.
Between two points at which it has different signs its zero is found by Brent's method, each trial a
solved orbit. Where both slopes have one sign a pair of extrema may lie between. So it does if the values
do not follow the slopes: the step is halved. Else a parabola through the slopes of three points says
where they come nearest to zero, and the orbit there is asked.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.linear import tangent_of
from contfric.continuation.hermite import along, point_between, zero_between
from contfric.continuation.points import EXTRA, Point, Settings
from contfric.orbit.orbit import Orbit
from contfric.quantities.measure import NumberWithGradient, differentiated
from contfric.quantities.registry import Quantity, QuantityLike, number_quantity

if TYPE_CHECKING:
    from contfric.continuation.branch import Branch

#: Halvings of a step with a pair of extrema: a sixteenth of a step resolves what a branch of it can do.
_HALVINGS = 4
#: A slope at an extremum above this share of those at the ends of the step: a kink, at which it jumps.
_KINK = 1e-4
#: A slope at an end of the branch below this share of that at the other end of its step is zero, and has no
#: sign: where an orbit leaves an event like a square root, every slope by arclength starts with 0.
_ZERO = 1e-9
#: How near to zero a parabola has to come, as a share of the smaller slope at the ends, to be looked at.
_NEAR = 0.5
#: Values that differ by less than this, relative to 1 + their size, say nothing about slopes; and slopes
#: below it, by widths of the branch, have no sign: psi of a symmetric orbit is zero to rounding all along.
_ROUNDING = 1e-11


@dataclass(frozen=True, eq=False)
class Extremum:
    """A local extremum of a quantity along a branch.

    Attributes
    ----------
    quantity : str
        What is extreme.
    largest : bool
        Whether it is a maximum.
    value : float
    params : dict
        Parameters at which it lies.
    orbit : Orbit
        The orbit there.
    position : float
        Arclength on the branch.
    kink : bool
        Whether the slope jumps there, as that of a maximum over the orbit does where another one takes over.
    """

    quantity: str
    largest: bool
    value: float
    params: dict[str, float]
    orbit: Orbit = field(repr=False)
    position: float
    kink: bool = False


@dataclass(frozen=True, eq=False)
class _MeasuredStep:
    """A step of a branch with the quantity and its slope at both ends."""

    before: Point
    after: Point
    first: NumberWithGradient
    last: NumberWithGradient


@dataclass(frozen=True, eq=False)
class _ExtremumSearch:
    """The search along one branch; arclength is measured anew, in widths of the branch."""

    branch: Branch
    quantity: Quantity
    settings: Settings

    def measured(self, point: Point) -> NumberWithGradient:
        """Return the quantity with its slope along the branch."""
        orbit = self.orbit(point)
        return differentiated(self.quantity, orbit, along(point, orbit, self.branch.parameter))

    def slope(self, point: Point) -> float:
        """Return the slope of the quantity along the branch."""
        return float(self.measured(point).ahead[0])

    def orbit(self, point: Point) -> Orbit:
        """Return a point as an orbit."""
        branch = self.branch
        return point.orbit(branch, branch.model.index_of(branch.parameter))

    def step(self, before: Point, after: Point) -> _MeasuredStep:
        """Return a step with what is measured at its ends."""
        return _MeasuredStep(before, after, self.measured(before), self.measured(after))

    def dipping(self, step: _MeasuredStep, slopes: FloatArray) -> list[_MeasuredStep]:
        """Return a step as two, cut where its slope has the other sign than at both ends; else as it is.

        Parameters
        ----------
        slopes : of the point before the step, both ends, and the point after it; nan without one
        """
        for share in _nearest(slopes):
            middle = point_between(self.branch[0], step.before, step.after, self.settings, share)
            if middle is None:
                continue
            measured = self.measured(middle)
            if float(measured.ahead[0]) * slopes[1] < 0.0:
                return [
                    _MeasuredStep(step.before, middle, step.first, measured),
                    _MeasuredStep(middle, step.after, measured, step.last),
                ]
        return [step]

    def extrema(self, step: _MeasuredStep, halvings: int) -> Iterator[tuple[Point, bool, float]]:
        """Yield (point, whether it is a maximum, slope left) of the extrema inside of a step."""
        p, q = float(step.first.ahead[0]), float(step.last.ahead[0])
        if p * q < 0.0:
            ends = step.before, step.after
            point = zero_between(self.branch[0], *ends, self.settings, self.slope)
            if point is not None:
                yield point, p > 0.0, abs(self.slope(point))
            return
        rise = step.last.value - step.first.value
        if halvings == 0 or p * rise >= 0.0 or abs(rise) < _ROUNDING * (1.0 + abs(step.last.value)):
            return
        middle = point_between(self.branch[0], step.before, step.after, self.settings, 0.5)
        if middle is None:
            return
        measured = self.measured(middle)
        yield from self.extrema(
            _MeasuredStep(step.before, middle, step.first, measured), halvings - 1
        )
        yield from self.extrema(
            _MeasuredStep(middle, step.after, measured, step.last), halvings - 1
        )


def _nearest(slopes: FloatArray) -> Iterator[float]:
    """Yield the shares of a step at which parabolas through three slopes come near to zero inside of it."""
    before, p, q, following = (float(slope) for slope in slopes)
    if p * q <= 0.0:
        return
    # in p + b x + c x^2 over the step: through the point at -1, or through that at 2
    for c in (0.5 * (before - 2.0 * p + q), 0.5 * (p - 2.0 * q + following)):
        b = q - p - c
        x = -0.5 * b / c if c != 0.0 and np.isfinite(c) else np.nan
        if 0.0 < x < 1.0 and (p + 0.5 * b * x) * np.sign(p) < _NEAR * min(abs(p), abs(q)):
            yield x


def extrema_of(branch: Branch, name: QuantityLike) -> tuple[Extremum, ...]:
    """Return the extrema of a quantity along a branch; see :meth:`contfric.Branch.extrema`."""
    quantity = number_quantity(name, branch.model, "extrema")
    search = _ExtremumSearch(branch, quantity, settings_of(branch))
    found: list[Extremum] = []
    points = list(points_of(branch, search.settings))
    measured = [search.measured(point) for _, point in points]
    slopes = np.array([np.nan, *(float(m.ahead[0]) for m in measured), np.nan])
    for k in range(len(points) - 1):
        (i, before), (j, after) = points[k], points[k + 1]
        if j != i + 1:
            continue  # no tangent at the point between them: an event
        step = _MeasuredStep(before, after, measured[k], measured[k + 1])
        if not np.isfinite([step.first.value, step.last.value]).all():
            continue  # it is not defined all along
        if _flat_end(slopes[k : k + 4]):
            continue
        steep = max(abs(float(m.ahead[0])) for m in (step.first, step.last))
        if steep < _ROUNDING * (1.0 + abs(step.last.value)):
            continue
        parts = search.dipping(step, slopes[k : k + 4])
        inside = (e for part in parts for e in search.extrema(part, _HALVINGS))
        for point, largest, slope in inside:
            share = (point.arc - before.arc) / (after.arc - before.arc)
            orbit = search.orbit(point)
            value = differentiated(quantity, orbit, None).value
            position = float(branch.arc[i] + share * (branch.arc[j] - branch.arc[i]))
            kink = slope > _KINK * steep
            found.append(
                Extremum(quantity.name, largest, value, orbit.params, orbit, position, kink)
            )
    return tuple(found)


def _flat_end(slopes: FloatArray) -> bool:
    """Tell whether a step has an end of the branch at which the slope is zero; slopes as for ``dipping``."""
    before, p, q, following = np.abs(slopes)
    return bool((np.isnan(before) and p < _ZERO * q) or (np.isnan(following) and q < _ZERO * p))


def settings_of(branch: Branch) -> Settings:
    """Return settings with which points between those of a branch are solved."""
    low, high = float(branch.values.min()), float(branch.values.max())
    width = max(high - low, 1e-6 * (1.0 + abs(low)))
    return Settings(branch.parameter, low, high, "", "", width, stability=False)


def points_of(branch: Branch, settings: Settings) -> Iterator[tuple[int, Point]]:
    """Yield the points of a branch with their unit tangents, those that have one, and their indices."""
    scale, count = settings.scale, branch.joints.shape[1]
    active = branch.model.index_of(branch.parameter)
    arc, last = 0.0, None
    for k in range(len(branch)):
        orbit = branch[k]
        try:
            tangent, slope = tangent_of(branch.system, orbit.joints, orbit.vector, active)
        except np.linalg.LinAlgError:
            continue
        size = np.sqrt(np.sum(tangent**2) / count + scale * slope**2)
        other = min(k + 1, len(branch) - 1)
        ahead = branch.joints[other] - branch.joints[other - 1]
        climb = branch.values[other] - branch.values[other - 1]
        sign = np.sign(np.sum(tangent * ahead) / count + scale * slope * climb) or 1.0
        if last is not None:
            step, rise = orbit.joints - last[0], branch.values[k] - last[1]
            arc += float(np.sqrt(np.sum(step**2) / count + scale * rise**2))
        last = orbit.joints, branch.values[k]
        yield (
            k,
            Point(
                orbit.joints,
                np.array([branch.values[k]]),
                sign * tangent / size,
                np.array([sign * slope / size]),
                np.zeros(EXTRA),
                branch.labels[k],
                np.zeros(0, dtype=np.complex128),
                arc,
            ),
        )
