"""Location of an event on a branch or curve, compiled: a bracket, each trial a solved point.

A trial is predicted by the cubic through both ends of the step and their tangents, and corrected
normal to the tangent between them. Places are chosen by Chandrupatla's method (Adv. Eng. Software 28
(1997) 145-149): inverse quadratic interpolation where the values are monotone enough for it, bisection
elsewhere; the bracket shrinks to the resolution of the arithmetic, or of the flow where that is integrated.
Along a branch only the value that is sought is evaluated on the way.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import types

from contfric.compiled import f8, helper, i8, indices, kernel, matrix
from contfric.compiling.references import by_reference
from contfric.continuation.geometry import (
    PointsType,
    copy_to,
    copy_vector,
    distance,
    interpolate,
    largest_state,
)
from contfric.continuation.steps import (
    AT_EVENT,
    CHI_MINUS,
    CHI_ONE,
    FOLD,
    BranchProblemType,
    along_branch,
    correct_branch,
    observe_branch,
)
from contfric.models.definition import FloatArray
from contfric.orbit.equations import close_chain
from contfric.orbit.monitor import (
    count_margins,
    crossings,
    held_margin,
    interior_margin,
    joint_margin,
    lasting_margin,
    regular_margin,
)
from contfric.orbit.newton import ALONG, CHECKS, INTEGRATED, MULTIPLIERS, SOLVES
from contfric.orbit.spectrum import multipliers
from contfric.orbit.stationary import find_behind, find_stationary
from contfric.orbit.system import IntArray

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
#: is sought is behind that.
_LOST = 1e-6
#: Share of the value at the start of a step that may be left at a place where trials fail: it is found, and
#: they fail by rounding, as they do where joints are at times of many periods.
_LEFT = 1e-9
#: Two trials that are farther apart than this many times the way between their places lie on two sheets: a
#: step is refused whose ends differ by a third of a radian in direction.
_APART = 100.0
#: Trials after which a bracket has the width of the arithmetic, whatever the function.
_MOST_TRIALS = 120


@helper
def resolution(rounding, length, size):  # type: ignore[no-untyped-def]
    """Return the share of a step of this length below which orbits of this size differ by rounding."""
    if rounding <= INTEGRATED or not length > 0.0:
        return _SHORTEST
    return max(_SHORTEST, min(_COARSEST, rounding * (1.0 + size) / length))


@helper
def next_trial(low, high, f_low, f_high, x_old, f_old, x, closest):  # type: ignore[no-untyped-def]
    """Return Chandrupatla's next abscissa: inverse quadratic where it is monotone, else the middle.

    It is not closer to either end of the bracket than ``closest``.
    """
    a, fa = x, (f_low if x == low else f_high)
    b, fb = (high, f_high) if x == low else (low, f_low)
    c, fc = x_old, f_old
    share = 0.5
    if fb != fa and fc != fb and fc != fa and b != c:
        xi = (a - b) / (c - b)
        phi = (fa - fb) / (fc - fb)
        if phi * phi < xi and (1 - phi) * (1 - phi) < 1 - xi:
            share = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (
                fc - fb
            )
    width = abs(b - a)
    least = min(0.5, closest / width if width > 0.0 else 0.5)
    share = min(1.0 - least, max(least, share))
    return a + share * (b - a)


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
            found = find_behind(functions, layout, i, c, z, p, equations, stationary)
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
    target : the label before, or the value of the parameter of a branch
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
        return nearest if code == int(sought.target) else -max(nearest, 1e-300)
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
def limited(value):  # type: ignore[no-untyped-def]
    """Return a value fit for interpolation: a margin without stationary points is infinite."""
    return -1.0 if math.isnan(value) else min(value, 1e3)


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


@helper
def copy_row(points, target, source):  # type: ignore[no-untyped-def]
    """Copy one row of points to another."""
    copy_to(points.joints[target], points.joints[source])
    copy_to(points.tangents[target], points.tangents[source])
    copy_vector(points.w[target], points.w[source])
    copy_vector(points.directions[target], points.directions[source])
    copy_vector(points.tests[target], points.tests[source])
    copy_vector(points.labels[target], points.labels[source])
    copy_vector(points.mu[target], points.mu[source])
    points.arc[target] = points.arc[source]


class Rules(NamedTuple):
    """How a bracket is narrowed down.

    Attributes
    ----------
    accuracy : of a trial
    two_sided : whether the value has the sign that it has before, or is positive there
    noise : value that is rounding
    narrowest : width of a bracket that is as narrow as can be
    given_up : width below which it is not narrowed down where trials fail, 0 where sheets are not told apart
    """

    accuracy: float
    two_sided: bool
    noise: float
    narrowest: float
    given_up: float


def bracketing(correct_at: Any, value_at: Any) -> Any:
    """Return the bracket of branches or curves, as a helper.

    Parameters
    ----------
    correct_at : that of :func:`contfric.continuation.march.marching`
    value_at : returns the value that is sought, ``(way, sought, points, row)``
    """

    @helper
    def trial(way: Any, sought: Any, points: Any, x: Any, accuracy: Any, sign: Any) -> Any:
        """Solve for the point at a share of the step, in row 2; whether it is solved, and its value."""
        interpolate(points, x)
        zs, ws, tzs, tws = points.joints, points.w, points.tangents, points.directions
        fine, _ = correct_at(way, zs[2], ws[2], tzs[2], tws[2], accuracy)
        return fine, limited(sign * value_at(way, sought, points, 2)) if fine else -1.0

    @helper
    def bracket(way, sought, points, ends, rules):  # type: ignore[no-untyped-def]
        """Find where a value changes sign between rows 0 and 1 of the points.

        Parameters
        ----------
        way, sought : what the two functions need
        points : four rows; the third one is for trials, the place is left in the fourth
        ends : (value at row 0, value at row 1)
        rules : :class:`Rules`

        Returns
        -------
        tuple
            (position in the step, value there, whether trials fail behind it or go over to another sheet,
            whether any did not).
        """
        way, points = by_reference(way), by_reference(points)
        noise, narrowest, given_up = rules.noise, rules.narrowest, rules.given_up
        zs, ws, sign = points.joints, points.w, -1.0 if rules.two_sided and ends[0] < 0.0 else 1.0
        f_low, f_high = limited(sign * ends[0]), limited(sign * ends[1])
        low, high, x, best, best_f, left = 0.0, 1.0, 0.5, 0.0, f_low, _LEFT * f_low
        x_old, f_old, lost, solved = low, f_low, False, False
        reach = _APART * distance(zs[0], ws[0], zs[1], ws[1], way.scale)
        at_end = f_low > 0.0 and f_high > 0.0
        copy_row(points, 3, 1 if at_end else 0)
        if at_end or f_low <= 0.0:
            return (1.0, f_high, lost, solved) if at_end else (best, best_f, lost, solved)
        if f_high < 0.0:
            x = min(0.99, max(0.01, f_low / (f_low - f_high)))
        for _ in range(_MOST_TRIALS):
            fine, f = trial(way, sought, points, x, rules.accuracy, sign)
            solved = solved or fine
            if fine and f >= 0.0:
                best, best_f = x, f
                copy_row(points, 3, 2)
            if f > 0.0:
                x_old, f_old = low, f_low
                low, f_low = x, f
            else:
                x_old, f_old = high, f_high
                high, f_high = x, f
                lost = not fine
                if fine and given_up > 0.0:
                    lost = distance(zs[2], ws[2], zs[3], ws[3], way.scale) > reach * (x - low)
                    if lost:
                        break
            if f == 0.0 or high - low <= narrowest or (f_low <= noise and f_high >= -noise):
                break
            if lost and high - low < given_up:
                break
            x = next_trial(low, high, f_low, f_high, x_old, f_old, x, 0.25 * narrowest)
        return best, best_f, lost and best_f > left, solved

    return bracket


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
    points : four rows: both points, one for trials, and the place with what is watched there
    counts : what is counted

    Returns
    -------
    (float, bool)
        Position in the step, from 0 to 1; -1 if no trial point could be solved; -2 minus the
        position of the last good point if it is Newton that fails behind it. And, for a label, whether
        all trials were solved and had that of one of the points: then it changes at one place only, as far
        as is seen.
    """
    zs, followed = points.joints, min(sought.number, 0)  # nothing, but no literal
    way = along_branch(problem, zs.shape[1], zs.shape[2], followed, followed, counts)
    return located(way, sought, kinked, points)
