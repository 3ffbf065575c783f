"""The solution that takes prescribed outcomes at its joints, admissible or not, compiled.

Where a mode ends at a surface, the itinerary says what follows, not the state: each branch of a return map
with a jump is so continued beyond the jump.
"""

from __future__ import annotations

import numpy as np
from numba import types

from contfric.bvp.equations import LayoutType
from contfric.compiled import helper, i8, kernel, matrix, vector
from contfric.flow.layouts import FlowType

#: Most crossings of an exit surface looked at: one in the wrong sense, one in the right one.
_PASSES = 2
#: A state is on a surface if it is this near: the starts of slides are solved to rounding.
_ON_SURFACE = 1e-12


@helper
def next_joint(functions, layout, i, joint, p, within, none, empty, met):  # type: ignore[no-untyped-def]
    """Move a joint to where segment i from there meets its exit in the right sense; False if nowhere.

    Parameters
    ----------
    joint : (time, state), shape (1 + n,); overwritten
    within : longest duration up to a crossing of the exit surface
    met : workspace, shape (n,)
    """
    mode, exit_, state = layout.modes[i], layout.exits[i], joint[1:]
    c, level = layout.observables[exit_], functions.level(exit_, p, none, empty)
    on = abs(functions.observe(c, joint[0], state, p, none, empty) - level) < _ON_SURFACE
    for _ in range(_PASSES):
        took = functions.hit(mode, c, level, on, joint[0], state, within, p, met)
        if took < 0.0:
            return False
        joint[0] += took
        for k in range(met.shape[0]):
            state[k] = met[k]
        rate = functions.rate(mode, c, joint[0], state, p, none, empty)
        if rate * layout.exit_signs[i] > 0.0:
            return True
        on = True
    return False


@kernel(types.boolean(FlowType, LayoutType, matrix, vector, i8, vector))
def follow_itinerary(functions, layout, joints, p, rounds, end):  # type: ignore[no-untyped-def]
    """Follow the solution that takes the outcomes of an itinerary from its first joint; False if it cannot.

    Parameters
    ----------
    joints : those of the last round are written, shape (N, 1 + n)
    rounds : how often the itinerary is run through; the clock is put back after each
    end : where the last round ends, written, shape (1 + n,)
    """
    count, m = joints.shape
    none, empty, met = np.empty(0, np.int64), np.empty(0), np.empty(m - 1)
    turn = layout.turn * functions.period(p, none, empty)
    for k in range(m):
        end[k] = joints[0, k]
    for _ in range(rounds):
        for i in range(count):
            for k in range(m):
                joints[i, k] = end[k]
            if not next_joint(functions, layout, i, end, p, turn, none, empty, met):
                return False
        end[0] -= turn
    return True
