"""The end of a generated module: motion along a mode, by numerical integration."""

from __future__ import annotations

from contfric.models.code import Lines
from contfric.models.description import Description

_IMPORTS = """
from contfric.flow.integrated import (
    integrated_flow,
    integrated_hit,
    integrated_motion,
    integrated_turning,
)
from contfric.flow.kinked import kinked_flow, kinked_hit, kinked_turning

MOTION = integrated_motion(
    field=field,
    observe=observe_at,
    rate=rate_at,
    period=period_at,
    scale=scale_of,
    method={method!r},
    relative={tolerance!r},
    absolute={tolerance!r},
    kinks={kinks},
    kink=kink_at,
)


@helper
def still(mode, t, y, p, which, out, jac):
    out[:] = 0.0
    jac[:] = 0.0


CLOCK = integrated_motion(
    field=still,
    observe=observe_at,
    rate=rate_at,
    period=period_at,
    scale=scale_of,
    relative={tolerance!r},
    absolute={tolerance!r},
)


@helper
def timed(c):
    return {timed}


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
        ${kind}_flow(MOTION, mode, t0, y0, dt, p, which, y1, jac)
        return
    n, rows = y0.shape[0], jac.shape[0]
    held, start = np.empty(n), np.empty((rows, jac.shape[1] - 1 if rows > 0 else 0))
    onto(mode, t0, y0, p, which, held, start)
    ${kind}_flow(MOTION, mode, t0, held, dt, p, which, y1, jac)
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
    if timed(c):
        at = integrated_hit(CLOCK, mode << KINKS, c, target, on, t0, y0, dt_max, p, y1)
        if at >= 0.0:
            none, nothing = np.empty(0, dtype=np.int64), np.empty((0, 0))
            ${kind}_flow(MOTION, mode, t0, y0, at, p, none, y1, nothing)
        return at
    return ${kind}_hit(MOTION, mode, c, target, on, t0, y0, dt_max, p, y1)


@kernel(turning_signature)
def turning(mode, c, t0, y0, dt, p, times, values):
    if idle(mode, c):
        return 0
    if timed(c):
        return integrated_turning(CLOCK, mode << KINKS, c, t0, y0, dt, p, times, values)
    return ${kind}_turning(MOTION, mode, c, t0, y0, dt, p, times, values)


def compiled_flow():
    """Return the compiled functions of this model."""
    return CompiledFlow(flow, observe, level, turning, hit, period, rate{reset})
'''


def piece_code(kinks: list[int]) -> str:
    """Return the helpers that tell the pieces of a mode apart (:mod:`contfric.flow.kinked`).

    Parameters
    ----------
    kinks : the observables that vanish at the kinks
    """
    code = Lines()
    code.add("", f"KINKS = {len(kinks)}", "", "", "@helper")
    code.open("def kink_at(k):")
    for k, c in enumerate(kinks[:-1]):
        code.add(f"if k == {k}:", f"    return {c}")
    code.add(f"return {kinks[-1] if kinks else 0}")
    code.close()
    code.add("", "", "@allocating_helper" if kinks else "@helper")
    code.open("def piece_of(mode, t, y, p):")
    code.add("piece = mode << KINKS")
    if kinks:
        code.add("none, empty = np.empty(0, dtype=np.int64), np.empty(0)")
    for k, c in enumerate(kinks):
        code.add(f"if observe_at({c}, t, y, p, none, empty) > 0.0:", f"    piece |= {1 << k}")
    code.add("return piece")
    code.close()
    return str(code)


def motion_code(description: Description, idle: list[tuple[int, int]], timed: list[int]) -> str:
    """Return the end of the module of a model.

    Parameters
    ----------
    idle : pairs (mode, observable) for which the observable never changes along the mode
    timed : observables of time alone: their zeros need no integration
    """
    sliding = [m for m, mode in enumerate(description.modes) if 0 in mode.sides.values()]
    head = _IMPORTS.format(
        method=description.method,
        tolerance=description.tolerance,
        idle=" or ".join(f"(mode == {m} and c == {c})" for m, c in idle) or "False",
        slides=" or ".join(f"mode == {m}" for m in sliding) or "False",
        timed=" or ".join(f"c == {c}" for c in timed) or "False",
        kinks=len(description.kinks),
    )
    kernels = _KERNELS.replace("${kind}", "kinked" if description.kinks else "integrated")
    return head + kernels.replace("{reset}", ", reset=reset" if description.resets else "")
