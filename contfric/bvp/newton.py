"""Newton's method on the chain of segments, compiled.

The equations and their exact Jacobian are those of :mod:`contfric.bvp.equations`; border rows tie
down as many parameters as are free. Each step solves for the correction and, with the same
elimination, for the tangent along the first border row. :mod:`contfric.bvp.convergence` says when it ends.

At fixed parameters an orbit that the equations do not determine (one of a continuum, or near one) has no
residual to speak of wherever Newton stops. So the last elimination also says what an error of rounding in
every equation would move it by; where that is more than :data:`_UNDETERMINED` the system is singular.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import types

from contfric.base.arrays import FloatArray, IntArray
from contfric.bvp.convergence import (
    ALONG,
    CONVERGED,
    FLOOR,
    NOT_CONVERGED,
    NOT_FINITE,
    SINGULAR,
    is_noise,
    rounding_of,
    rounding_of_rows,
    verdict,
)
from contfric.bvp.cyclic import (
    Elimination,
    elimination_workspace,
    finish,
    next_rows,
    start_border,
    take_out,
)
from contfric.bvp.equations import (
    EquationWorkspace,
    LayoutType,
    close_chain,
    equation_workspace,
    mismatch,
    segment_rows,
)
from contfric.compiled import blocks, f8, helper, indices, kernel, matrix, vector
from contfric.compiling.references import by_reference
from contfric.flow.layouts import FlowType

#: Places in the array of counts that kernels add to.
SOLVES, MULTIPLIERS, CHECKS, EVENTS = range(4)

#: Newton converges quadratically from a predictor in 2 to 4 steps; poor starts are damped and may
#: need more. Beyond this number the start is hopeless or the system singular.
_MOST_STEPS = 25
#: Correction that ends the iteration along a branch of an integrated flow, whose next Jacobian costs what
#: all else does together: the orbit is as good (what the correction leaves is below a unit in the last
#: place), and multipliers differ by this times their rate, where rounding of the flow is a hundredth of it.
ON_THE_WAY = 1e-10
#: Corrections that are not even halved after which a step along such a branch is given up: from the cubic
#: predictor Newton converges at once, or goes in circles about a touch of a kink for ever.
_CIRCLES = 2
#: What rounding in every equation may move an orbit by (relative): far above what it does near folds and
#: vertices that are located (1e-7), far below what it does on a continuum (1e-2 and more).
_UNDETERMINED = 1e-5
#: Turns that a segment of an iterate may last, either way. In a solution none lasts longer than one, and what
#: a segment costs grows with its duration: an iterate that is lost would be computed for minutes.
_LOST = 100.0


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
def newton_step(way, z, tangential, probe):  # type: ignore[no-untyped-def]
    """Solve the linearised equations at (z, p); return (solved, largest residual, largest rounding of one).

    The closure of the chain and the border rows are in the workspace. The solution is left in
    ``workspace.elimination``, the pencil of one turn in ``workspace.pencil``. With a ``probe`` above zero the
    second right-hand side is an error of this relative size in every equation. ``tangential`` is a segment
    with a tangential exit (-1: none).
    """
    functions, layout, p, which = way.functions, way.layout, way.p, way.which
    (count, m), workspace = z.shape, way.workspace
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
def off_normal(way, z):  # type: ignore[no-untyped-def]
    """Return how far an orbit is off the plane of the first border row, through its reference point."""
    workspace, which, value = way.workspace, way.which, 0.0
    for i in range(z.shape[0]):
        for j in range(z.shape[1]):
            value += workspace.d[0, i, j] * (z[i, j] - workspace.z_ref[i, j])
    for k in range(which.shape[0]):
        value += workspace.e[0, k] * (way.p[which[k]] - workspace.p_ref[which[k]])
    return value


@helper
def longest_of(layout, z, last):  # type: ignore[no-untyped-def]
    """Return the longest duration of a segment, either way, and that of the turn.

    Without an excitation the turn is an unknown as well: then it is the sum of all, either way.
    """
    longest = total = 0.0
    for i in range(z.shape[0]):
        end = z[i + 1, 0] if i + 1 < z.shape[0] else last[0]
        here = abs(end - z[i, 0])
        total += here
        longest = here if not here <= longest else longest
    return longest, total if layout.turn == 0.0 else abs(last[0] - z[0, 0])


@helper
def no_condition(way, z):  # type: ignore[no-untyped-def]
    """Border an orbit at fixed parameters: with nothing. Return (residual, segment of a tangential exit)."""
    return 0.0, -1


@helper
def normal_to_tangent(way, z):  # type: ignore[no-untyped-def]
    """Border a branch with the plane normal to its tangent, along which the tangent asks for 1."""
    way.workspace.s[0, 0], way.workspace.s[0, 1] = -off_normal(way, z), 1.0
    return 0.0, -1


@helper
def move(z, p, which, dz, dw, share):  # type: ignore[no-untyped-def]
    """Add a share of a correction."""
    for i in range(z.shape[0]):
        for j in range(z.shape[1]):
            z[i, j] += share * dz[i, j, 0]
    for k in range(which.shape[0]):
        p[which[k]] += share * dw[k, 0]


def correcting(border: Any) -> Any:
    """Return the Newton iteration of orbits, branches or curves, as a helper.

    It takes ``(way, z, limits)``, solves for the orbit from (z, p) in place, and returns (status, steps, size
    of the first correction, last residual).

    Parameters
    ----------
    border : fills the border rows of the workspace at ``(way, z)``, as many as parameters are free, and
        returns their residual and the segment of a tangential exit
    way : with the functions of the flow, the layout, the parameters p and which of them are free, and a
        workspace allocated once: the elimination, with the last solution and the tangent; the pencil
        (2, m, m) P and Q; the rates: all of the last Jacobian, nearer than the second limit to the orbit
    limits : (longest correction, infinite for the plain method: a flag would be compiled twice; size of a
        correction after which no other is asked for; the probe of :func:`newton_step`)
    """

    @helper
    def correct(way, z, limits):  # type: ignore[no-untyped-def]
        functions, layout, p, which = way.functions, way.layout, way.p, way.which
        workspace, (trust, floor, probe) = way.workspace, limits
        before, first, worst = np.inf, 0.0, 0.0
        work, rounding = workspace.elimination, rounding_of(layout, z)
        share, worst_before, residual_before = 1.0, np.inf, np.inf
        damped, circles = math.isfinite(trust), 0
        turn = np.inf
        for step in range(_MOST_STEPS):
            close_chain(functions, layout, z, p, which, workspace.equations)
            longest, turn_here = longest_of(layout, z, workspace.equations.last)
            turn = turn_here if step == 0 else turn
            lost = longest > _LOST * turn
            if damped:
                worst = np.inf if lost else mismatch(functions, layout, z, p, workspace.equations)
                if worst > 2.0 * worst_before and share > 1e-3:
                    # the last correction went too far: take back half of it
                    share *= 0.5
                    move(z, p, which, work.z, work.w, -share)
                    continue
                worst_before = worst
            if lost:
                return NOT_CONVERGED, step, first, worst
            residual, tangential = border(way, z)
            if not math.isfinite(residual):
                return NOT_FINITE, step, first, residual
            solved, worst, noise = newton_step(way, z, tangential, probe)
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


class AtParameters(NamedTuple):
    """What Newton's method needs for an orbit at fixed parameters, besides its joints; none is free."""

    functions: Any
    layout: Any
    p: FloatArray
    which: IntArray
    workspace: OrbitWorkspace


@helper
def solved(way, z, trust):  # type: ignore[no-untyped-def]
    """Solve for the orbit at fixed parameters; what :func:`solve` returns."""
    way = by_reference(way)
    work, layout, equations = way.workspace.elimination, way.layout, way.workspace.equations
    limits = trust, FLOOR, layout.rounding
    status, steps, first, _ = _correct_orbit(way, z, limits)
    moved = correction_size(work.z, work.w, z, way.p, way.which, 1)
    if status == CONVERGED and moved > _UNDETERMINED:
        status = SINGULAR
    last = mismatch(way.functions, layout, z, way.p, equations)
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
    return solved(AtParameters(functions, layout, p, equations.none, workspace), z, trust)
