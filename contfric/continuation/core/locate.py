"""Location of an event on a branch, compiled: only the value that is sought is evaluated on the way."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import types

from contfric.base.arrays import FloatArray, IntArray
from contfric.bvp.convergence import ALONG, INTEGRATED
from contfric.bvp.equations import close_chain
from contfric.bvp.monitor import (
    count_margins,
    crossings,
    held_margin,
    interior_margin,
    joint_margin,
    lasting_margin,
    regular_margin,
)
from contfric.bvp.newton import CHECKS, MULTIPLIERS, SOLVES
from contfric.bvp.spectrum import multipliers
from contfric.bvp.stationary_points import find_after_reset, find_stationary
from contfric.compiled import f8, helper, i8, indices, kernel, matrix
from contfric.compiling.references import by_reference
from contfric.continuation.core.bracket import Rules, bracketing, copy_row
from contfric.continuation.core.geometry import PointsType, largest_state
from contfric.continuation.core.steps import (
    AT_EVENT,
    CHI_MINUS,
    CHI_ONE,
    FOLD,
    BranchProblemType,
    along_branch,
    correct_branch,
    observe_branch,
)

#: What locate() follows: a column of the tests, a label, or the parameter itself.
BY_TEST, BY_LABEL, BY_PARAMETER = range(3)

#: A value of order 1 that is this small is rounding (ten units in the last place, of an orbit of several
#: segments): a narrower bracket would follow noise.
_NOISE = 2e-15
#: Shortest bracket (share of a step): the resolution of the arithmetic.
_SHORTEST = 4e-16
#: Widest share of a step that the rounding of an integrated flow may be (in steps that are hardly longer).
_COARSEST = 0.01
#: Share of a step below which it is not narrowed down any further where Newton is lost: the multiplier that
#: is sought is after that.
_LOST = 1e-6


@helper
def resolution(rounding, length, size):  # type: ignore[no-untyped-def]
    """Return the share of a step of this length below which orbits of this size differ by rounding."""
    if rounding <= INTEGRATED or not length > 0.0:
        return _SHORTEST
    return max(_SHORTEST, min(_COARSEST, rounding * (1.0 + size) / length))


@helper
def margin_value(functions, layout, index, z, p, workspace):  # type: ignore[no-untyped-def]
    """Return one margin of a corrected point."""
    value = plain_margin(functions, layout, index, z, p, workspace)
    for k in range(layout.doubles.shape[0]):
        if layout.doubles[k, 0] == index:
            return regular_margin(layout, k, z, workspace.equations, value)
    return value


@helper
def plain_margin(functions, layout, index, z, p, workspace):  # type: ignore[no-untyped-def]
    """Return one margin as it is, with its double zero if it has one."""
    first, count = layout.interior.shape[0], z.shape[0]
    if index < first:
        i, c = layout.interior[index, 0], layout.observables[layout.interior[index, 1]]
        equations, stationary = workspace.equations, workspace.stationary
        if layout.resets[i] >= 0:
            found = find_after_reset(functions, layout, i, c, z, p, equations, stationary)
        else:
            found = find_stationary(functions, layout, i, c, z, p, equations.last, stationary)
        return interior_margin(functions, layout, index, found, z, p, equations, stationary)
    if index < first + count:
        sign = layout.exit_signs[index - first]
        return sign * workspace.equations.rates[index - first] if sign != 0.0 else np.inf
    index -= first + count
    if index < layout.joint.shape[0]:
        return joint_margin(functions, layout, index, z, p, workspace.equations)
    index -= layout.joint.shape[0]
    if index < layout.lasting.shape[0]:
        return lasting_margin(layout, index, z, workspace.equations)
    index -= layout.lasting.shape[0]
    return held_margin(functions, layout, index, z, p, workspace.equations, workspace.stationary)


class Sought(NamedTuple):
    """The value whose change of sign is sought along a branch or curve.

    Attributes
    ----------
    kind : BY_TEST, BY_LABEL or BY_PARAMETER
    number : column of the tests, or row of the labels
    target : the value of the parameter of a branch
    planes : of a curve by parameters: rows (a, b, c), of which the least of ``a p + b q + c`` vanishes
    plain : counts the values for which a label was that of one of the two points, shape (1,)
    """

    kind: int
    number: int
    target: float
    planes: FloatArray
    plain: IntArray


SoughtType = types.NamedTuple([i8, i8, f8, matrix, indices], Sought)


@helper
def watched_value(way, sought, points, row):  # type: ignore[no-untyped-def]
    """Return the value that is sought, at a corrected point."""
    layout, workspace, functions, p = way.layout, way.workspace, way.functions, way.p
    z, w, mu = points.joints[row], points.w[row, 0], points.mu[row]
    margins, index = count_margins(layout), sought.number
    if sought.kind == BY_PARAMETER:
        return w - sought.target
    if sought.kind == BY_LABEL:
        code, nearest, _, _ = crossings(
            functions, layout, index, z, p, workspace.equations, workspace.stationary
        )
        labels = points.labels
        if code == labels[0, index] or code == labels[1, index]:
            sought.plain[0] += 1
        # the distance of the nearest stationary point to a surface vanishes where the label changes;
        # elsewhere a joint may lie on a surface
        return nearest if code == labels[0, index] else -max(nearest, 1e-300)
    if index < margins:
        way.counts[CHECKS] += 1
        return margin_value(functions, layout, index, z, p, workspace)
    column = index - margins - layout.labels.shape[0]
    if column == FOLD:
        return points.directions[row, 0]
    way.counts[MULTIPLIERS] += 1
    one, minus = multipliers(
        layout, workspace.pencil, workspace.equations.close, mu, workspace.spectral
    )
    if column == CHI_ONE:
        return one
    return minus if column == CHI_MINUS else 1.0 - abs(mu[0]) * abs(mu[1])


@helper
def values_at_ends(way, sought, points):  # type: ignore[no-untyped-def]
    """Return the value that is sought at rows 0 and 1."""
    ws, tests = points.w, points.tests
    if sought.kind == BY_TEST:
        return tests[0, sought.number], tests[1, sought.number]
    if sought.kind == BY_PARAMETER:
        return ws[0, 0] - sought.target, ws[1, 0] - sought.target
    equations = way.workspace.equations
    way.p[way.which[0]] = ws[0, 0]
    close_chain(way.functions, way.layout, points.joints[0], way.p, equations.none, equations)
    first = watched_value(way, sought, points, 0)
    way.p[way.which[0]] = ws[1, 0]
    close_chain(way.functions, way.layout, points.joints[1], way.p, equations.none, equations)
    return first, watched_value(way, sought, points, 1)


_bracket = bracketing(correct_branch, watched_value)


@helper
def rules_of(way, sought, kinked, points):  # type: ignore[no-untyped-def]
    """Return how the bracket of a value along a branch is narrowed down."""
    layout, kind = way.layout, sought.kind
    of_branch = kind == BY_TEST and sought.number >= count_margins(layout)
    # margins and distances are positive before the event, the others have the sign that they have
    two_sided = kind == BY_PARAMETER or of_branch
    noise = 0.1 * _NOISE if two_sided else _NOISE  # slopes and products of multipliers have less
    # slopes and multipliers are those of the last Jacobian. Near a touch of a kink it changes with the root
    # of a distance: it must be that of the orbit, not one from which Newton is known to end there
    accuracy = ALONG if kinked and of_branch else AT_EVENT
    length, size = abs(points.arc[1] - points.arc[0]), largest_state(points.joints[0])
    given_up = _LOST if two_sided and layout.rounding > INTEGRATED else 0.0
    return Rules(accuracy, two_sided, noise, resolution(layout.rounding, length, size), given_up)


@helper
def located(way, sought, kinked, points):  # type: ignore[no-untyped-def]
    """Find where the value that is sought changes sign; what :func:`locate` returns."""
    way, points = by_reference(way), by_reference(points)
    zs, ws, tzs, tws = points.joints, points.w, points.tangents, points.directions
    ends = values_at_ends(way, sought, points)
    before, sought.plain[0] = way.counts[SOLVES], 0
    best, _, lost, _ = _bracket(way, sought, points, ends, rules_of(way, sought, kinked, points))
    plain = sought.plain[0] == way.counts[SOLVES] - before
    # the last Jacobian at the located point, for its rates and multipliers; the point itself stays
    copy_row(points, 2, 3)
    fine, _ = correct_branch(way, zs[2], ws[2], tzs[2], tws[2], AT_EVENT)
    if not fine:
        return -1.0, False
    way.p[way.which[0]] = ws[3, 0]
    workspace = way.workspace
    close_chain(
        way.functions, way.layout, zs[3], way.p, workspace.equations.none, workspace.equations
    )
    observe_branch(way, zs[3], ws[3], tws[3], points.tests[3], points.labels[3], points.mu[3])
    return -2.0 - best if lost else best, plain


@kernel(
    types.Tuple((f8, types.boolean))(
        BranchProblemType, SoughtType, types.boolean, PointsType, indices
    )
)
def locate(problem, sought, kinked, points, counts):  # type: ignore[no-untyped-def]
    """Find where a watched value changes sign between two points of a branch.

    Parameters
    ----------
    problem, sought : the branch, and the value
    kinked : whether the fields have kinks
    points : four rows: both points, one for trials, and the location with what is watched there
    counts : what is counted

    Returns
    -------
    (float, bool)
        Position in the step, from 0 to 1; -1 if no trial point could be solved; -2 minus the
        position of the last good point if it is Newton that fails after it. And, for a label, whether
        all trials were solved and had that of one of the points: then it changes at one location only, as far
        as is seen.
    """
    zs, followed = points.joints, min(sought.number, 0)  # nothing, but no literal
    way = along_branch(problem, zs.shape[1], zs.shape[2], followed, followed, counts)
    return located(way, sought, kinked, points)
