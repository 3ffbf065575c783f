"""Flow by numerical integration: the seven functions of a model from its fields.

To write a model whose motion is integrated, write a module with these helpers (decorated with
:func:`contfric.compiled.helper`: they must not allocate). There are n states; ``which`` lists the m
parameters that are differentiated by; whatever has no room (an array of length 0) is not filled.

1. ``field(mode, t, y, p, which, out, jac)``: write dy/dt to ``out`` (n,) and, if ``jac`` (n, 1 + n + m)
   has rows, its derivatives by t, y and ``p[which]``. A mode is one smooth field: it is evaluated a
   little beyond the surfaces that bound it, so that ``|v|`` is ``v`` in the mode with v > 0, and not
   ``abs(v)``.
2. ``observe(c, t, y, p, which, grad)``: return observable c; its derivatives to ``grad`` (1 + n + m,).
3. ``rate(mode, c, t, y, p, which, grad)``: return the rate of observable c along a mode; the same
   gradient.
4. ``period(p, which, grad)``: return the period of the excitation, 0 if there is none; ``grad`` (m,).
   The field and the observables must have this period.
5. ``scale(i, p)``: return the natural size of state i, the unit of its absolute tolerance. A state that
   is multiplied by a stiffness of 1000 in the field has the scale 1/1000.
6. ``side(mode, c)``, if a mode lives on one side of a level of observable c that its segments start on:
   return 1 above it, -1 below it, 0 otherwise. A start that leaves to the other side hits at once.

Then bundle them, and write the kernels::

    MOTION = integrated_motion(field=field, observe=observe, rate=rate, period=period, scale=scale)

    @kernel(flow_signature)
    def flow(mode, t0, y0, dt, p, which, y1, jac):
        integrated_flow(MOTION, mode, t0, y0, dt, p, which, y1, jac)

    @kernel(hit_signature)
    def hit(mode, c, target, on, t0, y0, dt_max, p, y1):
        return integrated_hit(MOTION, mode, c, target, on, t0, y0, dt_max, p, y1)

    @kernel(turning_signature)
    def turning(mode, c, t0, y0, dt, p, times, values):
        return integrated_turning(MOTION, mode, c, t0, y0, dt, p, times, values)

The four other kernels (``observe``, ``level``, ``period``, ``rate``) call their helpers, and
``CompiledFlow(flow, observe, level, turning, hit, period, rate)`` is the flow. A helper and a kernel
need different names. ``tests/integrated`` has such modules written by hand.

What breaks down (a state beyond all numbers, too many steps, a field that is no number) is handed back
as states that are no numbers, and as -1 stationary points; the engine says so.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from enum import Enum
from typing import Any

import numpy as np

from contfric.compiled import allocating_helper, helper
from contfric.flow.bundle import Bundle
from contfric.flow.dop853 import POWER, STAGES
from contfric.flow.folding import folded
from contfric.flow.hits import first_hit
from contfric.flow.linear.method import (
    explicit_or_linear,
    explicit_or_linear_probe,
)
from contfric.flow.radau import IMPLICIT_STAGES
from contfric.flow.stepping import explicit, explicit_probe, first_step, next_step, settle
from contfric.flow.stiffness import automatic, automatic_probe, implicit, implicit_probe
from contfric.flow.turnings import all_turnings
from contfric.flow.variations import begin, make_room


class Method(str, Enum):
    """How a motion is integrated."""

    EXPLICIT = "explicit"
    IMPLICIT = "implicit"
    AUTOMATIC = "automatic"


_METHODS = {
    Method.EXPLICIT: (explicit, explicit_probe, 0),
    Method.IMPLICIT: (implicit, implicit_probe, IMPLICIT_STAGES),
    Method.AUTOMATIC: (automatic, automatic_probe, IMPLICIT_STAGES),
}
#: The same where some modes are affine: models that ask for another method have none in closed form.
_OR_LINEAR = (explicit_or_linear, explicit_or_linear_probe, 0)
#: Error that a step may make, relative to a state and relative to its scale: the error of a segment is
#: about as large (docs/integration.md), and Newton's method on a chain of segments sees a smooth map.
TOLERANCE = 1e-12


@helper
def no_side(mode, c):  # type: ignore[no-untyped-def]
    """Return that a mode may leave a level to both sides."""
    return 0.0


def integrated_motion(
    *,
    field: Callable[..., Any],
    observe: Callable[..., Any],
    rate: Callable[..., Any],
    period: Callable[..., Any],
    scale: Callable[..., Any],
    side: Callable[..., Any] | None = None,
    method: Method | str = Method.EXPLICIT,
    relative: float = TOLERANCE,
    absolute: float = TOLERANCE,
    kinks: int = 0,
    kink: Callable[..., Any] | None = None,
    linear: Mapping[str, Any] | None = None,
) -> Bundle:
    """Bundle the helpers of a model, as the kernels of its flow take them.

    Parameters
    ----------
    field, observe, rate, period, scale, side : the helpers that the module describes
    method : ``explicit`` (order 8), or ``automatic`` where a mode is stiff: it changes to the implicit
        method and back as the motion asks for it, and takes longer to compile
    relative, absolute : error that a step may make relative to a state, and to its scale
    kinks, kink : number of kinks of the field, and a helper from a kink to the observable that vanishes
        there (:mod:`contfric.flow.kinked`)
    linear : helpers of the modes that are affine (:mod:`contfric.flow.linear`), with ``closed(mode)``, which
        tells them from others

    Raises
    ------
    ValueError
        For an unknown method.
    """
    attempt, probe, stages = _METHODS[Method(method)] if linear is None else _OR_LINEAR
    own = {} if linear is None else {k: v for k, v in linear.items() if k != "period"}
    return Bundle(
        **own,
        field=field,
        observe=observe,
        rate=rate,
        period=period,
        scale=scale,
        side=no_side if side is None else side,
        relative=float(relative),
        absolute=float(absolute),
        attempt=attempt,
        probe=probe,
        stages=stages,
        looseness=(max(relative, absolute) / 1e-12) ** (1.0 / POWER),
        kinks=int(kinks),
        kink=kink or observe,
    )


@helper
def advance(motion, mode, t0, dt, y0, p, which, room):  # type: ignore[no-untyped-def]
    """Integrate over ``dt`` (of either sign) in ``room``; tell whether the end was reached."""
    begin(motion, y0, p, which, room)
    first_step(motion, mode, -1, t0, dt, p, which, room)
    if not math.isfinite(t0 + dt):
        return False
    done = 0.0
    while done != dt:
        left = dt - done
        h = next_step(motion, mode, -1, t0 + done, left, p, which, room)
        if math.isnan(h):
            return False
        done = dt if h == left else done + h
        settle(room)
    return True


@helper
def hand_back(room, fine, y1, jac):  # type: ignore[no-untyped-def]
    """Write the state and its derivatives by (t0, y0, dt, parameters)."""
    n, columns = room.scales.shape[0], room.partial.shape[1]
    for i in range(n):
        y1[i] = room.start[i] if fine else math.nan
    for i in range(n if columns > 0 else 0):
        row = n + i * columns
        for j in range(columns):
            jac[i, j if j <= n else j + 1] = room.start[row + j] if fine else math.nan
        jac[i, 1 + n] = room.slopes[0, i] if fine else math.nan


@allocating_helper
def integrated_flow(motion, mode, t0, y0, dt, p, which, y1, jac):  # type: ignore[no-untyped-def]
    """Advance a state by ``dt``, with derivatives where ``jac`` has room (``flow_signature``).

    The phase is folded into one period; the fold depends on the parameters as the period does.
    """
    n, free = y0.shape[0], which.shape[0]
    columns = 1 + n + free if jac.shape[0] > 0 else 0
    grad = np.empty(free)
    period = motion.period(p, which, grad)
    cycles = folded(t0, period)
    room = make_room(n, 0, columns, STAGES, motion.stages)
    fine = advance(motion, mode, t0 - cycles * period, dt, y0, p, which, room)
    hand_back(room, fine, y1, jac)
    if columns > 0 and cycles != 0.0:
        for i in range(n):
            for k in range(free):
                jac[i, 2 + n + k] -= cycles * grad[k] * jac[i, 0]


@allocating_helper
def integrated_hit(motion, mode, c, target, on, t0, y0, dt_max, p, y1):  # type: ignore[no-untyped-def]
    """Return the first time at which an observable takes a value (``hit_signature``)."""
    if not dt_max > 0.0:
        return -1.0
    room = make_room(y0.shape[0], 1, 0, STAGES, motion.stages)
    period = motion.period(p, room.none, room.empty)
    phase = t0 - folded(t0, period) * period
    return first_hit(motion, mode, c, target, on, phase, y0, dt_max, p, room, y1)


@allocating_helper
def integrated_turning(motion, mode, c, t0, y0, dt, p, times, values):  # type: ignore[no-untyped-def]
    """Write the stationary points of an observable and return their number (``turning_signature``)."""
    if not dt > 0.0:
        return 0
    room = make_room(y0.shape[0], 1, 0, STAGES, motion.stages)
    period = motion.period(p, room.none, room.empty)
    phase = t0 - folded(t0, period) * period
    return all_turnings(motion, mode, c, phase, y0, dt, p, room, times, values)
