"""The end of a generated module: motion along a mode, in closed form or by numerical integration."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from contfric.models.code import Lines
from contfric.models.description import Description

_CLOSED = """
from contfric.flow.linear.flow import linear_flow
from contfric.flow.linear.motion import linear_motion
from contfric.flow.linear.search import linear_hit, linear_turning


@helper
def closed(mode):
    return {closed}


LINEAR = linear_motion(
    entries_count=ENTRIES,
    waves_count=WAVES,
    entries=entries,
    entries_seen=entries_seen,
    frequencies=frequencies,
    audible=audible,
    audible_seen=audible_seen,
    rates=rates,
    expand=expand,
    vary=vary,
    sums=sums,
    look=look,
    period=period_at,
    closed=closed,
)
"""

_INTEGRATED = """
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
    linear={linear},
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
"""

_HELPERS = """

@helper
def idle(mode, c):
    return {idle}


@helper
def slides(mode):
    return {slides}


@allocating_helper
def moved(mode, t0, y0, dt, p, which, y1, jac):
{moved}
"""

_KERNELS = '''
@kernel(flow_signature)
def flow(mode, t0, y0, dt, p, which, y1, jac):
    if not slides(mode):
        moved(mode, t0, y0, dt, p, which, y1, jac)
        return
    n, rows = y0.shape[0], jac.shape[0]
    held, start = np.empty(n), np.empty((rows, jac.shape[1] - 1 if rows > 0 else 0))
    onto(mode, t0, y0, p, which, held, start)
    moved(mode, t0, held, dt, p, which, y1, jac)
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
{hit}

@kernel(turning_signature)
def turning(mode, c, t0, y0, dt, p, times, values):
    if idle(mode, c):
        return 0
{turning}

def compiled_flow():
    """Return the compiled functions of this model."""
    return CompiledFlow(flow, observe, level, turning, hit, period, rate{reset})
'''

#: What each kernel does along a mode: in closed form, and by integration.
_MOVED = "linear_flow(LINEAR, mode, t0, y0, dt, p, which, y1, jac)"
_HIT = "return linear_hit(LINEAR, mode, c, target, on, t0, y0, dt_max, p, y1)"
_TURNING = "return linear_turning(LINEAR, mode, c, t0, y0, dt, p, times, values)"
_MOVED_ELSE = "{kind}_flow(MOTION, mode, t0, y0, dt, p, which, y1, jac)"
_HIT_ELSE = """\
if timed(c):
    at = integrated_hit(CLOCK, mode << KINKS, c, target, on, t0, y0, dt_max, p, y1)
    if at >= 0.0:
        none, nothing = np.empty(0, dtype=np.int64), np.empty((0, 0))
        moved(mode, t0, y0, at, p, none, y1, nothing)
    return at
return {kind}_hit(MOTION, mode, c, target, on, t0, y0, dt_max, p, y1)"""
_TURNING_ELSE = """\
if timed(c):
    return integrated_turning(CLOCK, mode << KINKS, c, t0, y0, dt, p, times, values)
return {kind}_turning(MOTION, mode, c, t0, y0, dt, p, times, values)"""


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


def motion_code(
    description: Description,
    idle: Sequence[tuple[int, int]],
    timed: Sequence[int],
    closed: Sequence[int],
    seen: Sequence[int],
) -> str:
    """Return the end of the module of a model.

    Parameters
    ----------
    idle : pairs (mode, observable) for which the observable never changes along the mode
    timed : observables of time alone: their zeros need no integration
    closed : pieces of modes that are affine
    seen : observables that are
    """
    kinks = len(description.kinks)
    # through kinks the closed form serves as a method of the integrator
    form = closed if kinks == 0 else ()
    pieces, observables = len(description.modes) << kinks, len(description.observables)
    both, every = len(form) < pieces, len(form) == pieces and len(seen) == observables
    sliding = [m for m, mode in enumerate(description.modes) if 0 in mode.sides.values()]
    kind = "kinked" if kinks else "integrated"
    in_form = _any("mode", form, pieces)
    known = " and ".join(x for x in (in_form, _any("c", seen, observables)) if x) or ""
    head = _CLOSED.format(closed=_any("mode", closed, pieces) or "True") if closed else ""
    if not every:
        head += _INTEGRATED.format(
            method=description.method,
            tolerance=description.tolerance,
            timed=_any("c", timed, -1),
            kinks=kinks,
            linear="LINEAR.members" if closed else "None",
        )
    head += _HELPERS.format(
        idle=" or ".join(f"(mode == {m} and c == {c})" for m, c in idle) or "False",
        slides=_any("mode", sliding, -1),
        moved=_either(form and _MOVED, both and _MOVED_ELSE.format(kind=kind), in_form),
    )
    return head + _KERNELS.format(
        hit=_either(form and _HIT, not every and _HIT_ELSE.format(kind=kind), known),
        turning=_either(form and _TURNING, not every and _TURNING_ELSE.format(kind=kind), known),
        reset=", reset=reset" if description.resets else "",
    )


def _any(name: str, values: Iterable[int], count: int) -> str:
    """Return the condition that a number is one of some; empty if it is one of ``count`` that all are."""
    found = [f"{name} == {i}" for i in values]
    return "" if len(found) == count else f"({' or '.join(found)})" if found else "False"


def _either(closed: str | object, integrated: str | object, condition: str) -> str:
    """Return the body of a kernel that has one of two ways, or both."""
    ways = [way for way in (closed, integrated) if isinstance(way, str) and way]
    code = Lines(depth=1)
    if len(ways) == 2:
        code.open(f"if {condition}:")
        code.add(*ways[0].splitlines())
        code.close()
        if not ways[0].startswith("return"):
            code.open("else:")
    code.add(*ways[-1].splitlines())
    return str(code)
