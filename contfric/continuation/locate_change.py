"""A change of sign between two points of a branch, located on the branch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contfric.base.tally import tally
from contfric.continuation.points import Point, Rows, Settings
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine


def locate_change(
    orbit: Orbit,
    before: Point,
    after: Point,
    settings: Settings,
    kind: int,
    index: int,
    target: float = 0.0,
) -> Point | None:
    """Locate one change of sign; None if no point could be solved on the way."""
    return _located(orbit, before, after, settings, kind, index, target)[0]


def locate_label(
    orbit: Orbit, before: Point, after: Point, settings: Settings, index: int
) -> list[Point]:
    """Locate a change of a label: the first one, seen from the one point, and the last one if it is another.

    Where every trial had one of the two labels the last change, seen from the other point, is the first:
    the same places are tried.
    """
    from contfric.continuation.bracket import BY_LABEL

    found = []
    for one, other in ((before, after), (after, before)):
        target = float(one.labels[index])
        point, plain = _located(orbit, one, other, settings, BY_LABEL, index, target)
        found += [] if point is None else [point]
        if found and plain:
            break
    return found


def _located(
    orbit: Orbit,
    before: Point,
    after: Point,
    settings: Settings,
    kind: int,
    index: int,
    target: float,
) -> tuple[Point | None, bool]:
    """Return the place of one change of sign, and whether a label changes at one place only."""
    from contfric.continuation.bracket import BY_TEST, locate

    rows = Rows.empty(orbit.system, 4)
    rows.put(0, before)
    rows.put(1, after)
    at, plain = locate(
        orbit.system.functions(),
        orbit.system.layout,
        orbit.vector,
        np.array([orbit.model.index_of(settings.parameter)]),
        np.array([settings.scale]),
        settings.stability,
        kind,
        index,
        target,
        bool(orbit.model.kinks),
        rows.arrays(),
        tally(),
    )
    # behind -2 Newton fails: the last good point, marked as such
    if at == -1.0 or (at < 0.0 and kind != BY_TEST):
        return None, False
    return replace(rows.point(3), lost=at < 0.0), plain


def locate_value(
    orbit: Orbit, before: Point, after: Point, settings: Settings, target: float
) -> Point:
    """Return the point at which the parameter takes a value."""
    from contfric.continuation.bracket import BY_PARAMETER

    if before.value == target:
        return before
    found = locate_change(orbit, before, after, settings, BY_PARAMETER, 0, target)
    if found is None:
        return before
    # the bracket ends within rounding of the value: solve at the value itself
    vector = orbit.vector.copy()
    vector[orbit.model.index_of(settings.parameter)] = target
    exact = refine(Orbit(orbit.system, found.joints, vector, np.inf), damped=False)
    if exact.converged and np.max(np.abs(exact.joints - found.joints)) < 1e-6:
        found.joints, found.w = exact.joints, np.array([target])
    return found
