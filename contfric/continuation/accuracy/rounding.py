"""Error bound of a located event's parameter, from the rounding errors of its equations.

The equations of the orbit and that of the event fix the joints and the parameter together. Errors in these
equations move the parameter by the last row of the inverse of their Jacobian. An error is what is left of
an equation at the located point, and the rounding of the motion there. The sum of their moduli is a bound.

* Sliding events: the margin that vanishes. T: the distance of the touch to its surface.
* SN: a location along the branch that is held, as the parameter is stationary there; and the square of what
  is left of its slope.
* BP, PD, NS: a multiplier as a function of the parameter, at a few neighbours that are solved for. A
  parabola through them has its zero there, and what they miss it by is rounding.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.attributes import altered, cached_property
from contfric.bvp.system import EventFunction, Margin
from contfric.continuation.accuracy.moved_by_errors import UNITS, fold_error, moved_by_errors
from contfric.continuation.points import Point, Settings
from contfric.events.bifurcation import ACCURACY, Bifurcation, Kind
from contfric.events.doubling_point import opening
from contfric.events.local.gradients import (
    before_reset,
    carried,
    closing,
    gradient_of,
    surface_gradient,
)
from contfric.events.local.zero_acceleration import joint_within, stationary_values
from contfric.orbit.canonical.slides import time_unit
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine

#: Least accuracy that is claimed, relative to the range: two ways to one event differ by a little more than
#: the rounding of one, and no diagram resolves it.
LEAST = 1e-11
#: Neighbours at which a multiplier is evaluated: distance in the parameter, as a share of 1 + its value and
#: of the range. Far above rounding, and multipliers are parabolas there.
_NEARBY, _BESIDE_RANGE = 1e-6, 1e-4
_NEIGHBOURS = (-2.0, -1.0, 1.0, 2.0)
#: Shares of that distance: the shorter ones where a fold or a touch of a kink lies between.
_CLOSER = (1.0, 1e-2, 1e-4)
#: Four points leave one of their errors in what a parabola misses: this many times that bounds them all.
_MISSED = 10.0
#: Kinds that a multiplier on the unit circle makes, and how far it may be from there: the root of rounding
#: times the largest multiplier (a fold is located that well along the branch), or a share of what it
#: changes by over the step, where it changes fast.
_CRITICAL = frozenset({Kind.SN, Kind.BP, Kind.PD})
_ON_CIRCLE, _OF_CHANGE = 1e-6, 1e-4
#: Rounding of the largest multiplier that hides all others: they are those of one product.
_EPS, _HIDDEN = float(np.finfo(float).eps), 0.1
#: A segment this short has no length; and how well lengths are known where several vanish together, in cube
#: roots of rounding: what such a slide ends by is of the third order in its length.
_NO_LENGTH, _LENGTHS = 1e-4, 10.0
#: How far the parameter may be from the parabola that it is along the branch to such an event.
_OFF_PARABOLA = 2.0
#: An event whose equations are singular together is located to the root of rounding at best.
_SINGULAR = 1e-6


#: What vanishes at an event: its value, and its gradient on the joints, shape (N + 1, m), and the parameter.
_Condition = tuple[float, tuple[FloatArray, float]]


@dataclass(frozen=True, eq=False)
class Estimate:
    """A bound of the error of an event's parameter, relative to the range; called for its value.

    Attributes
    ----------
    kind, here : the event, and the orbit at it
    tests : the margins that vanish; at T the segment and the observable
    sides, point : the points before and after it, and the located one
    parameter, width : what varies, and its range
    least : the value is not below this: what is known otherwise of the event
    """

    kind: Kind
    here: Orbit
    tests: tuple[EventFunction, ...]
    sides: tuple[Point, Point | None]
    point: Point
    parameter: str
    width: float
    least: float = 0.0

    def __call__(self) -> float:
        """Return the bound."""
        return self._value

    @cached_property
    def _value(self) -> float:
        """The bound, once for the copies of an event and its mirror image."""
        error, otherwise = self._error()
        if error is None or not np.isfinite(error):
            return max(self.least, otherwise)
        return max(LEAST, self.least, error / self.width)

    def _error(self) -> tuple[float | None, float]:
        """Return the error, and what is claimed where it is not known."""
        kind, here, active = self.kind, self.here, self.here.model.index_of(self.parameter)
        if self.tests:
            return self._at_most(self._of_margins(active)), _SINGULAR
        if kind is Kind.SN:
            return fold_error(here, active, self.sides, self.point), _SINGULAR
        return _multiplier_error(kind, here, active, self.width), ACCURACY

    def _at_most(self, error: float | None) -> float | None:
        """Return an error, or a smaller one that the branch tells where slides have no length any more.

        Where a load just exceeds its limit a slip lasts as the root of what it exceeds it by. So along the
        branch the parameter is a parabola, ``c d^2`` at a distance d before the event, and lengths go with d.
        What a slip ends by is of third order in its length. A point nearer than the cube root of rounding is
        rounding, and each of several slips has another length there; derivatives divide by their squares, and
        say nothing of the parameter, which is off by ``c d^2`` with the d that is not known.
        """
        rough = 2.0 * ACCURACY * self.width
        before, here = self.sides[0], self.here
        lasts = here.durations
        length, change = self.point.arc - before.arc, self.point.value - before.value
        none = int(np.sum(lasts < _NO_LENGTH * time_unit(here)))
        if error is None or error < rough or none < 2:
            return error
        unknown = _LENGTHS * float(np.cbrt(here.model.rounding))
        if length < unknown:  # the point before is no better known, or is the located one itself
            # the slope is 2 c d, and what is left is c d^2
            slope = max(abs(before.slope), abs(self.point.slope))
            size = here.model.size_of(here.model.index_of(self.parameter), self.point.value)
            own = abs(change) + unknown * min(2.0 * slope, unknown * size)
            return min(error, max(rough, own))
        if change == 0.0:
            return error
        bends = before.slope * length / (2.0 * change)
        if not 1.0 / _OFF_PARABOLA < bends < _OFF_PARABOLA:
            return error
        return min(error, max(rough, abs(change) * (unknown / length) ** 2))

    def _of_margins(self, active: int) -> float | None:
        """Return the least error that one of the margins tells, the first that is good enough.

        Of equal maxima of a load one margin vanishes all along the branch, and tells nothing.
        """
        here, best = self.here, None
        for test in self.tests:
            labels = self.kind is Kind.T and test.margin is Margin.INTERIOR  # else a joint
            condition = (_touch if labels else _margin)(here, test, active)
            error = None if condition is None else _error_of(here, active, condition)
            if error is not None and not np.isnan(error) and (best is None or error < best):
                best = error
            if best is not None and best < ACCURACY * self.width:
                break
        return best


def _margin(here: Orbit, test: EventFunction, active: int) -> _Condition | None:
    gradient = gradient_of(here.as_whole(), test, here.system.segments, active)
    value = float(here.margins[here.system.tests.index(test)])
    return None if gradient is None else (value, gradient)


def _touch(here: Orbit, test: EventFunction, active: int) -> _Condition | None:
    """Return the distance of a stationary point or a joint to the surface that it meets at a tangency."""
    gaps = _gaps(here, test)
    if not len(gaps):
        return None
    k = int(np.argmin(np.abs(gaps)))
    return float(gaps[k]), _gap_gradient(here, test, k, active)


def _gap_gradient(
    orbit: Orbit, test: EventFunction, k: int, active: int
) -> tuple[FloatArray, float]:
    """Return the gradient of one of the distances of :func:`_gaps`."""
    model, i, count = orbit.model, test.segment, orbit.system.segments
    c = model.observable_index[test.surface]
    own = [surface.name for surface in model.surfaces if surface.observable == test.surface]
    row = next(r for r in orbit.system.layout.labels if r[0] == i and r[1] == c)
    times = [time for time, _ in stationary_values(orbit, i, test.surface)]
    gradient, slope = np.zeros((count + 1, orbit.joints.shape[1])), 0.0
    whole = orbit.as_whole()
    if k < len(times) * len(own):
        touch = joint_within(whole, i, times[k // len(own)])
        there, slope = surface_gradient(whole, own[k % len(own)], touch, active)
        gradient[i], moves = carried(whole, i, touch, there, active)
        return gradient, slope + moves
    k -= len(times) * len(own)
    for at, lies_on in ((i, row[2]), (i + 1, row[3])):
        others_met = [name for name in own if model.surface_index[name] != lies_on]
        if k < len(others_met):
            joint = whole.begins[i] if at == i else whole.ends[i]
            gradient[at], slope = surface_gradient(whole, others_met[k], joint, active)
            if at == i:
                gradient[at], slope = before_reset(whole, i, gradient[at], slope, active)
            break
        k -= len(others_met)
    return gradient, slope


def _gaps(orbit: Orbit, test: EventFunction) -> FloatArray:
    """Return the distances of an observable to its surfaces, at its stationary points and both joints."""
    model, i = orbit.model, test.segment
    c = model.observable_index[test.surface]
    row = next(r for r in orbit.system.layout.labels if r[0] == i and r[1] == c)
    own = [k for k, surface in enumerate(model.surfaces) if surface.observable == test.surface]
    levels = np.array([orbit.flow.level(model.surfaces[k].name) for k in own])
    values = np.array([value for _, value in stationary_values(orbit, i, test.surface)])
    gaps = [np.subtract.outer(values, levels).ravel()]
    for joint, lies_on in ((orbit.begins[i], row[2]), (orbit.ends[i], row[3])):
        there = orbit.flow.observe(test.surface, float(joint[0]), joint[1:])
        gaps.append((there - levels)[[k != lies_on for k in own]])
    return np.asarray(np.concatenate(gaps), dtype=np.float64)


def _error_of(orbit: Orbit, active: int, condition: _Condition) -> float | None:
    """Return the error of a parameter that the orbit and a condition fix together."""
    value, (on_joints, slope) = condition
    if not np.isfinite(value):
        return None
    row = np.append(on_joints[:-1], slope + on_joints[-1] @ closing(orbit, active))
    row[: len(on_joints[-1])] += on_joints[-1] @ orbit.system.closing
    left = abs(value) + orbit.model.rounding * (1.0 + float(np.abs(orbit.joints).max()))
    return moved_by_errors(orbit, active, row, left)


def _multiplier_error(kind: Kind, here: Orbit, active: int, width: float) -> float | None:
    """Return the error of the parameter at which a multiplier is on the unit circle."""
    value = float(here.vector[active])
    size = here.model.size_of(active, value)
    distance = min(_NEARBY * size, _BESIDE_RANGE * width)
    own = UNITS * float(np.finfo(float).eps) * size
    least: float | None = None
    for share in _CLOSER:
        clear = 1.0 if share == 1.0 else _MISSED
        error = _miss(kind, here, active, share * distance, clear)
        if error is not None and (least is None or error < least):
            least = error
        if least is not None and least < ACCURACY * width:
            break
    return None if least is None else least + own


def _miss(kind: Kind, here: Orbit, active: int, distance: float, clear: float) -> float | None:
    """Return by how much a multiplier misses the unit circle, as a distance in the parameter.

    None if it does not change by more than ``clear`` times what a parabola through its neighbours misses.
    """
    shifts, found = [], []
    for k in _NEIGHBOURS:
        vector = here.vector.copy()
        vector[active] += k * distance
        orbit = refine(altered(here, vector=vector), damped=False)
        if not orbit.converged:
            return None
        shifts.append(float(vector[active] - here.vector[active]))
        # where -1 is what it is, the pencil says it without multipliers, and on a bridge too
        minus = kind is not Kind.NS and critical(kind, orbit) < 0.0
        found.append(opening(orbit) if minus else off_circle(kind, orbit))
    if not np.isfinite(found).all():
        return None
    x = np.array(shifts) / distance
    fit = np.polynomial.polynomial.polyfit(x, found, 2)
    missed = float(np.abs(np.polynomial.polynomial.polyval(x, fit) - found).max())
    if abs(fit[1]) <= clear * missed:
        return None
    return float(distance * (abs(fit[0]) + _MISSED * missed) / abs(fit[1]))


def not_critical(bifurcation: Bifurcation, before: Point, after: Point, settings: Settings) -> str:
    """Return what a change of sign is if no multiplier is on the unit circle there; empty for an event.

    The multiplier is that of the orbit's own joints. It may miss the circle by rounding, or by a small share
    of what it changes by over the step. Next to a graze one multiplier is so large that its rounding is as
    large as all others.
    """
    kind, orbit = bifurcation.kind, bifurcation.orbit
    if not settings.stability or kind not in _CRITICAL or not bifurcation.located:
        return ""
    off = abs(off_circle(kind, orbit))
    largest = float(np.abs(orbit.turn_multipliers).max(initial=0.0))
    if kind is not Kind.SN and _EPS * largest > _HIDDEN:  # a fold is seen by its parameter
        return f"{_none_of(bifurcation)} next to multipliers of {largest:.2g} rounding decides its test"
    changes = 0.0
    if before.mu.size and np.isfinite([before.mu, after.mu]).all():
        s = critical(kind, orbit)
        changes = min(float(np.abs(point.mu - s).min()) for point in (before, after))
    if off <= max(_ON_CIRCLE * (1.0 + largest), _OF_CHANGE * changes):
        return ""
    return (
        f"{_none_of(bifurcation)} its test changes sign, the multiplier is {off:.2g} off the circle"
    )


def _none_of(bifurcation: Bifurcation) -> str:
    where = ", ".join(f"{k} = {v:.10g}" for k, v in bifurcation.params.items())
    return f"no {bifurcation.kind.value} at {where}:"


def critical(kind: Kind, orbit: Orbit) -> float:
    """Return the multiplier of a turn that a smooth event has: of the half map -1 stands for both."""
    minus = kind is Kind.PD or (kind is Kind.BP and orbit.system.half)
    return -1.0 if minus else 1.0


def off_circle(kind: Kind, orbit: Orbit) -> float:
    """Return how far a multiplier of a turn is from where an event has it; at NS the pair from the circle."""
    mu = orbit.turn_multipliers
    if kind is Kind.NS:
        return float(abs(mu[0]) ** 2 - 1.0)
    apart = mu - critical(kind, orbit)
    return float(apart[int(np.argmin(np.abs(apart)))].real)
