"""How near to a sliding event the signs of slopes and multipliers are reliable.

At a sliding event at which a segment comes in, two curves cross. A segment that leaves a surface and comes
back to it (a contact that is touched, a slide that grazes rest) may have no length: its equation is
``tau g(tau, z) = 0``, and ``tau = 0`` solves it all along a curve of its own. At a distance d before the
crossing the smallest singular value of the equations is ``c d``. A point solved to the rounding e is off by
``e / (c d)``, and its tangent, with it its slope and its multipliers, by ``e / (c d)^2``: rounding as a
whole from the root of e on. There signs say nothing, nor does Newton's method stay on one curve.

And where the depth of the touch, which is of order ``tau^2``, is what the parameter drives, so is the
parameter's distance to the event: its slope vanishes at the event with d itself, and has either sign in
what is rounding.

What is so near to a sliding event that the parameter does not tell it from that belongs to it
(:func:`contfric.continuation.events_of_step.belongs_to`). So nothing is lost if signs are taken where that
begins: there d is the root of a part in 1e9 of the range, and ``e / (c d)^2`` is below 1e-6 for c of order 1.
"""

from __future__ import annotations

import numpy as np

from contfric.base.arrays import FloatArray, with_entries
from contfric.base.attributes import altered
from contfric.continuation.half_branch import first_point, point_before
from contfric.continuation.points import EXTRA, Point
from contfric.continuation.step import Step

#: Arclength within which a smooth event belongs to a sliding event: where a stop becomes tangential
#: the branch folds and its multipliers are infinite, and where it meets a surface labels change.
SAME_LOCATION = 1e-7
#: The same for a location known by its parameter (relative to the range), which is stationary at a fold.
SAME_VALUE, SAME_FOLD = 1e-9, 1e-4
#: A segment this short has no length: an event at which it comes in is located to the root of rounding.
NO_LENGTH = 1e-6
#: A multiplier this large is that of an exit without a rate.
_INFINITE = 1e8
#: An event is located to this share of :data:`SAME_LOCATION`: a multiplier that falls as c over the distance
#: is larger than its inverse there if it passes -1, at the distance c, farther than that.
_LOCATED = 1e-4
#: Share of the widest distance that is taken: a parabola predicts the parameter there.
_WITHIN = 0.9
#: Most that a point may be off its prediction, in distances to the event: beyond that it may lie on the other
#: curve (as for a step of the march).
_MISS = 0.3


def last_reliable(step: Step) -> Point | None:
    """Return the last point of a step at which the signs of slopes and multipliers are told, or None.

    Where an exit becomes tangential a multiplier grows like the inverse of its rate: at the located event it
    is infinite, or its sign is that of a rate that is rounding.
    """
    beyond = step.beyond
    here = step.orbit_at(beyond)
    if beyond is not step.after and bool(here.durations.min() < NO_LENGTH):
        told = _reliable_before(step)
        if told is not None:
            return told
    if not np.isfinite(beyond.tests[-EXTRA:]).all():
        return None
    if not np.abs(beyond.mu).max(initial=0.0) > _INFINITE:
        return beyond
    return _if_finite(point_before(here, beyond, SAME_LOCATION, step.settings))


def first_reliable(step: Step) -> Point:
    """Return the first point of a step at which the signs of multipliers are told.

    At a sliding event from which a side starts a multiplier may be infinite, and its sign that of rounding.
    """
    before = step.before
    pole = at_event(before) and np.abs(before.mu).max(initial=0.0) > 1.0 / _LOCATED
    if not pole or step.length <= 2.0 * SAME_LOCATION:
        return before
    return _if_finite(point_before(step.orbit, before, -SAME_LOCATION, step.settings)) or before


def at_event(point: Point) -> bool:
    """Tell whether a point is a located sliding event."""
    return bool(point.tests[:-EXTRA].min(initial=np.inf) < _LOCATED * SAME_LOCATION)


def _if_finite(point: Point | None) -> Point | None:
    return point if point is not None and np.isfinite(point.tests[-EXTRA:]).all() else None


def _reliable_before(step: Step) -> Point | None:
    """Return the point before a sliding event from which on all belongs to it; None where that is not told.

    So it is where the parameter goes on through the event, as it does where no two curves cross.
    """
    before, event = step.before, step.beyond
    least, length = SAME_VALUE * step.settings.width, event.arc - before.arc
    if abs(event.value - before.value) <= least and length <= SAME_FOLD:
        return before
    # where two curves cross the parameter leaves the event with the square of the distance
    bend = abs(event.value - before.value - before.slope * length) / length**2
    back = min(SAME_FOLD, 0.5 * length, float(np.sqrt(least / bend)) if bend > 0.0 else np.inf)
    while back > SAME_LOCATION:
        point = point_at(step, _WITHIN * back)
        left = np.inf if point is None else abs(event.value - point.value)
        if left <= least:
            return point
        back *= 0.5 if point is None else min(0.5, least / left)
    return None


def point_at(step: Step, back: float) -> Point | None:
    """Solve for the point at a distance before the sliding event of a step; None if Newton goes astray.

    It is predicted by the parabola through both locations with the tangent at the first one: that at the
    event is rounding, or that of another curve.
    """
    before, event = step.before, step.beyond
    length = event.arc - before.arc
    s = length - back

    def along(
        first: FloatArray, last: FloatArray, rate: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        bend = (last - first - length * rate) / length**2
        return first + s * (rate + s * bend), rate + 2.0 * s * bend

    joints, tangent = along(before.joints, event.joints, before.tangent)
    w, direction = along(before.w, event.w, before.direction)
    vector = with_entries(step.orbit.vector, step.active, w[0])
    predicted = altered(step.orbit, joints=joints, vector=vector)
    point = _if_finite(first_point(predicted, step.settings, tangent, float(direction[0])))
    if point is None:
        return None
    square = float(np.sum((point.joints - joints) ** 2)) / len(joints)
    miss = np.sqrt(square + float((point.w - w) @ (point.w - w)) * step.settings.scale)
    return altered(point, arc=event.arc - back) if miss < _MISS * back else None
