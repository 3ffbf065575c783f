"""One point of a curve, compiled: Newton normal to the tangent, the watch, the border vectors.

The product of two directions is that of a branch with both parameters in it,
``<a, b> = (1/N) sum a_i b_i + sum_k a_k b_k / width_k^2``.
"""

from __future__ import annotations

import math

import numpy as np

from contfric.compiled import helper
from contfric.continuation.steps import CHI_MINUS, CHI_ONE, CHI_PAIR, EXTRA, copy_to
from contfric.curves.bending import DIFFERENCE
from contfric.curves.conditions import EXIT, JOINT, SPECTRAL, condition_value
from contfric.curves.normal_form import cubic_coefficient
from contfric.orbit.cyclic import finish, next_rows, start_border, take_out
from contfric.orbit.equations import close_chain, segment_rows
from contfric.orbit.monitor import find_behind, find_turnings, watch
from contfric.orbit.newton import (
    CHECKS,
    CONVERGED,
    GOES_ON,
    MULTIPLIERS,
    SOLVES,
    correction_size,
    move,
    verdict,
)
from contfric.orbit.spectrum import multipliers
from contfric.orbit.system import RETURNS

#: The extra column that a curve watches where a branch watches the slope of its parameter: the
#: coefficient of the normal form, or the rate of the load at a stop.
BEND = 0
#: A stationary value this near to a surface on which one is pinned is that one: it is solved for.
_TOUCHES = 1e-9
#: Newton converges quadratically from the cubic predictor; beyond this the step was too long.
_MOST_STEPS = 12
#: Differences that are tried, and how much shorter each is: at the third (6e-10) a derivative that is
#: good to 1e-12 still leaves three digits, with which Newton converges and tangents are good enough.
_ATTEMPTS, _SHORTER = 3, 1e-2


@helper
def plane_product(za, wa, zb, wb, scale):  # type: ignore[no-untyped-def]
    """Return the scaled product of two directions."""
    total = 0.0
    for i in range(za.shape[0]):
        for j in range(za.shape[1]):
            total += za[i, j] * zb[i, j]
    total /= za.shape[0]
    for k in range(wa.shape[0]):
        total += wa[k] * wb[k] * scale[k]
    return total


@helper
def plane_distance(za, wa, zb, wb, scale):  # type: ignore[no-untyped-def]
    """Return the distance of two points in the scaled product."""
    total = 0.0
    for i in range(za.shape[0]):
        for j in range(za.shape[1]):
            total += (za[i, j] - zb[i, j]) ** 2
    total /= za.shape[0]
    for k in range(wa.shape[0]):
        total += (wa[k] - wb[k]) ** 2 * scale[k]
    return math.sqrt(total)


@helper
def anchor_plane(room, z, p, which, tz, tw, scale):  # type: ignore[no-untyped-def]
    """Set the first border row: normal to a tangent through the point (z, p)."""
    count = tz.shape[0]
    for i in range(count):
        for j in range(tz.shape[1]):
            room.d[0, i, j] = tz[i, j] / count
            room.z_ref[i, j] = z[i, j]
    for k in range(which.shape[0]):
        room.e[0, k] = tw[k] * scale[k]
        room.p_ref[k] = p[which[k]]


@helper
def off_normal(room, z, p, which):  # type: ignore[no-untyped-def]
    """Return the residual of the first border row."""
    value = 0.0
    for i in range(z.shape[0]):
        for j in range(z.shape[1]):
            value += room.d[0, i, j] * (z[i, j] - room.z_ref[i, j])
    for k in range(which.shape[0]):
        value += room.e[0, k] * (p[which[k]] - room.p_ref[k])
    return value


@helper
def turn_tangent(work, tz, tw, scale):  # type: ignore[no-untyped-def]
    """Replace the tangent by the one of the last elimination; False if there is none."""
    count, m = tz.shape
    total = 0.0
    for i in range(count):
        for j in range(m):
            total += work.z[i, j, 1] ** 2
    total /= count
    for k in range(tw.shape[0]):
        total += work.w[k, 1] ** 2 * scale[k]
    norm = math.sqrt(total)
    if not math.isfinite(norm) or norm == 0.0:
        return False
    for i in range(count):
        for j in range(m):
            tz[i, j] = work.z[i, j, 1] / norm
    for k in range(tw.shape[0]):
        tw[k] = work.w[k, 1] / norm
    return True


@helper
def add_rate(functions, layout, i, after, p, which, grad, rows):  # type: ignore[no-untyped-def]
    """Add the rate of the exit to the exit's own row.

    Where both vanish this is no other equation. But the exit's row alone says nothing of the time at which
    an exit is tangential, and no pivot would be left for it.
    """
    m, free = after.shape[0], which.shape[0]
    row, c = 2 * m - 1, layout.observables[layout.exits[i]]
    rate = functions.rate(layout.modes[i], c, after[0], after[1:], p, which, grad)
    for k in range(m):
        rows[row, 2 * m + k] += grad[k]
    for k in range(free):
        rows[row, 3 * m + k] += grad[m + k]
    rows[row, 3 * m + free] -= rate


@helper
def curve_step(functions, layout, condition, z, p, which, room):  # type: ignore[no-untyped-def]
    """Solve the linearised equations at (z, p); return (solved, largest residual).

    As :func:`contfric.orbit.newton.newton_step`, for a condition.
    """
    count, m = z.shape
    work, equations = room.elimination, room.equations
    rows = work.rows
    start_border(work.border, room.d, room.e, room.s, m)
    worst = 0.0
    for i in range(count):
        if i > 0:
            next_rows(rows, work.border, room.d, i, m)
        after = z[i + 1] if i + 1 < count else equations.last
        at = 0 if i == 0 else m
        here = segment_rows(functions, layout, i, at, z[i], after, p, which, equations, rows)
        if here == np.inf:
            return False, here
        if condition.kind == EXIT and i == condition.segment:
            add_rate(functions, layout, i, after, p, which, equations.grad, rows)
        worst = max(worst, here)
        if i > 0 and not take_out(work, i, m):
            return False, worst
    pencil = room.pencil
    return finish(work, equations.close, equations.close_w, pencil[0], pencil[1]), worst


@helper
def settle_curve(  # type: ignore[no-untyped-def]
    functions,
    second,
    layout,
    condition,
    z,
    p,
    which,
    border,
    tz,
    tw,
    scale,
    accuracy,
    counts,
    room,
):
    """Correct (z, p) normal to the tangent, and replace the tangent; False if Newton fails.

    Where it fails with second derivatives by differences it is tried again with shorter ones: beside a touch
    of a kink the first derivatives change within less than the difference.
    """
    anchor_plane(room, z, p, which, tz, tw, scale)
    counts[SOLVES] += 1
    difference, fine = room.bordered.difference, False
    for attempt in range(_ATTEMPTS):
        difference[0], difference[1] = DIFFERENCE * _SHORTER**attempt, 0.0
        if attempt > 0:
            copy_to(z, room.z_ref)
            for k in range(which.shape[0]):
                p[which[k]] = room.p_ref[k]
        fine = correct_curve(
            functions, second, layout, condition, z, p, which, border, accuracy, room
        )
        if fine or difference[1] == 0.0:
            break
    difference[0] = DIFFERENCE
    return fine and turn_tangent(room.elimination, tz, tw, scale)


@helper
def correct_curve(functions, second, layout, condition, z, p, which, border, accuracy, room):  # type: ignore[no-untyped-def]
    """Correct (z, p) on the plane that is anchored in the room; False if Newton fails."""
    work, equations, s = room.elimination, room.equations, room.s
    before, worst_before = np.inf, np.inf
    for step in range(_MOST_STEPS):
        close_chain(functions, layout, z, p, which, equations)
        g = condition_value(functions, second, layout, condition, z, p, which, border, room)
        if not math.isfinite(g):
            return False
        s[0, 0], s[0, 1] = -off_normal(room, z, p, which), 1.0
        s[1, 0], s[1, 1] = -g, 0.0
        solved, worst = curve_step(functions, layout, condition, z, p, which, room)
        if not solved:
            return False
        size = correction_size(work.z, work.w, z, p, which, 0)
        if size == np.inf:
            return False
        move(z, p, which, work.z, work.w, 1.0)
        worst = max(worst, abs(g))
        found = verdict(step, size, before, worst, worst_before, accuracy, layout.rounding)
        if found == CONVERGED:
            close_chain(functions, layout, z, p, which, equations)
        if found != GOES_ON:
            return found == CONVERGED
        before, worst_before = size, worst
    return False


@helper
def follow_border(border, room):  # type: ignore[no-untyped-def]
    """Make the null vectors of the last point the border of the next one."""
    bordered = room.bordered
    count, m = bordered.v.shape
    for side in range(2):
        source = bordered.u if side == 0 else bordered.v
        total = 0.0
        for i in range(count):
            for j in range(m):
                total += source[i, j] ** 2
        norm = math.sqrt(total)
        for i in range(count):
            for j in range(m):
                border[side, i, j] = source[i, j] / norm


@helper
def bend_value(functions, second, layout, condition, z, p, which, room):  # type: ignore[no-untyped-def]
    """Return the coefficient or rate whose zero is a point of codimension two; 1 if there is none."""
    if condition.kind == SPECTRAL and condition.sign < 0.0:
        return cubic_coefficient(functions, second, layout, condition.sign, z, p, which, room)
    if condition.kind == SPECTRAL:
        bordered, value = room.bordered, 0.0
        for i in range(z.shape[0]):
            for j in range(z.shape[1]):
                value += room.d[1, i, j] * bordered.v[i, j]
        return value
    if condition.kind == JOINT and condition.rest >= 0:
        i, equations = condition.segment, room.equations
        after = z[i + 1] if i + 1 < z.shape[0] else equations.last
        c = layout.observables[condition.surface]
        return functions.rate(
            condition.rest, c, after[0], after[1:], p, equations.none, equations.empty
        )
    return 1.0


@helper
def other_touches(functions, layout, row, z, p, room):  # type: ignore[no-untyped-def]
    """Return an interior margin without the one stationary point that lies on the surface."""
    i, surface = layout.interior[row, 0], layout.interior[row, 1]
    sign, turnings, equations = float(layout.interior[row, 2]), room.turnings, room.equations
    c = layout.observables[surface]
    if layout.departs[i] < RETURNS:
        found = find_behind(functions, layout, i, c, z, p, equations, turnings)
    else:
        found = find_turnings(functions, layout, i, c, z, p, equations.last, turnings)
    target = functions.level(surface, p, equations.none, equations.empty)
    touch, least = -1, np.inf
    for k in range(found):
        gap = abs(turnings.values[k] - target)
        if gap < _TOUCHES and (touch < 0 or gap < abs(turnings.values[touch] - target)):
            touch = k
    for k in range(found):
        if k != touch:
            least = min(least, sign * (turnings.values[k] - target))
    return least


@helper
def observe_curve(  # type: ignore[no-untyped-def]
    functions, second, layout, condition, z, p, which, tests, labels, mu, counts, room
):
    """Fill everything that is watched on a settled point; False if something is not finite."""
    counts[CHECKS] += 1
    counts[MULTIPLIERS] += 1
    equations = room.equations
    at = tests.shape[0] - EXTRA
    one, minus = multipliers(layout.rank, room.pencil, equations.close, mu, room.spectral)
    tests[at + BEND] = bend_value(functions, second, layout, condition, z, p, which, room)
    finite = watch(functions, layout, z, p, equations, room.turnings, tests, labels)
    for k in range(condition.pinned.shape[0]):
        row = condition.pinned[k]
        tests[row] = 1.0
        if row < layout.interior.shape[0]:
            tests[row] = other_touches(functions, layout, row, z, p, room)
    distances = at - labels.shape[0]
    for k in range(condition.quiet.shape[0]):
        labels[condition.quiet[k]] = 0
        tests[distances + condition.quiet[k]] = 1.0
    spectral = condition.kind == SPECTRAL
    tests[at + CHI_ONE] = 1.0 if spectral and condition.sign > 0.0 else one
    tests[at + CHI_MINUS] = 1.0 if spectral and condition.sign < 0.0 else minus
    tests[at + CHI_PAIR] = 1.0
    if layout.rank > 1:
        tests[at + CHI_PAIR] = 1.0 - abs(mu[0]) * abs(mu[1])
    if condition.kind == EXIT:  # multipliers are infinite there
        for k in range(CHI_ONE, EXTRA):
            tests[at + k] = 1.0
        for k in range(mu.shape[0]):
            mu[k] = np.inf
    return finite
