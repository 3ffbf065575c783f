"""The stopping rule of Newton's method, compiled.

One rule ends the iteration for orbits, branches and curves (:func:`verdict`), on an estimate of its
own error: with quadratic convergence the error after a correction of size d_k, following one of size d_{k-1},
is about ``d_k^3 / d_{k-1}^2``; at the floor of rounding the corrections stop falling. How high that floor is,
the residual says: a flow that is integrated through large accelerations rounds to 1e-13 of its state, not to
1e-16, and near the vertex of a pitchfork the corrections are that divided by the distance to it. A residual
that is small and no longer falls is rounding, and no iterate can be better. (Where the system itself is
singular corrections stop falling quadratically, too; but the residual goes on by a factor of 4 a step, being
quadratic in the distance.)
"""

from __future__ import annotations

import math

from contfric.compiled import helper

CONVERGED, NOT_CONVERGED, SINGULAR, NOT_FINITE = range(4)
#: The verdict on a correction that does not end the iteration.
GOES_ON = 4
#: Relative size of corrections at which rounding dominates (a few hundred units in the last place).
FLOOR = 5e-14
#: Rounding of a flow above which it is integrated: a closed form has that of its arithmetic.
INTEGRATED = 1e-14
#: Correction from which the next one is far below rounding: along a branch the last Jacobian, which
#: gives tangent and multipliers, is this near to the orbit.
ALONG = 3e-13
#: Relative residual that is rounding: where the system is ill-conditioned (near a fold) corrections
#: stop falling earlier, and no iterate can be better.
_ROUNDING = 1e-14
#: A residual that no longer falls is rounding below this many times that of the flow.
_NOISE = 10.0
#: Corrections that are rounding of its own numbers are no longer than this: a few thousand times the floor.
#: (In a motion that departs from its neighbours rounding of the end is far more, and moves the orbit less.)
_SMALL = 2e-10
#: A residual of rounding varies by more than this from step to step; one on its way down falls faster.
_STILL_FALLS = 0.5
#: Rounding of a segment's end against that of the numbers it is computed from, each of which counts with
#: its derivative: what flows in closed form are held to (50 units in the last place). That of a stiff mode is
#: far above that of the states.
_UNITS = 50.0 * 2.2e-16
#: Error that the last correction may leave: below one unit in the last place.
_TARGET = 1e-16


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
