r"""In which direction orbits leave a touch of a surface that is crossed beyond it, to first order.

Let a solution of period P touch the surface at a time t and stay in one mode otherwise. Disturbed, its height
is largest at ``t + r``; a passage begins at ``t + r - w`` and lasts ``2 w c/c'`` (c, c' the curvatures of the
height before and beyond). It changes the state by ``J w``, where ``J = 2 c/c' (F' - F)`` is a jump of the
rates, and so by more than what the surface is passed by, which is of the order of w^2. Over m periods, with
disturbances ``d_j`` of the state at the touches and s of the parameter,

    d_(j+1) = M (d_j + J w_j) + b s,        g d_j + h s = 0 at each passage,

with the gradient g of the height, its derivative h by the parameter, and the map M of a period with its
derivative b. Up to a factor this has one solution. Orbits leave along it where all w are positive, and the
height is on its own side at all other touches.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from contfric.continuation.touching import second_rate
from contfric.models.definition import FloatArray
from contfric.orbit.orbit import Orbit

#: Relative step of the differences for derivatives by the parameter: for a guess half of the digits will do.
_STEP = 1e-6
#: Singular values below this, relative to the largest, are zero; then more than one direction is possible.
_ZERO = 1e-9


class Leaving(NamedTuple):
    """How joints and the parameter move; ``why`` there is no such orbit, if there is none."""

    joints: FloatArray
    share: float
    why: str = ""


def leaving(unit: Orbit, kept: Sequence[int], active: int) -> Leaving | None:
    """Return the direction in which orbits leave with passages at some touches; None if it is not known.

    Parameters
    ----------
    unit : the solution at the event over a period: a passage of no length, and one other segment
    kept : for each period, whether its touch is a passage
    active : index of the parameter
    """
    (beyond, surface), (mode, _) = unit.itinerary
    model, view, n, m = unit.model, unit.flow, len(unit.model.states), len(kept)
    time, state, period = float(unit.begins[1, 0]), unit.begins[1, 1:], unit.period
    ahead, back = _moved(unit, active, 1.0), _moved(unit, active, -1.0)
    apart = float(ahead[active] - back[active])
    views = model.view(ahead), model.view(back)
    longer = (views[0].period - views[1].period) / apart * unit.periods
    observable = model.surface_by_name[surface].observable
    high = _difference([v.height(surface, time, state) for v in views]) / apart
    fast = _difference([v.rate(mode, observable, time, state) for v in views]) / apart
    gradient = view.gradient(observable, time, state)[1:]
    speed = view.rate_gradient(mode, observable, time, state, 0)[1 : 1 + n]
    flow = view.jacobian(mode, time, state, period, active)
    turn, by_parameter = flow[:, 1 : 1 + n], flow[:, -1] + flow[:, 1 + n] * longer
    own, other = (view.jacobian(name, time, state, 0.0)[:, 1 + n] for name in (mode, beyond))
    bends = second_rate(unit, mode, surface, time, state)
    lasts = 2.0 * bends / second_rate(unit, beyond, surface, time, state)
    jump = lasts * (other - own)
    rows = np.zeros((m * n + sum(kept), m * n + 1 + m))  # unknown: all d, s, all w
    for j in range(m):
        here, there = slice(j * n, (j + 1) * n), slice((j + 1) % m * n, ((j + 1) % m + 1) * n)
        rows[here, here] += turn
        rows[here, there] -= np.eye(n)
        rows[here, m * n] = by_parameter
        rows[here, m * n + 1 + j] = turn @ jump
    passages = [j for j in range(m) if kept[j]]
    for row, j in enumerate(passages, start=m * n):
        rows[row, j * n : (j + 1) * n], rows[row, m * n] = gradient, high
    columns = [*range(m * n + 1), *(m * n + 1 + j for j in passages)]
    _, sizes, right = np.linalg.svd(rows[:, columns])
    if sizes[-1] < _ZERO * sizes[0]:
        return None
    found = right[-1] * np.sign(np.sum(right[-1, m * n + 1 :]))
    moves, share, widths = found[: m * n].reshape(m, n), float(found[m * n]), found[m * n + 1 :]
    inside = -np.sign(
        second_rate(unit, mode, surface, time, state)
    )  # a touch from below is a maximum
    heights = [inside * (gradient @ moves[j] + high * share) for j in range(m) if not kept[j]]
    if np.any(widths <= 0.0) or any(height > 0.0 for height in heights):
        return Leaving(np.empty(0), 0.0, "to first order it crosses no or another touch")
    joints = []
    for j, w in zip(passages, widths.tolist(), strict=True):
        begins = -float(speed @ moves[j] + fast * share) / bends - w
        met = moves[j] + begins * own
        joints += [[begins, *met], [begins + w * lasts, *(met + w * lasts * other)]]
    return Leaving(np.array(joints), share)


def _difference(values: Sequence[float]) -> float:
    return values[0] - values[1]


def _moved(unit: Orbit, active: int, sign: float) -> FloatArray:
    vector = unit.vector.copy()
    vector[active] += sign * _STEP * (1.0 + abs(float(vector[active])))
    return vector
