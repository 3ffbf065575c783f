"""An observable along a step: nodes of the solution itself, as dense as they are needed.

The observable goes with the state as one more component, so that the steps resolve it. At a node q, q'
and q'' are known (the second derivative from the gradient of the rate). The nodes at the ends of a step
certify almost every step as free of roots, or isolate one (:mod:`contfric.flow.integration.panels`). Where
they do not, the step is bisected by a *probe*: a step from the start of the step to the place. This dense
output is as accurate as the integration, and a root that it finds is a root of the motion.
"""

from __future__ import annotations

import math

from contfric.compiled import helper
from contfric.flow.integration.stepping import first_step
from contfric.flow.integration.variations import begin

#: Rates at the start below this, relative to 1 + the next one, are rounding.
AT_START = 1e-13
#: A panel of less than this share of its step is not divided further: a double root differs from a near
#: miss by its square, which is rounding.
SHORTEST = 1e-7
#: Most probes in a step: a regular one needs none to ten, each double root about 25 more.
MOST_PROBES = 2000


@helper
def node(motion, mode, c, target, t, y, f, p, workspace):  # type: ignore[no-untyped-def]
    """Return q less the target, q' and q'' at a state with its slope f."""
    grad, n = workspace.grad, workspace.scales.shape[0]
    q = motion.observe(c, t, y[:n], p, workspace.none, workspace.empty) - target
    q1 = motion.rate(mode, c, t, y[:n], p, workspace.none, grad)
    q2 = grad[0]
    for j in range(n):
        q2 += grad[1 + j] * f[j]
    return q, q1, q2


@helper
def probed(motion, mode, c, target, t, at, p, workspace):  # type: ignore[no-untyped-def]
    """Return q less the target, q' and q'' within the last step, which started at time t.

    The state and its slope are left in ``workspace.trial`` and ``workspace.stage``.
    """
    n = workspace.scales.shape[0]
    if not motion.probe(motion, mode, c, t, at, p, workspace.none, workspace):
        return math.nan, math.nan, math.nan
    motion.field(
        mode, t + at, workspace.trial[:n], p, workspace.none, workspace.stage[:n], workspace.nothing
    )
    return node(motion, mode, c, target, t + at, workspace.trial, workspace.stage, p, workspace)


@helper
def is_flat(left, right, h):  # type: ignore[no-untyped-def]
    """Tell whether an observable keeps its value along a step: a solution on the surface itself."""
    size = SHORTEST * SHORTEST * (1.0 + abs(left[0]))
    return (
        abs(right[0] - left[0]) <= size
        and max(abs(left[1]), abs(right[1])) * h <= size
        and max(abs(left[2]), abs(right[2])) * h * h <= size
    )


@helper
def start_search(motion, mode, c, target, t0, y0, left, p, workspace):  # type: ignore[no-untyped-def]
    """Begin the integration of state and observable; return the node at the start."""
    n = y0.shape[0]
    begin(motion, y0, p, workspace.none, workspace)
    workspace.start[n] = motion.observe(c, t0, y0, p, workspace.none, workspace.grad)
    size = 0.0
    for j in range(n):
        size += abs(workspace.grad[1 + j]) * workspace.scales[j]
    # what depends on time alone has the scale 1
    workspace.allowed[n] = motion.absolute * (size if size > 0.0 else 1.0)
    first_step(motion, mode, c, t0, left, p, workspace.none, workspace)
    return node(motion, mode, c, target, t0, workspace.start, workspace.slopes[0], p, workspace)


@helper
def write(source, target):  # type: ignore[no-untyped-def]
    """Copy a state."""
    for k in range(target.shape[0]):
        target[k] = source[k]


@helper
def push(nodes, depth, at, values):  # type: ignore[no-untyped-def]
    """Put a node (time, q, q', q'') on the stack; return its new depth."""
    nodes[depth, 0] = at
    nodes[depth, 1], nodes[depth, 2], nodes[depth, 3] = values
    return depth + 1


@helper
def top(nodes, depth):  # type: ignore[no-untyped-def]
    """Return the time of the last node on the stack, and its (q, q', q'')."""
    return nodes[depth - 1, 0], (nodes[depth - 1, 1], nodes[depth - 1, 2], nodes[depth - 1, 3])
