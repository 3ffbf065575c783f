"""A change of sign between two points of a branch, located on the branch."""

from __future__ import annotations

import numpy as np

from contfric.continuation.points import Point, Settings
from contfric.orbit.counts import TALLY
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import polish


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
    from contfric.continuation.bracket import BY_TEST, locate

    system = orbit.system
    active = orbit.model.index_of(settings.parameter)
    vector = orbit.vector.copy()
    joints, tangent = before.joints.copy(), before.tangent.copy()
    tests, labels, mu = before.tests.copy(), before.labels.copy(), before.mu.copy()
    slope = np.empty(1)
    length = after.arc - before.arc
    kinked = float(bool(orbit.model.kinks))
    ends = np.array([before.value, before.slope, after.value, after.slope, length, kinked])
    if kind == BY_TEST:
        values = np.array([before.tests[index], after.tests[index]])
    else:
        values = np.array([before.value - target, after.value - target])
    at = locate(
        system.functions(),
        system.layout,
        vector,
        active,
        settings.scale,
        settings.stability,
        kind,
        index,
        target,
        ends,
        values,
        joints,
        after.joints,
        tangent,
        after.tangent,
        tests,
        slope,
        labels,
        mu,
        TALLY,
    )
    if at < 0.0:
        if at == -1.0 or kind != BY_TEST:
            return None
        # Newton fails behind this point: the last good one, marked as such
        arc = before.arc - (at + 2.0) * (after.arc - before.arc)
        return Point(
            joints,
            float(vector[active]),
            tangent,
            float(slope[0]),
            tests,
            labels,
            mu,
            arc,
            lost=True,
        )
    arc = before.arc + at * (after.arc - before.arc)
    return Point(joints, float(vector[active]), tangent, float(slope[0]), tests, labels, mu, arc)


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
    exact = polish(Orbit(orbit.system, found.joints, vector, np.inf), damped=False)
    if exact.converged and np.max(np.abs(exact.joints - found.joints)) < 1e-6:
        found.joints, found.value = exact.joints, target
    return found
