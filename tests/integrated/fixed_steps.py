"""Both methods with steps of fixed length, to see their order."""

from __future__ import annotations

from catalogue import FUNCTIONS

from contfric.compiled import allocating_helper, f8, i8, indices, kernel, types, vector
from contfric.flow.general import FlowKind, handle_of
from contfric.flow.integration.dop853 import STAGES, explicit_step
from contfric.flow.integration.radau import IMPLICIT_STAGES, implicit_step
from contfric.flow.integration.stepping import accept_step
from contfric.flow.integration.variations import begin, integration_workspace, slope
from contfric.handle import Bound


@allocating_helper
def march(motion, implicit, mode, y0, dt, steps, p, which, out):
    """Write state and variations after equal steps; what they are integrated with does not matter."""
    n = y0.shape[0]
    workspace = integration_workspace(n, 0, 1 + n + which.shape[0], STAGES, IMPLICIT_STAGES)
    begin(motion, y0, p, which, workspace)
    h = dt / steps
    for i in range(steps):
        t = i * h
        slope(motion, mode, -1, t, workspace.start, p, which, workspace, workspace.slopes[0])
        if implicit:
            implicit_step(motion, mode, -1, t, h, p, which, workspace, workspace.end, False)
        else:
            explicit_step(motion, mode, -1, t, h, p, which, workspace, workspace.end)
        accept_step(workspace)
    for k in range(out.shape[0]):
        out[k] = workspace.start[k]


@kernel(
    types.void(
        handle_of(FlowKind.PLAIN), types.boolean, i8, vector, f8, i8, vector, indices, vector
    )
)
def fixed_steps_of(motion, implicit, mode, y0, dt, steps, p, which, out):
    march(motion, implicit, mode, y0, dt, steps, p, which, out)


fixed_steps = Bound(fixed_steps_of, FUNCTIONS.block)
