"""The extremum of an observable over an orbit with its gradient by joints and parameters, compiled.

Where it is reached inside of a segment the gradient is that of the value at a fixed time after the start
(the envelope theorem). A symmetric orbit is solved on its half, but an extremum is one of the whole orbit:
its second half is the image of the first, ``(t + turn, K y)``, and gradients follow by the chain rule.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba import types

from contfric.base.arrays import FloatArray
from contfric.bvp.after_reset import apply_reset
from contfric.bvp.equations import (
    EquationWorkspace,
    LayoutType,
    close_chain,
    equation_workspace,
    segment_jacobian,
)
from contfric.bvp.stationary_points import find_after_reset, find_stationary, stationary_workspace
from contfric.compiled import allocating_helper, f8, helper, i8, kernel, matrix, vector
from contfric.flow.layouts import FlowType

if TYPE_CHECKING:
    from contfric.orbit.orbit import Orbit

#: Where an extremum is reached: at a joint, after the reset there, inside of a segment.
JOINT, AFTER_RESET, INSIDE = range(3)
#: Places in what says that: the segment, which of the three, the time after its start; and the next value.
SEGMENT, KIND, TIME, NEXT = range(4)
#: Values that differ by less than this, relative to 1 + their size, are equal: orbits are solved to 1e-13.
EQUAL = 1e-10


class Extreme(NamedTuple):
    """The extremum of an observable, as the compiled engine takes it.

    Attributes
    ----------
    observable : which; -1 for the first state where its extrema are at joints
    inside : whether it may be extreme inside of segments
    sign : 1 for the largest value, -1 for the least
    whole : layout of the whole orbit
    """

    observable: int
    inside: int
    sign: float
    whole: Any


ExtremeType = types.NamedTuple([i8, i8, f8, LayoutType], Extreme)


class ExtremeWorkspace(NamedTuple):
    """Workspace of an extremum; allocated once.

    Attributes
    ----------
    equations : for the segments of the whole orbit
    cycle : joints of the whole orbit
    location : where the extremum is reached, shape (4,)
    start : gradient by the joint where that segment starts, shape (m,)
    """

    equations: EquationWorkspace
    cycle: FloatArray
    location: FloatArray
    start: FloatArray


@allocating_helper
def extreme_workspace(whole, m, none):  # type: ignore[no-untyped-def]
    """Return the workspace for an orbit of so many segments; ``none`` is 0, but no literal."""
    return ExtremeWorkspace(
        equation_workspace(whole, m, none), np.empty((whole, m)), np.empty(4), np.empty(m)
    )


@helper
def fill_cycle(functions, layout, extreme, z, p, own):  # type: ignore[no-untyped-def]
    """Write the joints of the whole orbit, and the closure of its last one."""
    cycle, equations = own.cycle, own.equations
    count, m = z.shape
    autonomous = layout.turn == 0.0
    turn = (
        -z[0, 0]
        if autonomous
        else layout.turn * functions.period(p, equations.none, equations.empty)
    )
    for i in range(cycle.shape[0]):
        base = i % count
        cycle[i, 0] = z[base, 0]
        if autonomous and cycle.shape[0] > count:
            cycle[i, 0] -= turn  # the end of the whole is at time 0
        if i < count:
            for k in range(1, m):
                cycle[i, k] = z[base, k]
            continue
        cycle[i, 0] += turn
        for k in range(1, m):
            value = 0.0
            for j in range(1, m):
                value += layout.closure[k - 1, j - 1] * z[base, j]
            cycle[i, k] = value
    close_chain(functions, extreme.whole, cycle, p, equations.none, equations)


@helper
def seen(functions, c, t, y, p, which, grad):  # type: ignore[no-untyped-def]
    """Return observable c with its gradient, where there is space for it; -1 is the first state."""
    if c >= 0:
        return functions.observe(c, t, y, p, which, grad)
    for k in range(grad.shape[0]):
        grad[k] = 1.0 if k == 1 else 0.0
    return y[0]


@helper
def stationary_in(functions, extreme, i, p, own, stationary):  # type: ignore[no-untyped-def]
    """Fill the stationary points of segment i of the whole orbit; return their number, -1 if too many."""
    whole, c = extreme.whole, extreme.observable
    if whole.resets[i] >= 0:
        return find_after_reset(functions, whole, i, c, own.cycle, p, own.equations, stationary)
    return find_stationary(functions, whole, i, c, own.cycle, p, own.equations.last, stationary)


@helper
def better(value, best, location, segment, kind, time):  # type: ignore[no-untyped-def]
    """Return the larger of two values, and keep the place of the first if it is larger."""
    if not value > best:
        location[NEXT] = max(location[NEXT], value)
        return best
    location[NEXT] = best
    location[SEGMENT], location[KIND], location[TIME] = segment, kind, time
    return value


@helper
def find_location(functions, layout, extreme, z, p, own, stationary):  # type: ignore[no-untyped-def]
    """Find where the extremum is reached; False if a search fails."""
    cycle, location, whole, equations = own.cycle, own.location, extreme.whole, own.equations
    c, sign, n = extreme.observable, extreme.sign, z.shape[1] - 1
    none, empty, best = equations.none, equations.empty, -np.inf
    location[NEXT] = best
    fill_cycle(functions, layout, extreme, z, p, own)
    for i in range(cycle.shape[0]):
        value = sign * seen(functions, c, cycle[i, 0], cycle[i, 1:], p, none, empty)
        best = better(value, best, location, i, JOINT, 0.0)
        if whole.resets[i] >= 0:
            apply_reset(functions, whole, i, cycle[i], p, none, equations)
            after_reset = equations.after_reset[n, :n]
            value = sign * seen(functions, c, cycle[i, 0], after_reset, p, none, empty)
            best = better(value, best, location, i, AFTER_RESET, 0.0)
        found = stationary_in(functions, extreme, i, p, own, stationary) if extreme.inside else 0
        if found < 0:
            return False
        for k in range(found):
            value = sign * stationary.values[k]
            best = better(value, best, location, i, INSIDE, stationary.times[k])
    return math.isfinite(best)


@helper
def add_chained(start, by_parameters, grad, jac, at, n):  # type: ignore[no-untyped-def]
    """Add a gradient by a state, given its derivatives by a joint and, from column ``at``, by parameters."""
    start[0] += grad[0]
    for a in range(n):
        for k in range(1 + n):
            start[k] += grad[1 + a] * jac[a, k]
        for k in range(by_parameters.shape[0]):
            by_parameters[k] += grad[1 + a] * jac[a, at + k]
    for k in range(by_parameters.shape[0]):
        by_parameters[k] += grad[1 + n + k]


@helper
def gradient_at_location(functions, extreme, p, which, equations, stationary, own, by_parameters):  # type: ignore[no-untyped-def]
    """Return the value at the location, with its gradient by the joint of its segment and the parameters."""
    location, whole, grad, start = own.location, extreme.whole, equations.grad, own.start
    i, kind, c, n = (
        int(location[SEGMENT]),
        int(location[KIND]),
        extreme.observable,
        own.start.shape[0] - 1,
    )
    joint = own.cycle[i]
    for k in range(1 + n):
        start[k] = 0.0
    if kind == JOINT:
        value = seen(functions, c, joint[0], joint[1:], p, which, grad)
        for k in range(1 + n):
            start[k] = grad[k]
        for k in range(which.shape[0]):
            by_parameters[k] = grad[1 + n + k]
        return value
    if kind == AFTER_RESET:
        apply_reset(functions, whole, i, joint, p, which, equations)
        value = seen(functions, c, joint[0], equations.after_reset[n, :n], p, which, grad)
        add_chained(start, by_parameters, grad, equations.after_reset, 1 + n, n)
        return value
    found, nearest = stationary_in(functions, extreme, i, p, own, stationary), -1
    for k in range(found):
        gap = abs(stationary.times[k] - location[TIME])
        if nearest < 0 or gap < abs(stationary.times[nearest] - location[TIME]):
            nearest = k
    if nearest < 0:
        return np.nan
    time = stationary.times[nearest]
    segment_jacobian(functions, whole, i, joint, time, p, which, equations.jac, equations)
    value = seen(functions, c, joint[0] + time, equations.state, p, which, grad)
    add_chained(start, by_parameters, grad, equations.jac, 2 + n, n)
    return value


@helper
def extreme_row(  # type: ignore[no-untyped-def]
    functions, layout, extreme, z, p, which, equations, stationary, own, on_joints, on_parameters
):
    """Return Q at the location that was found, and write Q' by joints and parameters."""
    count, m = z.shape
    on_joints[:, :] = 0.0
    on_parameters[:] = 0.0
    fill_cycle(functions, layout, extreme, z, p, own)
    value = gradient_at_location(
        functions, extreme, p, which, equations, stationary, own, on_parameters
    )
    i, start = int(own.location[SEGMENT]), own.start
    base = i % count
    on_joints[base, 0] = start[0]
    for k in range(1, m):
        if i < count:
            on_joints[base, k] = start[k]
            continue
        for j in range(1, m):
            on_joints[base, k] += start[j] * layout.closure[j - 1, k - 1]
    if i >= count and layout.turn != 0.0:
        functions.period(p, which, equations.level_grad)
        for k in range(which.shape[0]):
            on_parameters[k] += start[0] * layout.turn * equations.level_grad[k]
    return value


@kernel(f8(FlowType, LayoutType, ExtremeType, matrix, vector, matrix, vector))
def measure_extreme(functions, layout, extreme, z, p, on_joints, on_parameters):  # type: ignore[no-untyped-def]
    """Return an extremum of an orbit with its derivatives by the joints, and by all parameters.

    NaN where several values are the extremum, or a search fails.
    """
    count, m = z.shape
    which, stationary = np.arange(p.shape[0]), stationary_workspace()
    equations = equation_workspace(count, m, p.shape[0])
    own = extreme_workspace(extreme.whole.modes.shape[0], m, min(count, 0))
    if not find_location(functions, layout, extreme, z, p, own, stationary):
        return np.nan
    value = extreme_row(
        functions,
        layout,
        extreme,
        z,
        p,
        which,
        equations,
        stationary,
        own,
        on_joints,
        on_parameters,
    )
    tied = own.location[NEXT] >= extreme.sign * value - EQUAL * (1.0 + abs(value))
    return np.nan if tied else value


def extreme_with_derivatives(
    orbit: Orbit, observable: int, inside: int, sign: float
) -> tuple[float, FloatArray, FloatArray] | None:
    """Return what :meth:`contfric.Orbit.extreme` does."""
    system, joints = orbit.system, np.ascontiguousarray(orbit.joints)
    by_joints, by_parameters = np.empty(joints.shape), np.empty(len(orbit.vector))
    extreme = Extreme(observable, inside, sign, orbit.as_whole().system.layout)
    value = measure_extreme(
        *(system.functions(), system.layout, extreme, joints, orbit.vector),
        *(by_joints, by_parameters),
    )
    return (value, by_joints, by_parameters) if math.isfinite(value) else None
