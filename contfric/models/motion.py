"""The end of a generated module: motion along a mode, by numerical integration."""

from __future__ import annotations

from contfric.models.description import Description

_IMPORTS = """
import numpy as np

from contfric.flow.integrated import (
    integrated_flow,
    integrated_hit,
    integrated_motion,
    integrated_turning,
)

MOTION = integrated_motion(
    field=field,
    observe=observe_at,
    rate=rate_at,
    period=period_at,
    scale=scale_of,
    method={method!r},
    relative={tolerance!r},
    absolute={tolerance!r},
)


@helper
def idle(mode, c):
    return {idle}


@helper
def slides(mode):
    return {slides}

"""

_KERNELS = '''
@kernel(flow_signature)
def flow(mode, t0, y0, dt, p, which, y1, jac):
    if not slides(mode):
        integrated_flow(MOTION, mode, t0, y0, dt, p, which, y1, jac)
        return
    n, rows = y0.shape[0], jac.shape[0]
    held, start = np.empty(n), np.empty((rows, jac.shape[1] - 1 if rows > 0 else 0))
    onto(mode, t0, y0, p, which, held, start)
    integrated_flow(MOTION, mode, t0, held, dt, p, which, y1, jac)
    for i in range(rows):
        row = jac[i, 1 : 1 + n].copy()
        for j in range(1 + n):
            by = jac[i, 0] if j == 0 else 0.0
            for k in range(n):
                by += row[k] * start[k, j]
            jac[i, j] = by
        for j in range(which.shape[0]):
            for k in range(n):
                jac[i, 2 + n + j] += row[k] * start[k, 1 + n + j]


@kernel(hit_signature)
def hit(mode, c, target, on, t0, y0, dt_max, p, y1):
    if idle(mode, c):
        return -1.0
    return integrated_hit(MOTION, mode, c, target, on, t0, y0, dt_max, p, y1)


@kernel(turning_signature)
def turning(mode, c, t0, y0, dt, p, times, values):
    if idle(mode, c):
        return 0
    return integrated_turning(MOTION, mode, c, t0, y0, dt, p, times, values)


def compiled_flow():
    """Return the compiled functions of this model."""
    return CompiledFlow(flow, observe, level, turning, hit, period, rate{reset})
'''


def motion_code(description: Description, idle: list[tuple[int, int]]) -> str:
    """Return the end of the module of a model.

    Parameters
    ----------
    idle : pairs (mode, observable) for which the observable never changes along the mode
    """
    sliding = [m for m, mode in enumerate(description.modes) if 0 in mode.sides.values()]
    head = _IMPORTS.format(
        method=description.method,
        tolerance=description.tolerance,
        idle=" or ".join(f"(mode == {m} and c == {c})" for m, c in idle) or "False",
        slides=" or ".join(f"mode == {m}" for m in sliding) or "False",
    )
    return head + _KERNELS.replace("{reset}", ", reset=reset" if description.resets else "")
