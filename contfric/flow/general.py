"""The flow of any model from its functions: three kernels for each method, compiled once for all models.

A mode moves by its closed form where it is affine (:mod:`contfric.flow.linear`), else by integration
(:mod:`contfric.flow.kinked`). A mode that slides starts on its surfaces: what is moved is the state put
onto them, so that derivatives are multiplied by those of that projection. The zeros of what depends on
time alone are sought along a motion at rest: they need no integration.
"""

from __future__ import annotations

from enum import Enum
from functools import cache
from typing import Any

import numpy as np

from contfric.compiled import (
    Kernel,
    allocating_helper,
    field_signature,
    flow_signature,
    hit_signature,
    kernel,
    turning_signature,
)
from contfric.flow.kinked import kinked_flow, kinked_hit, kinked_turning
from contfric.flow.layouts import MODEL
from contfric.flow.linear.flow import linear_flow
from contfric.flow.linear.method import explicit_or_linear, explicit_or_linear_probe
from contfric.flow.linear.search import linear_hit, linear_turning
from contfric.flow.radau import IMPLICIT_STAGES
from contfric.flow.stepping import explicit, explicit_probe
from contfric.flow.stiffness import automatic, automatic_probe, implicit, implicit_probe
from contfric.handle import HandleType, with_handle


@allocating_helper
def stepped(motion, mode, t0, y0, dt, p, which, y1, jac):  # type: ignore[no-untyped-def]
    """Move a state by integration."""
    kinked_flow(motion, mode, t0, y0, dt, p, which, y1, jac)


@allocating_helper
def stepped_hit(motion, mode, c, target, on, t0, y0, dt_max, p, y1):  # type: ignore[no-untyped-def]
    """Find the first hit along an integrated motion."""
    if motion.timed[c] == 0:
        return kinked_hit(motion, mode, c, target, on, t0, y0, dt_max, p, y1)
    piece = mode << motion.kinks
    at = kinked_hit(motion.clock, piece, c, target, on, t0, y0, dt_max, p, y1)
    if at >= 0.0:
        none, nothing = np.empty(0, dtype=np.int64), np.empty((0, 0))
        motion.moved(motion, mode, t0, y0, at, p, none, y1, nothing)
    return at


@allocating_helper
def stepped_turning(motion, mode, c, t0, y0, dt, p, times, values):  # type: ignore[no-untyped-def]
    """Find the stationary points along an integrated motion."""
    if motion.timed[c] == 0:
        return kinked_turning(motion, mode, c, t0, y0, dt, p, times, values)
    piece = mode << motion.kinks
    return kinked_turning(motion.clock, piece, c, t0, y0, dt, p, times, values)


@allocating_helper
def either(motion, mode, t0, y0, dt, p, which, y1, jac):  # type: ignore[no-untyped-def]
    """Move a state in closed form where the mode is affine; through kinks that is a method of integration."""
    if motion.kinks == 0 and motion.closed[mode] != 0:
        linear_flow(motion, mode, t0, y0, dt, p, which, y1, jac)
    else:
        kinked_flow(motion, mode, t0, y0, dt, p, which, y1, jac)


@allocating_helper
def either_hit(motion, mode, c, target, on, t0, y0, dt_max, p, y1):  # type: ignore[no-untyped-def]
    """Find the first hit along a motion of either kind."""
    if motion.kinks == 0 and motion.closed[mode] != 0 and motion.seen[c] != 0:
        return linear_hit(motion, mode, c, target, on, t0, y0, dt_max, p, y1)
    return stepped_hit(motion, mode, c, target, on, t0, y0, dt_max, p, y1)


@allocating_helper
def either_turning(motion, mode, c, t0, y0, dt, p, times, values):  # type: ignore[no-untyped-def]
    """Find the stationary points along a motion of either kind."""
    if motion.kinks == 0 and motion.closed[mode] != 0 and motion.seen[c] != 0:
        return linear_turning(motion, mode, c, t0, y0, dt, p, times, values)
    return stepped_turning(motion, mode, c, t0, y0, dt, p, times, values)


def flow(motion, mode, t0, y0, dt, p, which, y1, jac):  # type: ignore[no-untyped-def]
    """Advance a state by ``dt``, with derivatives where ``jac`` has room (``flow_signature``)."""
    if motion.slides[mode] == 0:
        motion.moved(motion, mode, t0, y0, dt, p, which, y1, jac)
        return
    n, rows = y0.shape[0], jac.shape[0]
    held, start = np.empty(n), np.empty((rows, jac.shape[1] - 1 if rows > 0 else 0))
    motion.onto(mode, t0, y0, p, which, held, start)
    motion.moved(motion, mode, t0, held, dt, p, which, y1, jac)
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


def hit(motion, mode, c, target, on, t0, y0, dt_max, p, y1):  # type: ignore[no-untyped-def]
    """Return the first time at which an observable takes a value (``hit_signature``)."""
    if motion.idle[mode * motion.observables + c] != 0:
        return -1.0
    return motion.first(motion, mode, c, target, on, t0, y0, dt_max, p, y1)


def turning(motion, mode, c, t0, y0, dt, p, times, values):  # type: ignore[no-untyped-def]
    """Write the stationary points of an observable and return their number (``turning_signature``)."""
    if motion.idle[mode * motion.observables + c] != 0:
        return 0
    return motion.turnings(motion, mode, c, t0, y0, dt, p, times, values)


@kernel(field_signature)
def still(mode, t, y, p, which, out, jac):  # type: ignore[no-untyped-def]
    """Return no motion: the field of a clock."""
    for i in range(out.shape[0]):
        out[i] = 0.0
    for i in range(jac.shape[0]):
        for j in range(jac.shape[1]):
            jac[i, j] = 0.0


class Solver(str, Enum):
    """How the motions of a model are found."""

    EXPLICIT = "explicit"
    IMPLICIT = "implicit"
    AUTOMATIC = "automatic"
    CLOSED_FORM = "closed form"
    MIXED = "mixed"


_STEPPED = {"moved": stepped, "first": stepped_hit, "turnings": stepped_turning}
_MEMBERS: dict[Solver, dict[str, Any]] = {
    Solver.EXPLICIT: {"attempt": explicit, "probe": explicit_probe, "stages": 0, **_STEPPED},
    Solver.IMPLICIT: {
        "attempt": implicit, "probe": implicit_probe, "stages": IMPLICIT_STAGES, **_STEPPED
    },
    Solver.AUTOMATIC: {
        "attempt": automatic, "probe": automatic_probe, "stages": IMPLICIT_STAGES, **_STEPPED
    },
    Solver.CLOSED_FORM: {"moved": linear_flow, "first": linear_hit, "turnings": linear_turning},
    Solver.MIXED: {
        "attempt": explicit_or_linear,
        "probe": explicit_or_linear_probe,
        "stages": 0,
        "moved": either,
        "first": either_hit,
        "turnings": either_turning,
    },
}  # fmt: skip


@cache
def handle_of(solver: Solver) -> HandleType:
    """Return the type of handles of models that are solved in one way."""
    return HandleType(solver.value.replace(" ", "_"), MODEL, _MEMBERS[solver])


@cache
def kernels_of(solver: Solver) -> tuple[Kernel, Kernel, Kernel]:
    """Return the kernels ``flow``, ``hit`` and ``turning`` of one way."""
    handle, label = handle_of(solver), f"-{solver.value.replace(' ', '-')}"
    return (
        Kernel(flow, with_handle(flow_signature, handle), label),
        Kernel(hit, with_handle(hit_signature, handle), label),
        Kernel(turning, with_handle(turning_signature, handle), label),
    )
