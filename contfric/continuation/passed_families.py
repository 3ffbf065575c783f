"""Families of orbits at one value of the parameter that a symmetric branch passes.

Where a symmetric branch passes a family (:mod:`contfric.continuation.vertical`) a multiplier of its half
touches -1, with the square of the distance: no test changes its sign there. It is looked for where a
multiplier comes near -1 and leaves again, and may touch it: its distance from -1 is convex on either side of
a touch, so that the line through two points on one side is at zero before the touch is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from contfric.continuation.accuracy import LEAST
from contfric.continuation.branch import Branch
from contfric.continuation.events import Bifurcation, Kind
from contfric.continuation.moved_by_errors import UNITS
from contfric.continuation.openings import in_order
from contfric.continuation.points import Settings
from contfric.continuation.vertical import family_near
from contfric.models.definition import FloatArray
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine
from contfric.orbit.system import Margin

#: A multiplier of a symmetric branch that comes this near to -1 and leaves again is asked for a family.
_TOUCHES = 1e-2
#: Reserve of the line through two points, by which it may miss the touch: far off the distance is not convex.
_RESERVE = 2.0


def with_families(branch: Branch, settings: Settings) -> Branch:
    """Return a symmetric branch with the branch points at which it passes families of asymmetric orbits."""
    mu = branch.turn_multipliers
    if mu is None or not branch.system.half or branch.bridge or len(branch) < 3:
        return branch
    away = np.min(np.abs(mu + 1.0), axis=1)
    near = (away[1:-1] < _TOUCHES) & (away[1:-1] <= away[:-2]) & (away[1:-1] < away[2:])
    sides = np.min((mu + 1.0).real, axis=1)
    touches = near & (sides[:-2] * sides[2:] > 0.0) & _may_touch(away, branch.arc)
    events = [_passed(branch, mu, int(k)) for k in 1 + np.flatnonzero(touches)]
    found = [b for b in events if b is not None and not _is_listed(branch, b, settings)]
    return replace(branch, bifurcations=in_order(branch, found)) if found else branch


def _may_touch(away: FloatArray, arc: FloatArray) -> NDArray[np.bool_]:
    """Tell for each inner point of a branch whether a multiplier may be at -1 between its neighbours.

    Examples
    --------
    >>> import numpy as np
    >>> s = np.array([-1.0, 0.2, 1.0])
    >>> _may_touch(s**2, s).tolist(), _may_touch(4.0 + s**2, s).tolist()
    ([True], [False])
    """
    before, here, after = away[:-2], away[1:-1], away[2:]
    behind, ahead = np.diff(arc)[:-1], np.diff(arc)[1:]
    from_left = here * behind <= _RESERVE * (before - here) * ahead
    from_right = here * ahead <= _RESERVE * (after - here) * behind
    return from_left | from_right


def _is_rounding(orbit: Orbit, away: FloatArray) -> bool:
    """Tell whether distances of a multiplier from -1 are rounding, which a tangential exit magnifies.

    Multipliers have the rates at which segments end as divisors, and these rates are margins.
    """
    exits = [test.margin is Margin.EXIT for test in orbit.system.tests]
    slowest = float(orbit.margins[exits].min(initial=1.0))
    return bool(np.min(away) * slowest <= UNITS * np.finfo(float).eps)


def _is_listed(branch: Branch, event: Bifurcation, settings: Settings) -> bool:
    value = event.params[branch.parameter]
    return any(
        b.kind is event.kind
        and abs(b.params[branch.parameter] - value) <= max(LEAST, b.accuracy) * settings.width
        for b in branch.bifurcations
    )


def _passed(branch: Branch, mu: NDArray[np.complex128], k: int) -> Bifurcation | None:
    """Return the branch point next to a point of a symmetric branch, if it passes a family there."""
    active = branch.model.index_of(branch.parameter)
    before, after = branch.values[k - 1], branch.values[k + 1]
    if _is_rounding(branch[k], np.min(np.abs(mu[[k - 1, k + 1]] + 1.0), axis=1)):
        return None
    family = family_near(branch[k], active, abs(float(after - before)))
    if family is None:
        return None
    value = float(family.orbit.vector[active])
    if not min(before, after) <= value <= max(before, after):
        return None
    j = k if (branch.values[k] - value) * (after - value) <= 0.0 else k - 1
    share = (value - branch.values[j]) / (branch.values[j + 1] - branch.values[j])
    position = float(branch.arc[j] + share * (branch.arc[j + 1] - branch.arc[j]))
    there = refine(replace(branch.between(position), vector=family.orbit.vector), damped=False)
    if not there.converged:
        return None
    low, high = (k - 1, k + 1) if before < after else (k + 1, k - 1)
    below, above = (bool(np.all(np.abs(mu[i]) < 1.0)) for i in (low, high))
    return Bifurcation(Kind.BP, there.params, there, (), position, below, above, bound=LEAST)
