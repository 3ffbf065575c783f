"""Ends of a branch at the range: at a physical limit of the parameter, or where the user's range ends."""

from __future__ import annotations

from contfric.continuation.locating.change_of_sign import locate_value
from contfric.continuation.points import Point, Settings
from contfric.events.bifurcation import Bifurcation, End, EndReason, Kind
from contfric.orbit.orbit import Orbit

#: Share of the range within which an event cannot be told from a physical limit, where conditions
#: degenerate together (with S0 = S a release has no acceleration): the root of rounding.
_NEAR_LIMIT = 1e-6


def limit_end(value: float, settings: Settings) -> End:
    """Return the end at the limit next to a value: of the model, or of the range that was asked for."""
    upper = value > 0.5 * (settings.low + settings.high)
    reason = settings.high_reason if upper else settings.low_reason
    kind = EndReason.LIMIT if reason else EndReason.RANGE
    return End(kind, f"{kind.value}: {reason}" if reason else "")


def is_at_limit(value: float, settings: Settings) -> bool:
    """Tell whether an event is at a physical limit: what is located there is the limit itself."""
    near = _NEAR_LIMIT * settings.width
    return bool(
        (settings.low_reason and value - settings.low < near)
        or (settings.high_reason and settings.high - value < near)
    )


def ends_at_limit(
    located: list[tuple[Bifurcation, Point]], before: Point, after: Point, settings: Settings
) -> bool | None:
    """Tell whether a branch that cannot go on ends at a physical limit; None if a shorter step is to tell.

    At a limit the equations may be singular (without friction and damping orbits of a resonant period are a
    continuum), and a branch that turns just there comes back along a parabola, on which its conditions fail.
    An event may be located there, outside by rounding, or not at all. The slope is linear over a short step:
    the value at its zero is so told from either point, and has to be at the limit from both. A vertex that
    is no nearer to the limit than the points are is another one.
    """
    step, (a, b) = after.arc - before.arc, (before.slope, after.slope)
    upper = a > 0.0
    event = located[0] if located else None
    if not (settings.high_reason if upper else settings.low_reason):
        return False
    if event is not None and event[0].located:
        met = event[1].value
        if settings.low <= met <= settings.high or not is_at_limit(met, settings):
            return False
        return is_at_limit(before.value, settings) or None
    if not a * b < 0.0 or (event is not None and event[0].kind is not Kind.SN):
        return False
    limit = settings.high if upper else settings.low
    share = a / (a - b)
    near = abs(before.value + 0.5 * a * share * step - limit)
    far = abs(after.value - 0.5 * b * (1.0 - share) * step - limit)
    if max(near, far) < _NEAR_LIMIT * settings.width and is_at_limit(before.value, settings):
        return True
    apart = min(abs(before.value - limit), abs(after.value - limit))
    return None if min(near, far) < apart else False


def limit_crossed(
    orbit: Orbit, before: Point, after: Point, settings: Settings
) -> tuple[Point, str] | None:
    """Return the point at which a step leaves the range, and the reason of that limit; else None."""
    if settings.low <= after.value <= settings.high:
        return None
    upper = after.value > settings.high
    target = settings.high if upper else settings.low
    point = locate_value(orbit, before, after, settings, target)
    return point, settings.high_reason if upper else settings.low_reason
