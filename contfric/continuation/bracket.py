"""Location of an event on a branch, compiled: a bracket, each trial a solved point of the branch.

A trial is predicted by the cubic through both ends of the step and their tangents, and corrected
normal to the tangent between them. Places are chosen by Chandrupatla's method (Adv. Eng. Software 28
(1997) 145-149): inverse quadratic interpolation where the values are monotone enough for it, bisection
elsewhere; the bracket shrinks to the resolution of the arithmetic, or of the flow where that is integrated.
Only the value that is sought is evaluated on the way.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from contfric.compiled import f8, helper, i8, indices, kernel, matrix, vector
from contfric.continuation.steps import (
    AT_EVENT,
    CHI_MINUS,
    CHI_ONE,
    FOLD,
    copy_to,
    largest_state,
    observe_point,
    settle,
    step_room,
)
from contfric.flow.layouts import FlowType
from contfric.orbit.equations import LayoutType, close_chain
from contfric.orbit.monitor import (
    count_margins,
    crossings,
    find_behind,
    find_turnings,
    held_margin,
    interior_margin,
    joint_margin,
    lasting_margin,
    regular_margin,
)
from contfric.orbit.newton import ALONG, CHECKS, INTEGRATED, MULTIPLIERS
from contfric.orbit.spectrum import multipliers
from contfric.orbit.system import RETURNS

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
def margin_value(functions, layout, index, z, p, room):  # type: ignore[no-untyped-def]
    """Return one margin of a settled point."""
    value = plain_margin(functions, layout, index, z, p, room)
    for k in range(layout.doubles.shape[0]):
        if layout.doubles[k, 0] == index:
            return regular_margin(layout, k, z, room.equations, value)
    return value


@helper
def plain_margin(functions, layout, index, z, p, room):  # type: ignore[no-untyped-def]
    """Return one margin as it is, with its double zero if it has one."""
    first, count = layout.interior.shape[0], z.shape[0]
    if index < first:
        i, c = layout.interior[index, 0], layout.observables[layout.interior[index, 1]]
        equations, turnings = room.equations, room.turnings
        if layout.departs[i] < RETURNS:
            found = find_behind(functions, layout, i, c, z, p, equations, turnings)
        else:
            found = find_turnings(functions, layout, i, c, z, p, equations.last, turnings)
        return interior_margin(functions, layout, index, found, z, p, equations, turnings)
    if index < first + count:
        sign = layout.exit_signs[index - first]
        return sign * room.equations.rates[index - first] if sign != 0.0 else np.inf
    index -= first + count
    if index < layout.joint.shape[0]:
        return joint_margin(functions, layout, index, z, p, room.equations)
    index -= layout.joint.shape[0]
    if index < layout.lasting.shape[0]:
        return lasting_margin(layout, index, z, room.equations)
    index -= layout.lasting.shape[0]
    return held_margin(functions, layout, index, z, p, room.equations, room.turnings)


@helper
def watched_value(functions, layout, kind, index, target, z, p, w, slope, mu, counts, room):  # type: ignore[no-untyped-def]
    """Return the function whose change of sign is sought, at a settled point."""
    margins = count_margins(layout)
    if kind == BY_PARAMETER:
        return w - target
    if kind == BY_LABEL:
        code, nearest = crossings(functions, layout, index, z, p, room.equations, room.turnings)
        # the distance of the nearest stationary point to a surface vanishes where the label changes;
        # elsewhere a joint may lie on a surface
        return nearest if code == int(target) else -max(nearest, 1e-300)
    if index < margins:
        counts[CHECKS] += 1
        return margin_value(functions, layout, index, z, p, room)
    column = index - margins - layout.labels.shape[0]
    if column == FOLD:
        return slope
    counts[MULTIPLIERS] += 1
    one, minus = multipliers(layout.rank, room.pencil, room.equations.close, mu, room.spectral)
    if column == CHI_ONE:
        return one
    return minus if column == CHI_MINUS else 1.0 - abs(mu[0]) * abs(mu[1])


@helper
def limited(value):  # type: ignore[no-untyped-def]
    """Return a value fit for interpolation: a margin without stationary points is infinite."""
    return -1.0 if math.isnan(value) else min(value, 1e3)


@helper
def between(za, zb, ta, tb, wa, wb, sa, sb, length, x, z, t):  # type: ignore[no-untyped-def]
    """Write the predicted point and tangent at a share x of a step; return parameter and slope."""
    y = 1.0 - x
    ha, hb = y * y * (1.0 + 2.0 * x), x * x * (3.0 - 2.0 * x)
    ga, gb = x * y * y * length, -x * x * y * length
    for i in range(za.shape[0]):
        for j in range(za.shape[1]):
            z[i, j] = ha * za[i, j] + hb * zb[i, j] + ga * ta[i, j] + gb * tb[i, j]
            t[i, j] = y * ta[i, j] + x * tb[i, j]
    return ha * wa + hb * wb + ga * sa + gb * sb, y * sa + x * sb


@kernel(
    f8(
        FlowType,
        LayoutType,
        vector,
        i8,
        f8,
        types.boolean,
        i8,
        i8,
        f8,
        vector,
        vector,
        matrix,
        matrix,
        matrix,
        matrix,
        vector,
        vector,
        indices,
        types.complex128[::1],
        indices,
    )
)
def locate(  # type: ignore[no-untyped-def]
    functions,
    layout,
    p,
    active,
    scale,
    stability,
    kind,
    index,
    target,
    ends,
    values,
    za,
    zb,
    ta,
    tb,
    tests,
    slope_out,
    labels,
    mu,
    counts,
):
    """Find where a watched value changes sign between two points of a branch.

    Parameters
    ----------
    ends : (parameter, slope, parameter, slope, arclength between) of the first and the second point, and
        whether the fields have kinks
    values : the watched value at both
    za, zb, ta, tb : joints and tangents of both, shape (N, m)

    On return ``za``, ``p``, ``ta`` hold the located point with its tangent (``slope_out[0]`` its
    p'), and ``tests``, ``labels``, ``mu`` what is watched there.

    Returns
    -------
    float
        Position in the step, from 0 to 1; -1 if no trial point could be solved; -2 minus the
        position of the last good point if it is Newton that fails behind it.
    """
    which = np.empty(1, dtype=np.int64)
    which[0] = active
    count, m = za.shape
    wa, sa, wb, sb, length, kinked = ends
    room = step_room(count, m, p.shape[0])
    z, t = np.empty((count, m)), np.empty((count, m))
    best_z, best_t = np.empty((count, m)), np.empty((count, m))
    copy_to(best_z, za)
    copy_to(best_t, ta)
    best_x, best_w, best_slope = 0.0, wa, sa
    f_low, f_high = values[0], values[1]
    if kind == BY_LABEL:
        for side in range(2):
            here = za if side == 0 else zb
            p[active] = wa if side == 0 else wb
            close_chain(functions, layout, here, p, room.equations.none, room.equations)
            f = watched_value(
                functions, layout, kind, index, target, here, p, 0.0, 0.0, mu, counts, room
            )
            if side == 0:
                f_low = f
            else:
                f_high = f
    margins = count_margins(layout)
    # margins and distances are positive before the event, the others have the sign that they have
    two_sided = kind == BY_PARAMETER or (kind == BY_TEST and index >= margins)
    noise = 0.1 * _NOISE if two_sided else _NOISE  # slopes and products of multipliers have less
    accuracy = AT_EVENT
    if kinked > 0.0 and kind == BY_TEST and index >= margins:
        # slopes and multipliers are those of the last Jacobian. Beside a touch of a kink it changes with the
        # root of a distance: it must be that of the orbit, not one from which Newton is known to end there
        accuracy = ALONG
    sign = -1.0 if two_sided and f_low < 0.0 else 1.0
    f_low, f_high = limited(sign * f_low), limited(sign * f_high)
    low, high, x = 0.0, 1.0, 0.5
    x_old, f_old = low, f_low
    lost, narrowest = False, resolution(layout.rounding, abs(length), largest_state(za))
    if f_low > 0.0 and f_high < 0.0:
        x = min(0.99, max(0.01, f_low / (f_low - f_high)))
    for _ in range(120):
        if f_low <= 0.0 or f_high > 0.0:
            best_x = 0.0 if f_low <= 0.0 else 1.0
            break
        p[active], slope = between(za, zb, ta, tb, wa, wb, sa, sb, length, x, z, t)
        fine, slope, _ = settle(
            functions, layout, z, p, which, t, slope, scale, accuracy, counts, room
        )
        f = -1.0
        if fine:
            w = p[active]
            f = limited(
                sign
                * watched_value(
                    functions, layout, kind, index, target, z, p, w, slope, mu, counts, room
                )
            )
            if f >= 0.0:
                best_x, best_w, best_slope = x, w, slope
                copy_to(best_z, z)
                copy_to(best_t, t)
        if f > 0.0:
            x_old, f_old = low, f_low
            low, f_low = x, f
        else:
            x_old, f_old = high, f_high
            high, f_high = x, f
            lost = not fine
        if f == 0.0 or high - low <= narrowest or (f_low <= noise and f_high >= -noise):
            break
        if lost and two_sided and layout.rounding > INTEGRATED and high - low < _LOST:
            break
        x = next_trial(low, high, f_low, f_high, x_old, f_old, x, 0.25 * narrowest)
    if best_x == 1.0:
        copy_to(best_z, zb)
        copy_to(best_t, tb)
        best_w, best_slope = wb, sb
    copy_to(za, best_z)
    copy_to(ta, best_t)
    slope_out[0] = best_slope
    # the last Jacobian at the located point, for its rates and multipliers; the point itself stays
    p[active] = best_w
    fine, _, _ = settle(
        functions, layout, best_z, p, which, best_t, best_slope, scale, AT_EVENT, counts, room
    )
    p[active] = best_w
    if not fine:
        return -1.0
    close_chain(functions, layout, za, p, room.equations.none, room.equations)
    observe_point(functions, layout, za, p, best_slope, stability, tests, labels, mu, counts, room)
    return -2.0 - best_x if lost else best_x
