"""Which method where: explicit, implicit, or whichever is cheaper at the place.

The spectral radius of the field's Jacobian, ``rho = |J^8|^(1/8)`` in the scales of the states, is known
at the start of each step. What oscillates with rho is resolved by explicit steps of 0.15/rho at a
tolerance of 1e-12. Where something decays with rho that no longer moves by itself (it is slaved to the
others), accuracy would allow far longer steps; but long before the limit of stability (6/rho) the stages
lose their order, and steps stay at 0.2/rho to 3/rho. An implicit step costs about as much as seven
explicit ones. So

* explicit steps that stay above 0.25/rho for a while are followed by implicit ones;
* implicit steps that do not become longer than 1/rho are followed by explicit ones, and the next trial
  waits four times as long.

All these lengths grow with the tolerance like the steps, with its eighth root.
"""

from __future__ import annotations

from contfric.compiled import helper
from contfric.flow.integration.dop853 import POWER
from contfric.flow.integration.radau import IMPLICIT_STAGES, implicit_error, implicit_step
from contfric.flow.integration.stepping import (
    FALLS,
    FRESH,
    KIND,
    LIMITED,
    NEXT,
    PATIENCE,
    REMEMBERED,
    SINCE,
    explicit,
    explicit_probe,
)

#: Explicit steps above this over the spectral radius may be held back by what decays; at a tolerance of
#: 1e-12.
_HELD_BACK = 0.17
#: Implicit steps below this over the spectral radius do not pay; at a tolerance of 1e-12.
_MILD = 1.0
#: How many explicit steps in a row are held back before an implicit one is tried, how much longer that
#: one is, how many steps it gets to grow, and by how much patience grows after a trial that did not pay.
_PATIENCE, _LONGER, _TRIALS, _GROWTH = 5.0, 4.0, 4.0, 4.0


@helper
def spectral_radius(workspace):  # type: ignore[no-untyped-def]
    """Return ``|J^8|^(1/8)`` of the local Jacobian in the scales of the states."""
    n, scales = workspace.scales.shape[0], workspace.scales
    one, two = workspace.small[0], workspace.small[1]
    for i in range(n):
        for j in range(n):
            one[i, j] = workspace.local[i, 1 + j] * scales[j] / scales[i]
    for _ in range(3):
        for i in range(n):
            for j in range(n):
                value = 0.0
                for k in range(n):
                    value += one[i, k] * one[k, j]
                two[i, j] = value
        one, two = two, one
    largest = 0.0
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += abs(one[i, j])
        largest = max(largest, total)
    return largest**0.125


@helper
def choose(motion, mode, t, h, p, workspace):  # type: ignore[no-untyped-def]
    """Evaluate the Jacobian at the start of a step and choose its method, where there is a choice."""
    control, n = workspace.control, workspace.scales.shape[0]
    motion.field(
        mode, t, workspace.start[:n], p, workspace.none, workspace.stage[:n], workspace.local
    )
    control[FRESH] = 1.0
    if motion.implicit != 0:
        control[KIND], control[FALLS] = 1.0, IMPLICIT_STAGES + 1.0
        return
    if h < 0.0:
        return  # backwards in time what decays grows, and has to be followed
    radius = spectral_radius(workspace) / motion.looseness
    stretch = control[NEXT] * radius
    control[SINCE] += 1.0
    if control[KIND] == 0.0:
        control[LIMITED] = control[LIMITED] + 1.0 if stretch > _HELD_BACK else 0.0
        if control[LIMITED] >= _PATIENCE * control[PATIENCE]:
            control[KIND], control[FALLS], control[SINCE] = 1.0, IMPLICIT_STAGES + 1.0, 0.0
            control[REMEMBERED] = 0.0
            control[NEXT] *= _LONGER
    elif stretch < _MILD and control[SINCE] >= _TRIALS:
        control[KIND], control[FALLS], control[LIMITED] = 0.0, POWER, 0.0
        control[PATIENCE] = _GROWTH * control[PATIENCE] if control[SINCE] == _TRIALS else 1.0
        control[NEXT] = min(control[NEXT], _HELD_BACK / radius)


@helper
def implicit_trial(motion, mode, c, t, h, p, which, workspace):  # type: ignore[no-untyped-def]
    """Try an implicit step; return its error."""
    if not implicit_step(motion, mode, c, t, h, p, which, workspace, workspace.end, False):
        workspace.control[REMEMBERED] = 0.0  # a bad prediction is not used again
        return float("inf")
    error = implicit_error(motion, mode, c, t, h, p, workspace)
    if error <= 1.0:
        s, n = workspace.increments.shape
        for i in range(s):
            for k in range(n):
                workspace.memory[i, k] = workspace.increments[i, k]
        workspace.control[REMEMBERED] = h
    return error


@helper
def implicit_probe(motion, mode, c, t, h, p, which, workspace):  # type: ignore[no-untyped-def]
    """Write the vector at t + h, within the last step, to ``workspace.trial``; tell whether it is known."""
    return implicit_step(motion, mode, c, t, h, p, which, workspace, workspace.trial, True)


@helper
def automatic(motion, mode, c, t, h, p, which, workspace):  # type: ignore[no-untyped-def]
    """Return the error of a step by the method that suits the place (a method)."""
    if workspace.control[FRESH] == 0.0:
        choose(motion, mode, t, h, p, workspace)
    if workspace.control[KIND] == 0.0:
        return explicit(motion, mode, c, t, h, p, which, workspace)
    return implicit_trial(motion, mode, c, t, h, p, which, workspace)


@helper
def automatic_probe(motion, mode, c, t, h, p, which, workspace):  # type: ignore[no-untyped-def]
    """Write the vector at t + h, within the last step, to ``workspace.trial``; tell whether it is known."""
    if workspace.control[KIND] == 0.0:
        return explicit_probe(motion, mode, c, t, h, p, which, workspace)
    return implicit_probe(motion, mode, c, t, h, p, which, workspace)
