"""The flow of any model from its functions: three kernels for each kind, compiled once for all models.

A mode moves by its closed form where it is affine (:mod:`contfric.flow.linear`), else by integration
(:mod:`contfric.flow.integration.kinked`). A mode that slides starts on its surfaces: what is moved is the
state put onto them, so that derivatives are multiplied by those of that projection. The zeros of what
depends on time alone are sought along a solution at rest: they need no integration.
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
    helper,
    hit_signature,
    kernel,
    stationary_signature,
)
from contfric.flow.integration.kinked import kinked_flow, kinked_hit, kinked_stationary
from contfric.flow.integration.radau import IMPLICIT_STAGES
from contfric.flow.integration.stiffness import automatic, automatic_probe
from contfric.flow.layouts import MODEL
from contfric.flow.linear.flow import linear_flow
from contfric.flow.linear.hits import linear_hit
from contfric.flow.linear.method import explicit_or_linear, explicit_or_linear_probe
from contfric.flow.linear.stationary import linear_stationary
from contfric.handle import HandleType, with_handle


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
def stepped_stationary(motion, mode, c, t0, y0, dt, p, times, values):  # type: ignore[no-untyped-def]
    """Find the stationary points along an integrated motion."""
    if motion.timed[c] == 0:
        return kinked_stationary(motion, mode, c, t0, y0, dt, p, times, values)
    piece = mode << motion.kinks
    return kinked_stationary(motion.clock, piece, c, t0, y0, dt, p, times, values)


@helper
def in_closed_form(motion, mode):  # type: ignore[no-untyped-def]
    """Tell whether a mode moves by its closed form alone; through kinks that is a method of integration."""
    return motion.kinks == 0 and motion.closed[mode] != 0


@allocating_helper
def either(motion, mode, t0, y0, dt, p, which, y1, jac):  # type: ignore[no-untyped-def]
    """Move a state in closed form where the mode is affine, else by integration."""
    if in_closed_form(motion, mode):
        linear_flow(motion, mode, t0, y0, dt, p, which, y1, jac)
    else:
        kinked_flow(motion, mode, t0, y0, dt, p, which, y1, jac)


@allocating_helper
def either_hit(motion, mode, c, target, on, t0, y0, dt_max, p, y1):  # type: ignore[no-untyped-def]
    """Find the first hit along a solution of either kind."""
    if in_closed_form(motion, mode) and motion.seen[c] != 0:
        return linear_hit(motion, mode, c, target, on, t0, y0, dt_max, p, y1)
    return stepped_hit(motion, mode, c, target, on, t0, y0, dt_max, p, y1)


@allocating_helper
def either_stationary(motion, mode, c, t0, y0, dt, p, times, values):  # type: ignore[no-untyped-def]
    """Find the stationary points along a solution of either kind."""
    if in_closed_form(motion, mode) and motion.seen[c] != 0:
        return linear_stationary(motion, mode, c, t0, y0, dt, p, times, values)
    return stepped_stationary(motion, mode, c, t0, y0, dt, p, times, values)


@allocating_helper
def through_projection(jac, start, n):  # type: ignore[no-untyped-def]
    """Multiply the derivatives of a flow by those of the projection before it.

    A projection leaves most states as they are: the rows of these are those of the identity.
    """
    row, kept = np.empty(n), np.empty(n)
    for k in range(n):
        others = 0.0
        for j in range(start.shape[1]):
            others += abs(start[k, j])
        kept[k] = 1.0 if others == 1.0 and start[k, 1 + k] == 1.0 else 0.0
    for i in range(n):
        for k in range(n):
            row[k] = jac[i, 1 + k]
            jac[i, 1 + k] = row[k] if kept[k] != 0.0 else 0.0
        for k in range(n):
            if kept[k] != 0.0:
                continue
            for j in range(start.shape[1]):  # the column of the duration is between these
                jac[i, j if j <= n else j + 1] += row[k] * start[k, j]


def flow(motion, mode, t0, y0, dt, p, which, y1, jac):  # type: ignore[no-untyped-def]
    """Advance a state by ``dt``, with derivatives where ``jac`` has space (``flow_signature``)."""
    if motion.slides[mode] == 0:
        motion.moved(motion, mode, t0, y0, dt, p, which, y1, jac)
        return
    n, rows = y0.shape[0], jac.shape[0]
    held, start = np.empty(n), np.empty((rows, jac.shape[1] - 1 if rows > 0 else 0))
    motion.onto(mode, t0, y0, p, which, held, start)
    motion.moved(motion, mode, t0, held, dt, p, which, y1, jac)
    if rows > 0:
        through_projection(jac, start, n)


def hit(motion, mode, c, target, on, t0, y0, dt_max, p, y1):  # type: ignore[no-untyped-def]
    """Return the first time at which an observable takes a value (``hit_signature``)."""
    if motion.idle[mode * motion.observables + c] != 0:
        return -1.0
    return motion.first(motion, mode, c, target, on, t0, y0, dt_max, p, y1)


def stationary(motion, mode, c, t0, y0, dt, p, times, values):  # type: ignore[no-untyped-def]
    """Write the stationary points of an observable and return their number (``stationary_signature``)."""
    if motion.idle[mode * motion.observables + c] != 0:
        return 0
    return motion.stationary(motion, mode, c, t0, y0, dt, p, times, values)


@kernel(field_signature, counts=False)
def still(mode, t, y, p, which, out, jac):  # type: ignore[no-untyped-def]
    """Return no solution: the field of a clock."""
    for i in range(out.shape[0]):
        out[i] = 0.0
    for i in range(jac.shape[0]):
        for j in range(jac.shape[1]):
            jac[i, j] = 0.0


class FlowKind(str, Enum):
    """Which methods a model's solutions are found by: each kind has kernels of its own."""

    PLAIN = "plain"  # steps of the explicit method, and the closed form
    STIFF = "stiff"  # steps of either method, chosen on the way or always implicit


_MEMBERS: dict[FlowKind, dict[str, Any]] = {
    FlowKind.PLAIN: {
        "attempt": explicit_or_linear,
        "probe": explicit_or_linear_probe,
        "stages": 0,
        "moved": either,
        "first": either_hit,
        "stationary": either_stationary,
    },
    FlowKind.STIFF: {
        "attempt": automatic,
        "probe": automatic_probe,
        "stages": IMPLICIT_STAGES,
        "moved": kinked_flow,
        "first": stepped_hit,
        "stationary": stepped_stationary,
    },
}


@cache
def handle_of(kind: FlowKind) -> HandleType:
    """Return the type of handles of models of one kind."""
    return HandleType(kind.value, MODEL, _MEMBERS[kind])


@cache
def kernels_of(kind: FlowKind) -> tuple[Kernel, Kernel, Kernel]:
    """Return the kernels ``flow``, ``hit`` and ``stationary`` of one kind."""
    handle, label = handle_of(kind), f"-{kind.value}"
    return (
        Kernel(flow, with_handle(flow_signature, handle), label),
        Kernel(hit, with_handle(hit_signature, handle), label),
        Kernel(stationary, with_handle(stationary_signature, handle), label),
    )
