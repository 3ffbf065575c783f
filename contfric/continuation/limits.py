"""Where a branch leaves the range: at a physical limit of the parameter, or where the user wants no more."""

from __future__ import annotations

from contfric.continuation.events import End, EndReason
from contfric.continuation.locate_change import locate_value
from contfric.continuation.points import Point, Settings
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
