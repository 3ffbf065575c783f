"""Placeholders of functions that a flow does not have, or that are not needed."""

from __future__ import annotations

from contfric.compiled import kernel, second_signature, stationary_signature, together_signature


@kernel(second_signature, counts=False)
def no_second(mode, c, t0, y0, d, p, which, along, jac, workspace):  # type: ignore[no-untyped-def]
    """Say that there are no second derivatives: the engine takes differences of the first ones."""
    return 0


@kernel(stationary_signature, counts=False)
def no_stationary(mode, c, t0, y0, dt, p, times, values):  # type: ignore[no-untyped-def]
    """Say that the search failed: motion is only followed, and who asks is mistaken."""
    return -1


#: What stands for a surface where the first one that is met is to be asked for motion by motion.
SINGLY = -2


@kernel(together_signature, counts=False)
def no_together(count, modes, on, times, states, p, longest, tau, surfaces, ends, jac):  # type: ignore[no-untyped-def]
    """Say that each solution is to be asked for by itself."""
    for k in range(count):
        surfaces[k] = SINGLY
