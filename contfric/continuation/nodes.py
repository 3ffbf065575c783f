"""Points of a branch with the folds and branch points between them, and what is interpolated there."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray, IntArray
from contfric.events.bifurcation import Kind
from contfric.orbit.orbit import Orbit, Status

if TYPE_CHECKING:
    from contfric.continuation.branch import Branch

#: A branch point is well inside of a step if its distances from the two ends differ by less than this: a
#: parabola through points that are nearer to each other has a slope of rounding.
_INSIDE = 1e-3


class Nodes(NamedTuple):
    """Nodes of a branch, in order.

    Attributes
    ----------
    arc, values : arclength and parameter
    events : which event of the branch a node is, -1 for a point
    crosses : whether it is a branch point well inside of a step
    """

    arc: FloatArray
    values: FloatArray
    events: IntArray
    crosses: NDArray[np.bool_]


def nodes_of(branch: Branch) -> Nodes:
    """Return the points of a branch, and the folds and branch points between them."""
    found = [
        (b.position, b.params[branch.parameter], k)
        for k, b in enumerate(branch.bifurcations)
        if b.kind in (Kind.SN, Kind.BP) and b.located and b.orbit.system is branch.system
        if 0.0 < b.position < branch.arc[-1]
    ]
    arc = np.concatenate([branch.arc, [e[0] for e in found]])
    order = np.argsort(arc, kind="stable")
    values = np.concatenate([branch.values, [e[1] for e in found]])
    points = np.full(len(branch), -1)
    events = np.concatenate([points, np.array([e[2] for e in found], dtype=int)])[order]
    steps = np.diff(arc[order], prepend=np.inf, append=np.inf)
    inside = _INSIDE * np.maximum(steps[:-1], steps[1:]) < np.minimum(steps[:-1], steps[1:])
    crossings = [k >= 0 and branch.bifurcations[k].kind is Kind.BP for k in events]
    return Nodes(arc[order], values[order], events, inside & np.array(crossings))


def between(branch: Branch, arc: float) -> Orbit:
    """Return what lies at an arclength of a branch by interpolation: an orbit that is not solved.

    Next to a branch point it is on the parabola through the point and its neighbours: another branch is near,
    at a distance like the arclength, and what is on the chord of the step is as near to that one.
    """
    arcs, values, events, crosses = branch.nodes
    k = int(np.clip(np.searchsorted(arcs, arc), 1, len(arcs) - 1))
    used = [k - 1, k]
    for node in [j for j in used if crosses[j]]:
        used = [node - 1, node, node + 1]
    joints, vector, value = np.zeros_like(branch.joints[0]), branch.vector.copy(), 0.0
    for j in used:  # Lagrange's polynomial
        others = arcs[[i for i in used if i != j]]
        gaps = arcs[j] - others
        weight = float(np.prod((arc - others) / gaps)) if gaps.all() else float(j == used[0])
        point = branch.joints[j - np.count_nonzero(events[:j] >= 0)]
        there = point if events[j] < 0 else branch.bifurcations[events[j]].orbit.joints
        value, joints = value + weight * values[j], joints + weight * there
    vector[branch.model.index_of(branch.parameter)] = value
    return Orbit(branch.system, joints, vector, np.inf, Status.NOT_CONVERGED)
