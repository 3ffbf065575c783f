"""Newton's method on the chain of segments, compiled.

The equations and their exact Jacobian are those of :mod:`contfric.orbit.equations`; border rows tie
down as many parameters as are free. Each step solves for the correction and, with the same
elimination, for the tangent along the first border row.

One rule ends the iteration here and along curves in two parameters (:func:`verdict`), on an estimate of its
own error: with quadratic convergence the error after a correction of size d_k, following one of size d_{k-1},
is about ``d_k^3 / d_{k-1}^2``; at the floor of rounding the corrections stop falling. How high that floor is,
the residual says: a flow that is integrated through large accelerations rounds to 1e-13 of its state, not to
1e-16, and near the vertex of a pitchfork the corrections are that divided by the distance to it. A residual
that is small and no longer falls is rounding, and no iterate can be better. (Where the system itself is
singular corrections stop falling quadratically, too; but the residual goes on by a factor of 4 a step, being
quadratic in the distance.)

At fixed parameters an orbit that the equations do not determine (one of a continuum, or near one) has no
residual to speak of wherever Newton stops. So the last elimination also says what an error of rounding in
every equation would move it by; where that is more than :data:`_UNDETERMINED` the system is singular.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import types

from contfric.compiled import blocks, f8, helper, indices, kernel, matrix, vector
from contfric.compiling.references import by_reference
from contfric.flow.layouts import FlowType
from contfric.models.definition import FloatArray
from contfric.orbit.cyclic import (
    Elimination,
    elimination_workspace,
    finish,
    next_rows,
    start_border,
    take_out,
)
from contfric.orbit.equations import (
    EquationWorkspace,
    LayoutType,
    close_chain,
    equation_workspace,
    mismatch,
    segment_rows,
)

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
#: Relative residual that is rounding: where the system is ill-conditioned (near a fold) corrections
#: stop falling earlier, and no iterate can be better.
_ROUNDING = 1e-14
#: A residual that no longer falls is rounding below this many times that of the flow.
_NOISE = 10.0
#: Rounding of a segment's end against that of the numbers it is computed from, each of which counts with
#: its derivative: what flows in closed form are held to (50 units in the last place). That of a stiff mode is
#: far above that of the states.
_UNITS = 50.0 * 2.2e-16
#: Corrections that are rounding of its own numbers are no longer than this: a few thousand times the floor.
#: (In a motion that departs from its neighbours rounding of the end is far more, and moves the orbit less.)
_SMALL = 2e-10
#: A residual of rounding varies by more than this from step to step; one on its way down falls faster.
_STILL_FALLS = 0.5
#: Error that the last correction may leave: below one unit in the last place.
_TARGET = 1e-16
#: What rounding in every equation may move an orbit by (relative): far above what it does near folds and
#: vertices that are located (1e-7), far below what it does on a continuum (1e-2 and more).
_UNDETERMINED = 1e-5


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
def rounding_of_rows(rows, at, start, after):  # type: ignore[no-untyped-def]
    """Return what rounding of a segment's joint and of its end in time makes of its residual."""
    m, total = start.shape[0], 0.0
    for j in range(m - 1):
        row = m + j
        moved = abs(rows[row, 2 * m] * after[0])
        for k in range(m):
            moved += abs(rows[row, at + k] * start[k])
        total += moved / (1.0 + abs(after[1 + j]))
    return _UNITS * total


@helper
def newton_step(functions, layout, z, p, which, tangential, probe, workspace):  # type: ignore[no-untyped-def]
    """Solve the linearised equations at (z, p); return (solved, largest residual, largest rounding of one).

    The closure of the chain and the border rows are in the workspace. The solution is left in
    ``workspace.elimination``, the pencil of one turn in ``workspace.pencil``. With a ``probe`` above zero the
    second right-hand side is an error of this relative size in every equation. ``tangential`` is a segment
    with a tangential exit (-1: none).
    """
    count, m = z.shape
    work, equations = workspace.elimination, workspace.equations
    rows, second = work.rows, 3 * m + which.shape[0] + 1
    start_border(work, workspace.d, workspace.e, workspace.s, m)
    worst = noise = 0.0
    for i in range(count):
        if i > 0:
            next_rows(work, workspace.d, i, m)
        after = z[i + 1] if i + 1 < count else equations.last
        at = 0 if i == 0 else m
        here = segment_rows(functions, layout, i, at, z[i], after, p, which, equations, rows)
        if here == np.inf:
            return False, here, noise
        if i == tangential:
            add_rate(functions, layout, i, after, p, which, equations.grad, rows)
        worst = max(worst, here)
        noise = max(noise, rounding_of_rows(rows, at, z[i], after))
        if probe > 0.0:
            for j in range(m):  # signs and sizes without a pattern: no null vector is normal to it
                rows[m + j, second] = (
                    probe * math.cos(1.0 + 7.0 * i + 3.0 * j) * (1.0 + abs(after[j]))
                )
        if i > 0 and not take_out(work, i, m):
            return False, worst, noise
    pencil = workspace.pencil
    regular = finish(work, equations.close, equations.close_w, workspace.d, pencil[0], pencil[1])
    return regular, worst, noise


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
def off_normal(workspace, z, p, which):  # type: ignore[no-untyped-def]
    """Return how far (z, p) is off the plane of the first border row, through its reference point."""
    value = 0.0
    for i in range(z.shape[0]):
        for j in range(z.shape[1]):
            value += workspace.d[0, i, j] * (z[i, j] - workspace.z_ref[i, j])
    for k in range(which.shape[0]):
        value += workspace.e[0, k] * (p[which[k]] - workspace.p_ref[which[k]])
    return value


@helper
def no_condition(functions, layout, z, p, which, workspace, extra):  # type: ignore[no-untyped-def]
    """Border an orbit at fixed parameters: with nothing. Return (residual, segment of a tangential exit)."""
    return 0.0, -1


@helper
def normal_to_tangent(functions, layout, z, p, which, workspace, extra):  # type: ignore[no-untyped-def]
    """Border a branch with the plane normal to its tangent, along which the tangent asks for 1."""
    workspace.s[0, 0], workspace.s[0, 1] = -off_normal(workspace, z, p, which), 1.0
    return 0.0, -1


@helper
def move(z, p, which, dz, dw, share):  # type: ignore[no-untyped-def]
    """Add a share of a correction."""
    for i in range(z.shape[0]):
        for j in range(z.shape[1]):
            z[i, j] += share * dz[i, j, 0]
    for k in range(which.shape[0]):
        p[which[k]] += share * dw[k, 0]


@helper
def has_converged(size, before, worst, floor):  # type: ignore[no-untyped-def]
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
    """Tell whether a residual may be rounding, of flow or numbers, and the correction what it asks for."""
    flow, numbers = rounding
    if worst < _NOISE * flow and size < 1e-6:
        return True
    return worst < _NOISE * numbers and size < _SMALL


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
    rounding : relative rounding of the flow, and that of the numbers of a segment
    """
    if has_converged(size, before, worst, floor):
        return CONVERGED
    if at_floor(size, before, worst, worst_before, rounding):
        return CONVERGED
    if step > 1 and size > 2.0 * before and not is_noise(size, worst, rounding):
        return NOT_CONVERGED
    return GOES_ON


@helper
def rounding_of(layout, z):  # type: ignore[no-untyped-def]
    """Return the relative rounding of the flow: a closed form knows a phase as well as the time."""
    if layout.rounding <= INTEGRATED:
        return layout.rounding * (1.0 + abs(z[z.shape[0] - 1, 0]))
    return layout.rounding


def correcting(border: Any) -> Any:
    """Return the Newton iteration of orbits, branches or curves, as a helper.

    It takes ``(functions, layout, z, p, which, limits, workspace, extra)``, solves for the orbit from (z, p)
    in place, and returns (status, steps, size of the first correction, last residual).

    Parameters
    ----------
    border : fills the border rows of the workspace at (z, p), as many as parameters are free, and returns
        their residual and the segment of a tangential exit
    limits : (longest correction, infinite for the plain method: a flag would be compiled twice; size of a
        correction after which no other is asked for; the probe of :func:`newton_step`)
    workspace : allocated once: the elimination, with the last solution and the tangent; the pencil
        (2, m, m) P and Q; the rates: all of the last Jacobian, nearer than the second limit to the orbit
    extra : handed on to ``border``
    """

    @helper
    def correct(functions, layout, z, p, which, limits, workspace, extra):  # type: ignore[no-untyped-def]
        trust, floor, probe = limits
        before, first, worst = np.inf, 0.0, 0.0
        work, rounding = workspace.elimination, rounding_of(layout, z)
        share, worst_before, residual_before = 1.0, np.inf, np.inf
        damped, circles = math.isfinite(trust), 0
        for step in range(_MOST_STEPS):
            if damped:
                worst = mismatch(functions, layout, z, p, workspace.equations)
                if worst > 2.0 * worst_before and share > 1e-3:
                    # the last correction went too far: take back half of it
                    share *= 0.5
                    move(z, p, which, work.z, work.w, -share)
                    continue
                worst_before = worst
            close_chain(functions, layout, z, p, which, workspace.equations)
            residual, tangential = border(functions, layout, z, p, which, workspace, extra)
            if not math.isfinite(residual):
                return NOT_FINITE, step, first, residual
            solved, worst, noise = newton_step(
                functions, layout, z, p, which, tangential, probe, workspace
            )
            if not solved:
                return (SINGULAR if math.isfinite(worst) else NOT_FINITE), step, first, worst
            worst = max(worst, abs(residual))
            size = correction_size(work.z, work.w, z, p, which, 0)
            if size == np.inf:
                return NOT_FINITE, step, first, worst
            share = trust / size if size > trust else 1.0
            move(z, p, which, work.z, work.w, share)
            first = size if step == 0 else first
            roundings = rounding, noise
            found = verdict(step, size, before, worst, residual_before, floor, roundings)
            if found == CONVERGED or (found == NOT_CONVERGED and not damped):
                return found, step + 1, first, worst
            circles += 1 if size > 0.5 * before else 0
            if floor > ALONG and circles >= _CIRCLES and not is_noise(size, worst, roundings):
                return NOT_CONVERGED, step + 1, first, worst
            residual_before = worst
            before = size if share == 1.0 else np.inf  # one that was cut tells nothing of the order
        return NOT_CONVERGED, _MOST_STEPS, first, worst

    return correct


_correct_orbit = correcting(no_condition)


class OrbitWorkspace(NamedTuple):
    """Workspace for one orbit at fixed parameters: what the elimination needs, and no border rows."""

    equations: EquationWorkspace
    elimination: Elimination
    pencil: FloatArray
    d: FloatArray
    e: FloatArray
    s: FloatArray


@helper
def solved(functions, layout, z, p, trust, workspace):  # type: ignore[no-untyped-def]
    """Solve for the orbit at fixed parameters; what :func:`solve` returns."""
    layout, workspace = by_reference(layout), by_reference(workspace)
    work, none = workspace.elimination, workspace.equations.none
    limits = trust, FLOOR, layout.rounding
    status, steps, first, _ = _correct_orbit(functions, layout, z, p, none, limits, workspace, 0)
    if status == CONVERGED and correction_size(work.z, work.w, z, p, none, 1) > _UNDETERMINED:
        status = SINGULAR
    last = mismatch(functions, layout, z, p, workspace.equations)
    return float(status), float(steps), first, last


@kernel(types.UniTuple(f8, 4)(FlowType, LayoutType, matrix, vector, f8, blocks, indices))
def solve(functions, layout, z, p, trust, pencil, counts):  # type: ignore[no-untyped-def]
    """Solve for the orbit at fixed parameters, in place; (status, steps, first, residual).

    SINGULAR also where rounding moves the orbit that is found as if no equation held it.
    """
    counts[SOLVES] += 1
    count, m = z.shape
    free, right = min(count, 0), max(2 - count, 2)  # 0 and 2, but no literals
    equations, work = (
        equation_workspace(count, m, free),
        elimination_workspace(count, m, free, right),
    )
    d, e, s = np.empty((0, count, m)), np.empty((0, 0)), np.empty((0, 2))
    workspace = OrbitWorkspace(equations, work, pencil, d, e, s)
    return solved(functions, layout, z, p, trust, workspace)
