"""The state after a reset in which a segment begins, and derivatives by the chain rule, compiled."""

from __future__ import annotations

from contfric.compiled import helper


@helper
def apply_reset(functions, layout, i, start, p, which, workspace):  # type: ignore[no-untyped-def]
    """Write the state in which segment i begins, after its reset, with the derivatives if any are wanted.

    Only for a segment that has one: elsewhere its joint is where it begins.
    """
    n, after_reset = start.shape[0] - 1, workspace.after_reset
    functions.reset(
        layout.resets[i], start[0], start[1:], p, which, after_reset[n, :n], after_reset[:n]
    )


@helper
def through_reset(jac, reset, row, n):  # type: ignore[no-untyped-def]
    """Make the derivatives of a flow after a reset those with respect to the joint before it."""
    for j in range(n):
        for k in range(n):
            row[k] = jac[j, 1 + k]
            jac[j, 1 + k] = 0.0
        for k in range(n):
            jac[j, 0] += row[k] * reset[k, 0]
            for a in range(n):
                jac[j, 1 + a] += row[k] * reset[k, 1 + a]
            for a in range(n + 1, reset.shape[1]):
                jac[j, 1 + a] += row[k] * reset[k, a]
