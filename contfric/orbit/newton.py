"""Newton's method on the chain of segments, compiled.

The equations and their exact Jacobian are those of :mod:`contfric.orbit.equations`; border rows tie
down as many parameters as are free. Each step solves for the correction and, with the same
elimination, for the tangent along the first border row.

One rule ends the iteration here and along curves in two parameters (:func:`verdict`), on an estimate of its
own error: with quadratic convergence the error after a correction of size d_k, following one of size d_{k-1},
is about ``d_k^3 / d_{k-1}^2``; at the floor of rounding the corrections stop falling. How high that floor is,
the residual says: a flow that is integrated through large accelerations rounds to 1e-13 of its state, not to
1e-16, and beside the vertex of a pitchfork the corrections are that divided by the distance to it. A residual
that is small and no longer falls is rounding, and no iterate can be better. (Where the system itself is
singular corrections stop falling quadratically, too; but the residual goes on by a factor of 4 a step, being
quadratic in the distance.)

At fixed parameters an orbit that the equations do not determine (one of a continuum, or beside one) has no
residual to speak of wherever Newton stops. So the last elimination also says what an error of rounding in
every equation would move it by; where that is more than :data:`_UNDETERMINED` the system is singular.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from contfric.compiled import blocks, f8, helper, indices, kernel, matrix, vector
from contfric.flow.layouts import FlowType
from contfric.orbit.cyclic import finish, next_rows, room_for, start_border, take_out
from contfric.orbit.equations import (
    LayoutType,
    close_chain,
    equation_room,
    mismatch,
    segment_rows,
)
from contfric.orbit.holds import NO_PIN

#: Places in the array of counts that kernels add to.
SOLVES, MULTIPLIERS, CHECKS, EVENTS = range(4)

CONVERGED, NOT_CONVERGED, SINGULAR, NOT_FINITE = range(4)
#: The verdict on a correction that does not end the iteration.
GOES_ON = 4

#: Newton converges quadratically from a predictor in 2 to 4 steps; poor starts are damped and may
#: need more. Beyond this number the start is hopeless or the system singular.
_MOST_STEPS = 25
#: Relative size of corrections at which rounding dominates (a few hundred units in the last place).
FLOOR = 5e-14
#: Rounding of a flow above which it is integrated: a closed form has that of its arithmetic.
INTEGRATED = 1e-14
#: Correction from which the next one is far below rounding: along a branch the last Jacobian, which
#: gives tangent and multipliers, is this near to the orbit.
ALONG = 3e-13
#: The same along a branch of an integrated flow, whose next Jacobian costs what all else does together: the
#: orbit is as good (what the correction leaves is below a unit in the last place), and multipliers differ by
#: this times their rate, where rounding of the flow is a hundredth of it.
ON_THE_WAY = 1e-10
#: Corrections that are not even halved after which a step along such a branch is given up: from the cubic
#: predictor Newton converges at once, or goes in circles about a touch of a kink for ever.
_CIRCLES = 2
#: Relative residual that is rounding: where the system is ill-conditioned (beside a fold) corrections
#: stop falling earlier, and no iterate can be better.
_ROUNDING = 1e-14
#: A residual that no longer falls is rounding below this many times that of the flow.
_NOISE = 10.0
#: A residual of rounding varies by more than this from step to step; one on its way down falls faster.
_STILL_FALLS = 0.5
#: Error that the last correction may leave: below one unit in the last place.
_TARGET = 1e-16
#: What rounding in every equation may move an orbit by (relative): far above what it does beside folds and
#: vertices that are located (1e-7), far below what it does on a continuum (1e-2 and more).
_UNDETERMINED = 1e-5


@helper
def newton_step(functions, layout, z, p, which, d, e, s, probe, room, work, pencil):  # type: ignore[no-untyped-def]
    """Solve the linearised equations at (z, p); return (solved, largest residual).

    The solution is left in ``work.z`` and ``work.w``, the pencil of one turn in ``pencil``. With a ``probe``
    above zero the second right-hand side is an error of this relative size in every equation.
    """
    count, m = z.shape
    second = 3 * m + which.shape[0] + 1
    rows = work.rows
    close_chain(functions, layout, z, p, which, room)
    start_border(work.border, d, e, s, m)
    worst = 0.0
    for i in range(count):
        if i > 0:
            next_rows(rows, work.border, d, i, m)
        after = z[i + 1] if i + 1 < count else room.last
        at = 0 if i == 0 else m
        here = segment_rows(functions, layout, i, at, z[i], after, p, which, room, rows)
        if here == np.inf:
            return False, here
        worst = max(worst, here)
        if probe > 0.0:
            for j in range(m):  # signs and sizes without a pattern: no null vector is normal to it
                rows[m + j, second] = (
                    probe * math.cos(1.0 + 7.0 * i + 3.0 * j) * (1.0 + abs(after[j]))
                )
        if i > 0 and not take_out(work, i, m):
            return False, worst
    return finish(work, room.close, room.close_w, pencil[0], pencil[1]), worst


@helper
def correction_size(dz, dw, z, p, which, column):  # type: ignore[no-untyped-def]
    """Return the largest component of a solution against the scale of its unknown; 0 is the correction."""
    size = 0.0
    for i in range(z.shape[0]):
        for j in range(z.shape[1]):
            here = abs(dz[i, j, column]) / (1.0 + abs(z[i, j]))
            if not here <= size:
                size = here
                if not math.isfinite(size):
                    return np.inf
    for k in range(which.shape[0]):
        here = abs(dw[k, column]) / (1.0 + abs(p[which[k]]))
        if not here <= size:
            size = here
    return size if math.isfinite(size) else np.inf


@helper
def constraint(z, p, which, z_ref, p_ref, d, e, s):  # type: ignore[no-untyped-def]
    """Fill the right-hand sides of the border rows ``D (z - z_ref) + E (p - p_ref) = 0``.

    That of the tangent asks for 1 along the first row.
    """
    for k in range(which.shape[0]):
        value = 0.0
        for i in range(z.shape[0]):
            for j in range(z.shape[1]):
                value += d[k, i, j] * (z[i, j] - z_ref[i, j])
        for j in range(which.shape[0]):
            value += e[k, j] * (p[which[j]] - p_ref[which[j]])
        s[k, 0] = -value
        s[k, 1] = 1.0 if k == 0 else 0.0


@helper
def move(z, p, which, dz, dw, share):  # type: ignore[no-untyped-def]
    """Add a share of a correction."""
    for i in range(z.shape[0]):
        for j in range(z.shape[1]):
            z[i, j] += share * dz[i, j, 0]
    for k in range(which.shape[0]):
        p[which[k]] += share * dw[k, 0]


@helper
def has_settled(size, before, worst, floor):  # type: ignore[no-untyped-def]
    """Tell whether the last correction ends the iteration."""
    left = size if not math.isfinite(before) else size * (size / before) ** 2
    if size <= min(floor, ALONG) or (floor <= FLOOR and size < 1e-3 and left <= _TARGET):
        return True
    if size <= floor and left <= _TARGET:
        return True
    if size < 0.5 * before:
        return False
    return size < FLOOR * 100 or (worst < _ROUNDING and size < 1e-6)


@helper
def is_noise(size, worst, rounding):  # type: ignore[no-untyped-def]
    """Tell whether a residual may be rounding, and the correction what it asks for."""
    return worst < _NOISE * rounding and size < 1e-6


@helper
def at_floor(size, before, worst, worst_before, rounding):  # type: ignore[no-untyped-def]
    """Tell whether neither corrections nor residual fall any more: what is left is rounding."""
    stands = size >= 0.5 * before and worst >= _STILL_FALLS * worst_before
    return stands and is_noise(size, worst, rounding)


@helper
def verdict(step, size, before, worst, worst_before, floor, rounding):  # type: ignore[no-untyped-def]
    """Return what becomes of the iteration after a correction: CONVERGED, NOT_CONVERGED or GOES_ON.

    Parameters
    ----------
    size, before : this correction and the last one; infinite if that was cut or there was none
    worst, worst_before : largest residual before this correction, and before the last one
    floor : size of a correction after which no other is asked for
    rounding : relative rounding of the flow
    """
    if has_settled(size, before, worst, floor):
        return CONVERGED
    if at_floor(size, before, worst, worst_before, rounding):
        return CONVERGED
    if step > 1 and size > 2.0 * before and not is_noise(size, worst, rounding):
        return NOT_CONVERGED
    return GOES_ON


@helper
def correct(  # type: ignore[no-untyped-def]
    functions, layout, z, p, which, z_ref, p_ref, d, e, s, trust, floor, probe, room, work, pencil
):
    """Solve for the orbit from (z, p) in place, border rows anchored at (z_ref, p_ref).

    Returns
    -------
    tuple
        (status, steps, size of the first correction, last residual). ``work`` holds the last solution
        and with it the tangent, ``pencil`` (2, m, m) P and Q, ``room.rates`` the rates: all of the
        last Jacobian, at a distance below ``floor`` from the orbit. ``trust`` is the longest
        correction, infinite for the plain method (a number, as a flag would be compiled twice).
        ``probe`` is that of :func:`newton_step`.
    """
    before, first, worst = np.inf, 0.0, 0.0
    rounding = layout.rounding
    if rounding <= INTEGRATED:  # a closed form knows a phase as well as the time
        rounding *= 1.0 + abs(z[z.shape[0] - 1, 0])
    share, worst_before, residual_before = 1.0, np.inf, np.inf
    damped, circles = math.isfinite(trust), 0
    for step in range(_MOST_STEPS):
        if damped:
            worst = mismatch(functions, layout, z, p, room)
            if worst > 2.0 * worst_before and share > 1e-3:
                # the last correction went too far: take back half of it
                share *= 0.5
                move(z, p, which, work.z, work.w, -share)
                continue
            worst_before = worst
        constraint(z, p, which, z_ref, p_ref, d, e, s)
        solved, worst = newton_step(
            functions, layout, z, p, which, d, e, s, probe, room, work, pencil
        )
        if not solved:
            return (SINGULAR if math.isfinite(worst) else NOT_FINITE), step, first, worst
        size = correction_size(work.z, work.w, z, p, which, 0)
        if size == np.inf:
            return NOT_FINITE, step, first, worst
        share = trust / size if size > trust else 1.0
        move(z, p, which, work.z, work.w, share)
        if step == 0:
            first = size
        found = verdict(step, size, before, worst, residual_before, floor, rounding)
        if found == CONVERGED or (found == NOT_CONVERGED and not damped):
            return found, step + 1, first, worst
        if size > 0.5 * before:
            circles += 1
        if floor > ALONG and circles >= _CIRCLES and not is_noise(size, worst, rounding):
            return NOT_CONVERGED, step + 1, first, worst
        residual_before = worst
        before = (
            size if share == 1.0 else np.inf
        )  # a correction that was cut tells nothing of the order
    return NOT_CONVERGED, _MOST_STEPS, first, worst


@kernel(types.UniTuple(f8, 4)(FlowType, LayoutType, matrix, vector, f8, blocks, indices))
def solve(functions, layout, z, p, trust, pencil, counts):  # type: ignore[no-untyped-def]
    """Solve for the orbit at fixed parameters, in place; (status, steps, first, residual).

    SINGULAR also where rounding moves the orbit that is found as if no equation held it.
    """
    counts[SOLVES] += 1
    count, m = z.shape
    free, right = min(count, 0), max(2 - count, 2)  # 0 and 2, but no literals
    room, work = equation_room(count, m, free), room_for(count, m, free, right)
    d, e, s = np.empty((0, count, m)), np.empty((0, 0)), np.empty((0, 2))
    status, steps, first, _ = correct(
        functions,
        layout,
        z,
        p,
        room.none,
        z,
        p,
        d,
        e,
        s,
        trust,
        FLOOR,
        layout.rounding,
        room,
        work,
        pencil,
    )
    if status == CONVERGED:
        moved = correction_size(work.z, work.w, z, p, room.none, 1)
        if moved > _UNDETERMINED:
            status = SINGULAR
    return float(status), float(steps), first, mismatch(functions, layout, z, p, room)


@helper
def rates_at_joint(functions, layout, i, after, p, which, room, rows):  # type: ignore[no-untyped-def]
    """Take the rates at the end of segment i at the joint itself, where the exit's condition holds exactly.

    The state that the flow comes to misses it by rounding. Where the exit is tangential, time is divided by
    that: multipliers would be rounding.
    """
    n = after.shape[0] - 1
    m = n + 1
    jac = room.jac
    functions.flow(layout.modes[i], after[0], after[1:], 0.0, p, which, room.state, jac)
    for j in range(n):
        change = jac[j, 1 + n] - rows[m + j, 2 * m]
        rows[m + j, 2 * m] += change
        rows[m + j, m] -= change


@kernel(types.boolean(FlowType, LayoutType, matrix, vector, blocks, blocks, blocks, blocks, matrix))
def linearise(functions, layout, z, p, a, b, c, r, close):  # type: ignore[no-untyped-def]
    """Fill the blocks of the full Jacobian for use outside of the engine.

    The first parameters are differentiated by, as many as ``c`` has columns: none or all.
    """
    count, m = z.shape
    free = c.shape[2]
    which = np.empty(free, dtype=np.int64)
    for k in range(free):
        which[k] = k
    room, rows = equation_room(count, m, free), np.empty((2 * m, 3 * m + free + 1))
    close_chain(functions, layout, z, p, which, room)
    for i in range(m):
        for j in range(m):
            close[i, j] = room.close[i, j]
    fine = True
    for i in range(count):
        after = z[i + 1] if i + 1 < count else room.last
        worst = segment_rows(functions, layout, i, m, z[i], after, p, which, room, rows)
        fine = fine and math.isfinite(worst)
        if layout.pins[i] == NO_PIN:
            rates_at_joint(functions, layout, i, after, p, which, room, rows)
        for j in range(m):
            for k in range(m):
                a[i, j, k] = rows[m + j, m + k]
                b[i, j, k] = rows[m + j, 2 * m + k]
            for k in range(free):
                c[i, j, k] = rows[m + j, 3 * m + k]
            r[i, j, 0] = rows[m + j, 3 * m + free]
    # the closure's dependence on the parameters is added to the last segment's columns
    for i in range(m):
        for k in range(free):
            for j in range(m):
                c[count - 1, i, k] += b[count - 1, i, j] * room.close_w[j, k]
    return fine
