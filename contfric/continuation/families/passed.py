"""Families of orbits at one value of the parameter that a symmetric branch passes.

Where a symmetric branch passes a family (:mod:`contfric.continuation.families.vertical`) a multiplier of its
half touches -1, with the square of the distance: no test changes its sign there. It is looked for where a
multiplier comes near -1 and leaves again, and may touch it: its distance from -1 is convex on either side of
a touch, so that the line through two points on one side is at zero before the touch is.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.bvp.system import Margin
from contfric.continuation.accuracy.moved_by_errors import UNITS
from contfric.continuation.accuracy.rounding import LEAST
from contfric.continuation.branch import Branch
from contfric.continuation.families.vertical import family_near
from contfric.continuation.points import Settings
from contfric.continuation.singular_points.openings import in_order
from contfric.events.bifurcation import Bifurcation, Kind
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine

#: A multiplier of a symmetric branch that comes this near to -1 and leaves again is asked for a family.
_TOUCHES = 1e-2
#: Reserve of the line through two points, by which it may miss the touch: far off the distance is not convex.
_RESERVE = 2.0


def with_families(branch: Branch, settings: Settings) -> Branch:
    """Return a symmetric branch with the branch points at which it passes families of asymmetric orbits."""
    mu = branch.turn_multipliers
    if mu is None or not mu.size or not branch.system.half or branch.bridge or len(branch) < 3:
        return branch
    away = np.abs(mu + 1.0).min(axis=1)
    near = (away[1:-1] < _TOUCHES) & (away[1:-1] <= away[:-2]) & (away[1:-1] < away[2:])
    events = [_passed(branch, mu, *three) for three in _told_around(branch, away, near)]
    found = [b for b in events if b is not None and not _is_listed(branch, b, settings)]
    return replace(branch, bifurcations=in_order(branch, found)) if found else branch


def _told_around(
    branch: Branch, away: FloatArray, near: NDArray[np.bool_]
) -> Iterator[tuple[int, int, int]]:
    """Yield the nearest points around each least distance from -1 where it is told, and the least between.

    Steps crowd where a multiplier touches -1, and next to the touch its distance from -1 is rounding: neither
    its sign nor which point is nearest can be told there. Nothing where an end of the branch is as near.
    """
    high = 0
    for k in (1 + np.flatnonzero(near)).tolist():
        if k < high:  # among the points between the last two
            continue
        low, high = k - 1, k + 1
        while low >= 0 and _is_rounding(branch[low], away[low]):
            low -= 1
        while high < len(away) and _is_rounding(branch[high], away[high]):
            high += 1
        if low >= 0 and high < len(away):
            yield low, low + 1 + int(np.argmin(away[low + 1 : high])), high


def _may_touch(away: FloatArray, arc: FloatArray) -> bool:
    """Tell from three points of a branch whether a multiplier may be at -1 between the outer ones.

    Examples
    --------
    >>> import numpy as np
    >>> s = np.array([-1.0, 0.2, 1.0])
    >>> _may_touch(s**2, s), _may_touch(4.0 + s**2, s)
    (True, False)
    """
    before, here, after = away
    behind, ahead = np.diff(arc)
    from_left = here * behind <= _RESERVE * (before - here) * ahead
    from_right = here * ahead <= _RESERVE * (after - here) * behind
    return bool(from_left or from_right)


def _is_rounding(orbit: Orbit, away: float) -> bool:
    """Tell whether the distance of a multiplier from -1 is rounding, which a tangential exit magnifies.

    Multipliers have the rates at which segments end as divisors, and these rates are margins.
    """
    exits = [test.margin is Margin.EXIT for test in orbit.system.tests]
    slowest = float(orbit.margins[exits].min(initial=1.0))
    return bool(away * slowest <= UNITS * np.finfo(float).eps)


def _is_listed(branch: Branch, event: Bifurcation, settings: Settings) -> bool:
    value = event.params[branch.parameter]
    return any(
        b.kind is event.kind
        and abs(b.params[branch.parameter] - value) <= max(LEAST, b.accuracy) * settings.width
        for b in branch.bifurcations
    )


def _passed(
    branch: Branch, mu: NDArray[np.complex128], low: int, k: int, high: int
) -> Bifurcation | None:
    """Return the branch point between two points of a symmetric branch, if it passes a family there.

    ``k`` is the one between them at which a multiplier is nearest to -1.
    """
    three = [low, k, high]
    sides = np.min((mu[three] + 1.0).real, axis=1)
    away = np.abs(mu[three] + 1.0).min(axis=1)
    if not (sides[0] * sides[2] > 0.0 and _may_touch(away, branch.arc[three])):
        return None
    active = branch.model.index_of(branch.parameter)
    before, after = branch.values[low], branch.values[high]
    family = family_near(branch[k], active, abs(float(after - before)))
    if family is None:
        return None
    value = float(family.orbit.vector[active])
    if not min(before, after) <= value <= max(before, after):
        return None
    part = branch.values[low : high + 1] - value
    j = low + int(np.flatnonzero(part[:-1] * part[1:] <= 0.0)[0])
    share = (value - branch.values[j]) / (branch.values[j + 1] - branch.values[j])
    position = float(branch.arc[j] + share * (branch.arc[j + 1] - branch.arc[j]))
    there = refine(replace(branch.between(position), vector=family.orbit.vector), damped=False)
    if not there.converged:
        return None
    ordered = (low, high) if before < after else (high, low)
    below, above = (bool(np.all(np.abs(mu[i]) < 1.0)) for i in ordered)
    return Bifurcation(Kind.BP, there.params, there, (), position, below, above, bound=LEAST)
