"""Branch points and period doublings of bridges.

An orbit with holds has no multipliers. But its equations can be singular for a disturbance that changes
sign after a turn as those of any orbit, and a branch leaves there: of a symmetric orbit the asymmetric
ones, of others those of twice the period. The sign of the determinant tells (:mod:`contfric.orbit.index`),
and the place is located as at the vertex of a pitchfork.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from contfric.continuation.branch import Branch
from contfric.continuation.events import Bifurcation, Kind
from contfric.continuation.vertices import refined_opening
from contfric.orbit.index import opening_sign
from contfric.orbit.orbit import Orbit

#: Share of the range within which an opening that is located must lie beside the step that it was seen in.
_NEAR = 1e-3


def with_openings(branch: Branch, width: float) -> Branch:
    """Return a bridge with its branch points and period doublings; other branches as they are.

    Parameters
    ----------
    width : width of the range of the parameter
    """
    if not branch.bridge or branch.model.autonomous or len(branch) < 2:
        return branch
    signs = [opening_sign(orbit) for orbit in branch]
    found = []
    for k, (a, b) in enumerate(pairwise(signs)):
        if a is not None and b is not None and a * b < 0:
            event = _located(branch, k, width)
            if event is not None and not _is_at_fold(branch, event, width):
                found.append(event)
    if not found:
        return branch
    return replace(branch, bifurcations=_in_order(branch, found))


def _located(branch: Branch, k: int, width: float) -> Bifurcation | None:
    """Return the event in the step behind a point; None if it cannot be located."""
    active = branch.model.index_of(branch.parameter)
    values = branch.values[[k, k + 1]]
    for orbit in (branch[k], branch[k + 1]):
        there = refined_opening(orbit, active)
        if there is None:
            continue
        value = float(there.vector[active])
        if values.min() - _NEAR * width <= value <= values.max() + _NEAR * width:
            kind = Kind.BP if branch.system.half else Kind.PD
            share = float(np.clip(_share(branch, k, there), 0.0, 1.0))
            position = float(branch.arc[k] + share * (branch.arc[k + 1] - branch.arc[k]))
            return Bifurcation(kind, there.params, there, (), position, False, False)
    return None


def _is_at_fold(branch: Branch, event: Bifurcation, width: float) -> bool:
    """Tell whether the branch turns there: what opens at a fold belongs to it."""
    return any(
        b.kind is Kind.SN
        and abs(b.params[branch.parameter] - event.params[branch.parameter]) < b.accuracy * width
        for b in branch.bifurcations
    )


def _share(branch: Branch, k: int, orbit: Orbit) -> float:
    """Return where between two points an orbit is, by its joints."""
    step = branch.joints[k + 1] - branch.joints[k]
    return float(np.sum(step * (orbit.joints - branch.joints[k])) / np.sum(step * step))


def _in_order(branch: Branch, found: list[Bifurcation]) -> tuple[Bifurcation, ...]:
    """Return the bifurcations of a branch with others, in order; those at its ends stay there."""
    first, last = (end.bifurcation for end in branch.ends)
    inner = [b for b in branch.bifurcations if b is not first and b is not last]
    inner = sorted([*inner, *found], key=lambda b: b.position)
    ends = ([first] if first is not None else []), ([last] if last is not None else [])
    return (*ends[0], *inner, *ends[1])
