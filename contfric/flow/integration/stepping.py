"""Steps whose error is controlled, by whichever method: one accepted step at a time.

The step is chosen so that the error of each component in each step is below

    absolute * scale + relative * |component|,

with the scale of the state that the model declares (for variations: that scale over the unit of what is
varied). The start is Hairer's rule (Hairer, Norsett, Wanner, "Solving Ordinary Differential Equations
I", section II.4), the control proportional-integral (Hairer, Wanner, "Solving Ordinary Differential
Equations II", section IV.2).

A *method* is a helper ``motion.attempt(motion, mode, c, t, h, p, which, workspace)``, which steps from
``workspace.start`` to ``workspace.end`` and returns the error in units of what is allowed (infinite or no
number: the step failed), together with ``probe(...)``, which steps within the last accepted step.
"""

from __future__ import annotations

import math

from contfric.compiled import helper
from contfric.flow.integration.dop853 import POWER, explicit_error, explicit_step
from contfric.flow.integration.variations import slope

#: What the control remembers: the next step (positive), the last error, the power of the step with which
#: the error falls, the kind of the method (0 explicit, 1 implicit), steps tried so far, whether the
#: Jacobian is that of the start, the last implicit step (0: none), steps held back by stiffness, how
#: patiently that is borne, steps since the method changed.
NEXT, BEFORE, FALLS, KIND, TRIED, FRESH, REMEMBERED, LIMITED, PATIENCE, SINCE = range(10)

#: Most steps tried in one segment. A segment takes 1 to 1e4 of them; one that takes many more is stiffer than
#: its method can bear or ends in a singularity, and the caller is told. Trial motions of Newton's method
#: may be such ones: it gives them up after seconds.
MOST_STEPS = 200_000
#: Share of the optimal step that is taken, and the limits of its change (Hairer's values).
SAFETY, SHRINK, GROW = 0.9, 1.0 / 3.0, 6.0
#: Share of the integral part in the control (Hairer's value for smooth changes of the step).
INTEGRAL = 0.04
#: Change of the step after one that failed altogether, and the share of what is left below which that is
#: given up.
FAILED, HOPELESS = 0.2, 1e-14
#: A state counts as at least this share of its scale when the first step is chosen: one that starts next
#: to zero would ask for a step that does not move the time.
_SIZED = 1e-4
#: Errors below this are taken for it: the step grows as far as it may anyhow.
_LEAST = 1e-10


@helper
def first_step(motion, mode, c, t, left, p, which, workspace):  # type: ignore[no-untyped-def]
    """Write the slope at the start and propose the first step (Hairer's rule)."""
    start, slopes, control, allowed = (
        workspace.start,
        workspace.slopes,
        workspace.control,
        workspace.allowed,
    )
    size = start.shape[0]
    slope(motion, mode, c, t, start, p, which, workspace, slopes[0])
    d0, d1 = _SIZED / motion.absolute, 0.0
    for k in range(size):
        here = allowed[k] + motion.relative * abs(start[k])
        d0 = max(d0, abs(start[k]) / here)
        d1 = max(d1, abs(slopes[0, k]) / here)
    h = 1e-6 if d1 < 1e-5 else 0.01 * d0 / d1
    h = min(h, abs(left))
    step = math.copysign(h, left)
    for k in range(size):
        workspace.stage[k] = start[k] + step * slopes[0, k]
    slope(motion, mode, c, t + step, workspace.stage, p, which, workspace, slopes[1])
    d2 = 0.0
    for k in range(size):
        here = allowed[k] + motion.relative * abs(start[k])
        d2 = max(d2, abs(slopes[1, k] - slopes[0, k]) / here)
    largest = max(d1, d2 / h) if h > 0.0 else d1
    proposed = (0.01 / largest) ** (1.0 / POWER) if largest > 1e-15 else max(1e-6, 1e-3 * h)
    control[NEXT] = min(100.0 * h, proposed)
    if not control[NEXT] > 0.0:  # nothing finite, or no time left: the first trial finds out
        control[NEXT] = abs(left)
    control[BEFORE], control[FALLS], control[PATIENCE] = 1e-4, POWER, 1.0


@helper
def length_of(proposed, left):  # type: ignore[no-untyped-def]
    """Return the step to take with what is left: no tiny last one."""
    if proposed >= 0.99 * left:
        return left
    return 0.5 * left if proposed > 0.5 * left else proposed


@helper
def next_step(motion, mode, c, t, left, p, which, workspace):  # type: ignore[no-untyped-def]
    """Take the next step that is accurate enough, at most ``left`` (of either sign); return it.

    The end and its slope are in ``workspace.end`` and ``workspace.last``. No number if there is no such step:
    too many were tried, or none is finite.
    """
    control = workspace.control
    rejected = False
    while True:
        control[TRIED] += 1.0
        size = length_of(control[NEXT], abs(left))
        # a step may be below the rounding of the time: a state that blows up moves in it all the same
        if control[TRIED] > MOST_STEPS:
            return math.nan
        h = math.copysign(size, left)
        error = motion.attempt(motion, mode, c, t, h, p, which, workspace)
        if not math.isfinite(error):
            control[NEXT], rejected = FAILED * size, True
            if size < HOPELESS * abs(left):
                return math.nan
            continue
        factor = max(error, _LEAST) ** (1.0 / control[FALLS]) / SAFETY
        if error > 1.0:
            control[NEXT], rejected = size / min(factor, 1.0 / SHRINK), True
            continue
        grown = size / max(factor * control[BEFORE] ** -INTEGRAL, 1.0 / GROW)
        control[NEXT] = min(grown, size) if rejected else grown
        control[BEFORE] = max(error, 1e-4)  # Hairer's floor: a lucky step is no rule
        slope(motion, mode, c, t + h, workspace.end, p, which, workspace, workspace.last)
        return h


@helper
def accept_step(workspace):  # type: ignore[no-untyped-def]
    """Make the end of a step the start of the next one."""
    start, end, first, last = workspace.start, workspace.end, workspace.slopes, workspace.last
    for k in range(start.shape[0]):
        start[k] = end[k]
        first[0, k] = last[k]
    workspace.control[FRESH] = 0.0


@helper
def explicit(motion, mode, c, t, h, p, which, workspace):  # type: ignore[no-untyped-def]
    """Return the error of an explicit step (a method)."""
    explicit_step(motion, mode, c, t, h, p, which, workspace, workspace.end)
    return explicit_error(motion, h, workspace)


@helper
def explicit_probe(motion, mode, c, t, h, p, which, workspace):  # type: ignore[no-untyped-def]
    """Write the vector at t + h, within the last step, to ``workspace.trial``; tell whether it is known."""
    explicit_step(motion, mode, c, t, h, p, which, workspace, workspace.trial)
    return True
