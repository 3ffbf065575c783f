"""Solutions that have become periodic: recognised at a near return, solved for, exponents exact; compiled.

Three joints of the past are remembered: one of the last period, one of the last 8, and one of a stretch that
doubles from 64 on (R. P. Brent, BIT 20 (1980) 176-184). A later joint at the same surface, before the same
mode, at the same phase and state to within 1e-6, is a near return. The cycle between the two is then
solved for by Newton's method with the tangent map M of the cycle, ``(1 - M) dz = P(z) - z``, and accepted
if it returns to 1e-11 and attracts. (A near return of a chaotic motion leads to a cycle that repels, or
nowhere; then the solution goes on, and the next return has to be ten times nearer.)

The exponents of the cycle are ``ln|mu| / T`` with the eigenvalues mu of M over its period T. Of the
smallest one that is not zero, which a matrix in floating point would lose next to a large one, the sum is
known: the logarithms of an orthonormalised frame (:func:`contfric.chaos.tangent.orthonormalise`) add up to
``ln|mu_1 .. mu_r|`` over a cycle, without cancellation.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray, IntArray
from contfric.bvp.cyclic import dense_solve
from contfric.bvp.spectrum import spectrum
from contfric.chaos.tangent import (
    ARRIVED,
    Transit,
    carry_after_joint,
    differentiate,
    forget_events,
    is_autonomous,
    new_transit,
    orthonormalise,
    push,
    to_joint,
)
from contfric.compiled import allocating_helper, helper, inlined_helper
from contfric.simulation.sides import surfaces_after

#: Joints that are remembered.
_MEMORIES = 3
#: A return this near (nondimensional) is worth solving for; each failure asks for a tenth of it. Small
#: against the attractors (of size 1), and large enough to save two thirds of the way to rounding.
NEAR = 1e-6
#: A cycle that returns this near is periodic to rounding, which a period of a hundred events amplifies.
_EXACT = 1e-11
#: The same where rounding is amplified so much that Newton's method stands still before.
_STALLED = 1e-9
#: Most passes through a cycle: Newton's method squares 1e-6 to rounding in two.
_PASSES = 6
#: Longest correction: the orbit must be near, even where returns contract by 1e-3 only.
_REACH = 1e-3
#: A cycle that attracts to rounding; one of a continuum has a multiplier 1.
_ATTRACTS = 1.0 + 1e-6
#: What rounding adds to the logarithm of a multiplier at each joint.
_ROUNDING = 1e-15
#: What the solution of a cycle returns where the motion stands still; the speed (relative to 1 + state)
#: below which it does. At a cycle as small as that, rounding would be all there is.
AT_A_POINT, _SLOW = -2.0, 1e-5
#: Below this share of the largest multiplier the others of a matrix are rounding.
_RESOLVED = 1e-8


class Memory(NamedTuple):
    """The joints that are remembered.

    Attributes
    ----------
    key, cycle, event, span : mode and surface, period, number of the joint, and periods until it is
        replaced; shape (3,)
    z : phase and state, shape (3, 1 + n)
    near : distance that counts as a return, shape (1,)
    """

    key: IntArray
    cycle: IntArray
    event: IntArray
    span: IntArray
    z: FloatArray
    near: FloatArray


class CycleWorkspace(NamedTuple):
    """Workspace for a cycle: the solution along it, its joint z, frames, and the algebra of a matrix."""

    transit: Transit
    z: FloatArray
    images: FloatArray
    frame: FloatArray
    growth: FloatArray
    logs: FloatArray
    left: FloatArray
    right: FloatArray
    mu: NDArray[np.complex128]
    real: FloatArray
    work: FloatArray
    product: FloatArray
    rates: FloatArray


@allocating_helper
def new_memory(n):  # type: ignore[no-untyped-def]
    """Return workspace for the joints that are remembered."""
    return Memory(
        np.empty(_MEMORIES, dtype=np.int64),
        np.empty(_MEMORIES, dtype=np.int64),
        np.empty(_MEMORIES, dtype=np.int64),
        np.empty(_MEMORIES, dtype=np.int64),
        np.empty((_MEMORIES, 1 + n)),
        np.empty(1),
    )


@allocating_helper
def new_cycle_workspace(n):  # type: ignore[no-untyped-def]
    """Return workspace for a cycle of n states."""
    m = n + 1
    return CycleWorkspace(
        new_transit(n),
        np.empty(m),
        np.empty((m, m)),
        np.empty((n, m)),
        np.empty(n),
        np.empty(n),
        np.empty((m, m)),
        np.empty((m, 1)),
        np.empty(n, dtype=np.complex128),
        np.empty(m + 1),
        np.empty((m, m)),
        np.empty((m, m)),
        np.empty(n),
    )


@helper
def forget(memory):  # type: ignore[no-untyped-def]
    """Remember nothing."""
    for i in range(memory.key.shape[0]):
        memory.key[i] = -1
        memory.cycle[i] = -1
        memory.span[i] = 8**i
    memory.near[0] = NEAR


@inlined_helper
def nearest_turn(turns, slip, period, timeless):  # type: ignore[no-untyped-def]
    """Return the whole periods between two joints and the shift in phase that is left.

    Without excitation any time may have passed.
    """
    if timeless:
        return 1, 0.0
    if slip > 0.5 * period:
        return turns + 1, slip - period
    if slip < -0.5 * period:
        return turns - 1, slip + period
    return turns, slip


@helper
def returned(memory, key, cycle, event, t, y, period, timeless):  # type: ignore[no-untyped-def]
    """Return (joints, periods) since a joint that this one is a near return of; zeros if none.

    What has been remembered for its span is replaced by this joint.
    """
    near = memory.near[0]
    for i in range(memory.key.shape[0]):
        turns = cycle - memory.cycle[i]
        if memory.key[i] == key and turns >= 0:
            turns, slip = nearest_turn(turns, t - memory.z[i, 0], period, timeless)
            same = turns > 0 and abs(slip) <= near
            for j in range(y.shape[0]):
                same = same and abs(y[j] - memory.z[i, 1 + j]) <= near * (1.0 + abs(y[j]))
            if same:
                return event - memory.event[i], turns
        if memory.key[i] < 0 or cycle - memory.cycle[i] > memory.span[i]:
            if memory.key[i] >= 0 and i == memory.key.shape[0] - 1:
                memory.span[i] *= 2
            memory.key[i], memory.cycle[i], memory.event[i] = key, cycle, event
            memory.z[i, 0] = t
            for j in range(y.shape[0]):
                memory.z[i, 1 + j] = y[j]
    return 0, 0


@helper
def doubt(memory):  # type: ignore[no-untyped-def]
    """Forget, and ask the next return to be nearer."""
    for i in range(memory.key.shape[0]):
        memory.key[i] = -1
    memory.near[0] = max(0.1 * memory.near[0], _EXACT)


@helper
def go_round(functions, tables, ranks, mode, on, joints, p, period, cycle, workspace):  # type: ignore[no-untyped-def]
    """Follow ``joints`` segments from the joint ``cycle.z`` with the tangent map.

    Returns
    -------
    tuple
        (mode and surface at the end as one number, -1 if the solution broke off; rank; periods; phase;
        duration).
        ``cycle.images`` holds the images of the unit vectors, row by row; ``cycle.logs`` the growth
        of the frame.
    """
    transit, z, images, frame = cycle.transit, cycle.z, cycle.images, cycle.frame
    n = transit.y.shape[0]
    forget_events(transit)
    t, turns, rank, lasted = z[0], 0, n, 0.0
    for i in range(n + 1):
        for j in range(n + 1):
            images[i, j] = 1.0 if i == j else 0.0
    if is_autonomous(transit):
        images[0, 0] = 0.0
    for j in range(n):
        transit.y[j] = z[1 + j]
        cycle.logs[j] = 0.0
    key = -1
    for _ in range(joints):
        outcome, surface, following, duration, more, t = to_joint(
            functions, tables, mode, on, t, p, period, transit, workspace
        )
        if outcome != ARRIVED:
            return -1, rank, turns, t, lasted
        observable = tables.observables[surface]
        rate = differentiate(functions, observable, mode, duration, t, p, transit, workspace.none)
        rank = min(rank, ranks[mode])
        push(images, n + 1, rate, transit.jac, transit.grad, transit.image)
        push(frame, rank, rate, transit.jac, transit.grad, transit.image)
        reset = tables.bounds[mode, surface] == 2
        if reset or is_autonomous(transit):
            carry_after_joint(functions, surface, t, p, images, n + 1, transit, workspace, reset)
            carry_after_joint(functions, surface, t, p, frame, rank, transit, workspace, reset)
        lasted += duration
        if not orthonormalise(frame, rank, cycle.growth):
            return -1, rank, turns, t, lasted
        for k in range(rank):
            cycle.logs[k] += cycle.growth[k]
        turns += more
        on = surfaces_after(tables, mode, surface)
        mode = following
        key = mode * tables.observables.shape[0] + surface
    return key, rank, turns, t, lasted


@helper
def correction(cycle):  # type: ignore[no-untyped-def]
    """Solve ``(1 - M) dz = r`` in place of r; return the size of dz, infinity if singular."""
    m = cycle.z.shape[0]
    for i in range(m):
        for j in range(m):
            cycle.left[i, j] = (1.0 if i == j else 0.0) - cycle.images[j, i]
    if not dense_solve(cycle.left, cycle.right):
        return np.inf
    size = 0.0
    for i in range(m):
        size = max(size, abs(cycle.right[i, 0]) / (1.0 + abs(cycle.z[i])))
    return size if size < np.inf else np.inf


@helper
def cycle_rates(cycle, rank, time):  # type: ignore[no-untyped-def]
    """Write the exponents of a cycle, largest first; return the largest modulus of a multiplier."""
    n = cycle.rates.shape[0]
    spectrum(cycle.images, rank, cycle.mu, cycle.real, cycle.work, cycle.product)
    total = 0.0
    for k in range(rank):
        total += cycle.logs[k]
    largest = abs(cycle.mu[0]) if rank > 0 else 0.0
    for k in range(n):
        size = abs(cycle.mu[k]) if k < rank else 0.0
        last = k == rank - 1 and k > 0
        if size > 0.0 and not last and size > _RESOLVED * largest:
            growth = math.log(size)
        elif k < rank:
            growth = total if last or k == 0 else cycle.logs[k]
        else:
            growth = -np.inf
        cycle.rates[k] = growth / time
        total -= growth if k < rank else 0.0
    return largest


@helper
def stands_still(functions, mode, p, cycle, workspace):  # type: ignore[no-untyped-def]
    """Tell whether hardly anything moves at the joint ``cycle.z``: a solution shrinks to an equilibrium."""
    transit, z, still = cycle.transit, cycle.z, True
    n = transit.y.shape[0]
    functions.flow(mode, z[0], z[1:], 0.0, p, workspace.none, transit.end, transit.jac)
    for j in range(n):
        still = still and abs(transit.jac[j, 1 + n]) <= _SLOW * (1.0 + abs(z[1 + j]))
    return still


@helper
def solve_cycle(  # type: ignore[no-untyped-def]
    functions, tables, ranks, mode, on, key, joints, turns, p, period, cycle, workspace
):
    """Solve for the cycle through the joint ``cycle.z``.

    Returns
    -------
    float
        An estimate of the error of the largest exponent; negative if there is no such cycle, or it
        repels; ``AT_A_POINT`` if it has shrunk to one. ``cycle.rates`` holds the exponents.
    """
    n, time = cycle.transit.y.shape[0], turns * period
    timeless = is_autonomous(cycle.transit)
    before, moved, rate_before = np.inf, 0.0, 0.0
    sensitivity, amplified = 0.0, 0.0
    for step in range(_PASSES):
        if timeless and stands_still(functions, mode, p, cycle, workspace):
            return AT_A_POINT
        last, rank, done, t, lasted = go_round(
            functions, tables, ranks, mode, on, joints, p, period, cycle, workspace
        )
        if last != key:
            return -1.0
        if timeless:
            time = lasted
        cycle.right[0, 0] = 0.0 if timeless else t + (done - turns) * period - cycle.z[0]
        for j in range(n):
            cycle.right[1 + j, 0] = cycle.transit.y[j] - cycle.z[1 + j]
        gap = 0.0
        for j in range(n + 1):
            gap = max(gap, abs(cycle.right[j, 0]) / (1.0 + abs(cycle.z[j])))
        largest = cycle_rates(cycle, rank, time)
        if moved > 0.0:
            sensitivity, amplified = abs(cycle.rates[0] - rate_before) / moved, moved / before
        stalled = gap > 0.5 * before
        if step > 0 and (gap <= _EXACT or (stalled and gap <= _STALLED)):
            if not largest <= _ATTRACTS:
                return -1.0
            return sensitivity * gap * amplified + _ROUNDING * joints / time
        if stalled or not gap < np.inf:
            return -1.0
        moved, rate_before, before = 0.0, cycle.rates[0], gap
        if gap > _EXACT:
            moved = correction(cycle)
            if not moved <= _REACH:
                return -1.0
            for j in range(n + 1):
                cycle.z[j] += cycle.right[j, 0]
    return -1.0


@helper
def shortest(functions, tables, ranks, mode, on, key, joints, turns, p, period, cycle, workspace):  # type: ignore[no-untyped-def]
    """Return the period of the cycle through ``cycle.z``, which may close before its end."""
    for parts in range(turns, 1, -1):
        if turns % parts != 0 or joints % parts != 0:
            continue
        last, _, done, t, _ = go_round(
            functions, tables, ranks, mode, on, joints // parts, p, period, cycle, workspace
        )
        gap = abs(t + (done - turns // parts) * period - cycle.z[0])
        for j in range(cycle.transit.y.shape[0]):
            gap = max(gap, abs(cycle.transit.y[j] - cycle.z[1 + j]) / (1.0 + abs(cycle.z[1 + j])))
        if last == key and gap <= NEAR:
            return turns // parts
    return turns
