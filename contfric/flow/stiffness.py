"""Which method where: explicit as long as its steps are as long as accuracy allows, implicit beyond.

The spectral radius of the field's Jacobian, ``rho = |J^8|^(1/8)`` in the scales of the states, is known at
the start of each step. At the tolerances of this package an explicit step resolves what moves: it is far
below 1/rho. Where steps of more than 3/rho are accepted, the fast component does not move but follows the others,
and the next step is implicit. Back again where the implicit step is no longer worth its cost.
"""

from __future__ import annotations

from contfric.compiled import helper
from contfric.flow.dop853 import POWER
from contfric.flow.radau import IMPLICIT_STAGES, implicit_error, implicit_step
from contfric.flow.stepping import (
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

#: Steps times the spectral radius above which an explicit step is at its limit of stability (about 6).
_STIFF = 3.0
#: The same, below which an implicit step does not pay: it costs as much as eight explicit ones of 3/rho.
_MILD = 20.0
#: Implicit steps before that is judged (the step has to grow first), and explicit steps at the limit of stability
#: before the implicit method is tried again.
_TRIALS, _PATIENCE = 4.0, 12.0


@helper
def spectral_radius(room):  # type: ignore[no-untyped-def]
    """Return ``|J^8|^(1/8)`` of the local Jacobian in the scales of the states."""
    n, scales = room.scales.shape[0], room.scales
    one, two = room.small[0], room.small[1]
    for i in range(n):
        for j in range(n):
            one[i, j] = room.local[i, 1 + j] * scales[j] / scales[i]
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
def choose(motion, mode, t, h, p, room):  # type: ignore[no-untyped-def]
    """Evaluate the Jacobian at the start of a step and choose its method."""
    control, n = room.control, room.scales.shape[0]
    motion.field(mode, t, room.start[:n], p, room.none, room.stage[:n], room.local)
    control[FRESH] = 1.0
    if h < 0.0:
        return  # backwards in time what decays grows, and has to be followed
    stretch = control[NEXT] * spectral_radius(room)
    control[SINCE] += 1.0
    if control[KIND] == 0.0:
        control[LIMITED] = control[LIMITED] + 1.0 if stretch > _STIFF else 0.0
        if control[LIMITED] >= control[PATIENCE]:
            control[KIND], control[FALLS], control[SINCE] = 1.0, IMPLICIT_STAGES + 1.0, 0.0
            control[REMEMBERED] = 0.0
    elif stretch < _MILD and control[SINCE] > _TRIALS:
        control[KIND], control[FALLS], control[LIMITED] = 0.0, POWER, 0.0
        control[PATIENCE] = _PATIENCE
        control[NEXT] *= min(1.0, _STIFF / stretch)


@helper
def implicit(motion, mode, c, t, h, p, which, room):  # type: ignore[no-untyped-def]
    """Return the error of an implicit step (a method)."""
    control, n = room.control, room.scales.shape[0]
    if control[FRESH] == 0.0:
        motion.field(mode, t, room.start[:n], p, room.none, room.stage[:n], room.local)
        control[FRESH], control[FALLS] = 1.0, IMPLICIT_STAGES + 1.0
    return implicit_trial(motion, mode, c, t, h, p, which, room)


@helper
def implicit_trial(motion, mode, c, t, h, p, which, room):  # type: ignore[no-untyped-def]
    """Try an implicit step; return its error."""
    if not implicit_step(motion, mode, c, t, h, p, which, room, room.end, False):
        room.control[REMEMBERED] = 0.0  # a bad prediction is not used again
        return float("inf")
    error = implicit_error(motion, mode, c, t, h, p, room)
    if error <= 1.0:
        s, n = room.increments.shape
        for i in range(s):
            for k in range(n):
                room.memory[i, k] = room.increments[i, k]
        room.control[REMEMBERED] = h
    return error


@helper
def implicit_probe(motion, mode, c, t, h, p, which, room):  # type: ignore[no-untyped-def]
    """Write the vector at t + h, within the last step, to ``room.trial``; tell whether it is known."""
    return implicit_step(motion, mode, c, t, h, p, which, room, room.trial, True)


@helper
def automatic(motion, mode, c, t, h, p, which, room):  # type: ignore[no-untyped-def]
    """Return the error of a step by the method that suits the place (a method)."""
    if room.control[FRESH] == 0.0:
        choose(motion, mode, t, h, p, room)
    if room.control[KIND] == 0.0:
        return explicit(motion, mode, c, t, h, p, which, room)
    return implicit_trial(motion, mode, c, t, h, p, which, room)


@helper
def automatic_probe(motion, mode, c, t, h, p, which, room):  # type: ignore[no-untyped-def]
    """Write the vector at t + h, within the last step, to ``room.trial``; tell whether it is known."""
    if room.control[KIND] == 0.0:
        return explicit_probe(motion, mode, c, t, h, p, which, room)
    return implicit_probe(motion, mode, c, t, h, p, which, room)
