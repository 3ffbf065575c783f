"""A located event as a result."""

from __future__ import annotations

from contfric.bvp.system import EventFunction
from contfric.continuation.accuracy.rounding import Estimate
from contfric.continuation.points import Point, Settings
from contfric.continuation.step import Step
from contfric.events.bifurcation import Bifurcation, Kind
from contfric.events.sliding_kinds import load_stands_still
from contfric.events.split_touch import splits
from contfric.orbit.orbit import Orbit

#: Accuracy of an event (relative to the range) where CS and AS, or the two ends of a slide, coincide: the
#: root of rounding.
ROUGH = 1e-6


def bifurcation_at(
    kind: Kind,
    here: Orbit,
    before: Point,
    after: Point | None,
    point: Point,
    settings: Settings,
    tests: tuple[EventFunction, ...] = (),
) -> Bifurcation:
    """Return the event at a point, with the stability of the points before and after it."""
    sides, least = (before, after), ROUGH if _is_rough(kind, here, tests) else 0.0
    bound: Estimate | float = ROUGH
    if kind is not Kind.AS or not splits(here):
        bound = Estimate(kind, here, tests, sides, point, settings.parameter, settings.width, least)
    return Bifurcation(
        kind,
        here.params,
        here,
        tests,
        point.arc,
        *_stability(kind, here, before, after, point, settings),
        bound=bound,
        parameter=settings.parameter,
    )


def event_in(step: Step, kind: Kind, here: Orbit, point: Point) -> Bifurcation:
    """Return the event at a point of a step."""
    return bifurcation_at(kind, here, step.before, step.beyond, point, step.settings)


def _stability(
    kind: Kind, here: Orbit, before: Point, after: Point | None, point: Point, settings: Settings
) -> tuple[bool | None, bool | None]:
    """Return the stability below and above an event; at a fold, before and after it on the branch."""
    first = _stable(before, here, settings)
    second = None if after is None else _stable(after, here, settings)
    ahead = point.value if after is None else after.value
    return (second, first) if kind is not Kind.SN and ahead < before.value else (first, second)


def _is_rough(kind: Kind, here: Orbit, tests: tuple[EventFunction, ...]) -> bool:
    """Tell whether an event is located to the root of rounding only: where the load stands still."""
    return kind in (Kind.CS, Kind.SS) and any(load_stands_still(here, test) for test in tests)


def _stable(point: Point, here: Orbit, settings: Settings) -> bool | None:
    if here.system.holds:
        return False
    return all(abs(mu) < 1.0 for mu in point.mu.tolist()) if settings.stability else None
