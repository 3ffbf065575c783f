"""One step of a branch, compiled: the scaled product, the corrector normal to a tangent, the watch.

The product of two directions is ``<a, b> = (1/N) sum a_i b_i + a_p b_p / width^2``, so that neither
the number of segments nor the unit of the parameter matters.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from contfric.compiled import allocating_helper, helper
from contfric.models.definition import FloatArray
from contfric.orbit.cyclic import Elimination, room_for
from contfric.orbit.equations import Room, close_chain, equation_room
from contfric.orbit.monitor import Turnings, turning_room, watch
from contfric.orbit.newton import CHECKS, CONVERGED, MULTIPLIERS, NOT_FINITE, SOLVES, correct
from contfric.orbit.spectrum import SpectralRoom, multipliers, spectral_room

#: Extra columns of the tests behind the margins and the distances of the labels: slope of the
#: parameter, products of 1 - mu and of
#: 1 + mu, and 1 - |mu_1 mu_2| of the two largest multipliers.
FOLD, CHI_ONE, CHI_MINUS, CHI_PAIR = range(4)
EXTRA = 4
#: Correction that ends the iteration where an event is located: its test function counts to its last
#: digits.
AT_EVENT = 3e-15
#: Share of the smaller end value above which a parabola's minimum is believed to stay positive.
_SURE = 0.2


class StepRoom(NamedTuple):
    """Room for the steps of one branch: all that a corrector and the watch need, allocated once."""

    equations: Room
    elimination: Elimination
    spectral: SpectralRoom
    turnings: Turnings
    pencil: FloatArray
    d: FloatArray
    e: FloatArray
    s: FloatArray
    z_ref: FloatArray
    p_ref: FloatArray


@allocating_helper
def step_room(count, m, parameters):  # type: ignore[no-untyped-def]
    """Return the room for the branch of a chain."""
    free = max(1 - count, 1)  # one parameter, but no literal
    return StepRoom(
        equation_room(count, m, free),
        room_for(count, m, free, free + free),
        spectral_room(m),
        turning_room(),
        np.empty((2, m, m)),
        np.empty((1, count, m)),
        np.empty((1, 1)),
        np.empty((1, 2)),
        np.empty((count, m)),
        np.empty(parameters),
    )


@helper
def product(za, wa, zb, wb, scale):  # type: ignore[no-untyped-def]
    """Return the scaled product of two directions."""
    total = 0.0
    for i in range(za.shape[0]):
        for j in range(za.shape[1]):
            total += za[i, j] * zb[i, j]
    return total / za.shape[0] + wa * wb * scale


@helper
def apart(za, wa, zb, wb, scale):  # type: ignore[no-untyped-def]
    """Return the distance of two points in the scaled product."""
    total = 0.0
    for i in range(za.shape[0]):
        for j in range(za.shape[1]):
            total += (za[i, j] - zb[i, j]) ** 2
    return math.sqrt(total / za.shape[0] + (wa - wb) ** 2 * scale)


@helper
def copy_to(target, source):  # type: ignore[no-untyped-def]
    """Copy a matrix."""
    for i in range(source.shape[0]):
        for j in range(source.shape[1]):
            target[i, j] = source[i, j]


@helper
def largest_state(z):  # type: ignore[no-untyped-def]
    """Return the largest component of the states, times left out."""
    size = 0.0
    for i in range(z.shape[0]):
        for j in range(1, z.shape[1]):
            size = max(size, abs(z[i, j]))
    return size


@helper
def anchor(room, z, p, tz, tw, scale):  # type: ignore[no-untyped-def]
    """Set the border row: normal to a tangent through the point (z, p)."""
    count = tz.shape[0]
    for i in range(count):
        for j in range(tz.shape[1]):
            room.d[0, i, j] = tz[i, j] / count
            room.z_ref[i, j] = z[i, j]
    room.e[0, 0] = tw * scale
    for k in range(p.shape[0]):
        room.p_ref[k] = p[k]


@helper
def settle(functions, layout, z, p, which, tz, tw, scale, accuracy, counts, room):  # type: ignore[no-untyped-def]
    """Correct (z, p) normal to the tangent (tz, tw), and replace the tangent.

    Returns
    -------
    tuple
        (converged, new p', everything finite).
    """
    anchor(room, z, p, tz, tw, scale)
    counts[SOLVES] += 1
    work = room.elimination
    status, _, _, _ = correct(
        functions,
        layout,
        z,
        p,
        which,
        room.z_ref,
        room.p_ref,
        room.d,
        room.e,
        room.s,
        np.inf,
        accuracy,
        0.0,
        room.equations,
        work,
        room.pencil,
    )
    if status != CONVERGED:
        return False, tw, status != NOT_FINITE
    count, m = z.shape
    total = 0.0
    for i in range(count):
        for j in range(m):
            total += work.z[i, j, 1] ** 2
    slope = work.w[0, 1]
    norm = math.sqrt(total / count + slope * slope * scale)
    if not math.isfinite(norm) or norm == 0.0:
        return False, tw, False
    for i in range(count):
        for j in range(m):
            tz[i, j] = work.z[i, j, 1] / norm
    close_chain(functions, layout, z, p, room.equations.none, room.equations)
    return True, slope / norm, True


@helper
def observe_point(functions, layout, z, p, slope, stability, tests, labels, mu, counts, room):  # type: ignore[no-untyped-def]
    """Fill everything that is watched on a settled point; False if something is not finite."""
    counts[CHECKS] += 1
    finite = watch(functions, layout, z, p, room.equations, room.turnings, tests, labels)
    at = tests.shape[0] - EXTRA
    tests[at + FOLD] = slope
    tests[at + CHI_ONE] = 1.0
    tests[at + CHI_MINUS] = 1.0
    tests[at + CHI_PAIR] = 1.0
    if stability:
        counts[MULTIPLIERS] += 1
        tests[at + CHI_ONE], tests[at + CHI_MINUS] = multipliers(
            layout.rank, room.pencil, room.equations.close, mu, room.spectral
        )
        if layout.rank > 1:
            tests[at + CHI_PAIR] = 1.0 - abs(mu[0]) * abs(mu[1])
    return finite


@helper
def dips(tests, k, arc, value, step):  # type: ignore[no-untyped-def]
    """Tell whether some test, positive at both ends of a step, is likely to be negative within.

    By the parabola through the last two points and the new one.
    """
    back = arc[k] - arc[k - 1]
    for j in range(value.shape[0]):
        f0, f1, f2 = tests[k - 1, j], tests[k, j], value[j]
        if not (f0 * f1 > 0.0 and f1 * f2 > 0.0) or not math.isfinite(f0 * f1 * f2):
            continue
        slope0 = (f1 - f0) / back
        slope1 = (f2 - f1) / step
        bend = (slope1 - slope0) / (back + step)
        slope = slope1 - bend * step  # at the start of the step
        if bend * f1 <= 0.0 or slope * f1 >= 0.0:
            continue
        at = -slope / (2.0 * bend)
        if at < step and abs(f1) + 0.5 * slope * at * math.copysign(1.0, f1) < _SURE * min(
            abs(f1), abs(f2)
        ):
            return True
    return False


@helper
def changed(before, after, labels_before, labels_after):  # type: ignore[no-untyped-def]
    """Tell whether any test changes sign or any label changes between two points."""
    margins = before.shape[0] - EXTRA
    for j in range(margins):
        if after[j] < 0.0:
            return True
    for j in range(margins, before.shape[0]):
        if before[j] * after[j] < 0.0:
            return True
    for j in range(labels_before.shape[0]):
        if labels_before[j] != labels_after[j]:
            return True
    return False


@helper
def returned(z, w, start_z, start_w, tz, tw, last_z, last_w, scale, step):  # type: ignore[no-untyped-def]
    """Tell whether a step passes the start of the branch again in the same direction."""
    if apart(z, w, start_z, start_w, scale) > 1.5 * step:
        return False
    start = product(start_z, start_w, tz, tw, scale)
    behind = product(last_z, last_w, tz, tw, scale)
    ahead = product(z, w, tz, tw, scale)
    return behind < start <= ahead
