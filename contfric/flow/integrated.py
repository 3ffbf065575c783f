"""Flow by numerical integration: draft."""

from __future__ import annotations

import math

import numpy as np

from contfric.compiled import allocating_helper, helper
from contfric.flow.bundle import Bundle
from contfric.flow.dop853 import STAGES
from contfric.flow.radau import IMPLICIT_STAGES
from contfric.flow.stiffness import automatic, automatic_probe, implicit, implicit_probe
from contfric.flow.stepping import explicit, explicit_probe, first_step, next_step, settle
from contfric.flow.variations import begin, make_room


METHODS = {"explicit": (explicit, explicit_probe, 0), "implicit": (implicit, implicit_probe, IMPLICIT_STAGES), "automatic": (automatic, automatic_probe, IMPLICIT_STAGES)}


def integrated_motion(field, observe, rate, period, scale, relative=1e-12, absolute=1e-12, method="explicit"):
    attempt, probe, implicit = METHODS[method]
    return Bundle(field=field, observe=observe, rate=rate, period=period, scale=scale, relative=relative, absolute=absolute, attempt=attempt, probe=probe, implicit=implicit)


@helper
def advance(motion, mode, t0, dt, y0, p, which, room):  # type: ignore[no-untyped-def]
    """Integrate to the end; tell whether it was reached."""
    begin(motion, y0, p, which, room)
    first_step(motion, mode, -1, t0, dt, p, which, room)
    done = 0.0
    while done != dt:
        h = next_step(motion, mode, -1, t0 + done, dt - done, p, which, room)
        if math.isnan(h):
            return False
        done = dt if h == dt - done else done + h
        settle(room)
    return True


@allocating_helper
def integrated_flow(motion, mode, t0, y0, dt, p, which, y1, jac):  # type: ignore[no-untyped-def]
    n = y0.shape[0]
    wanted = jac.shape[0] > 0
    columns = 1 + n + which.shape[0] if wanted else 0
    room = make_room(n, 0, columns, STAGES, motion.implicit)
    fine = advance(motion, mode, t0, dt, y0, p, which, room)
    for i in range(n):
        y1[i] = room.start[i] if fine else np.nan
    if wanted:
        for i in range(n):
            row = n + i * columns
            for j in range(columns):
                jac[i, j if j <= n else j + 1] = room.start[row + j] if fine else np.nan
            jac[i, 1 + n] = room.slopes[0, i] if fine else np.nan
