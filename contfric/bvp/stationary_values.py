"""Stationary values that are followed from point to point of a branch, with their slopes, compiled.

Let u(t; s) be an observable along a segment of the orbit at arclength s of a branch, stationary at t*(s), and
``U(s) = u(t*(s); s)`` its stationary value. As u' = 0 at t*, what t* does along the branch is of no matter
(the envelope theorem): with the joint z = (t0, y0) where the segment begins, the parameters w, and
``y(t0 + d) = phi(t0, y0, d; w)``,

    dU/ds = u_t t0_s + u_y (phi_t0 t0_s + phi_y0 y0_s + phi_w w_s) + u_w w_s      at fixed d = t* - t0,

``(z_s, w_s)`` the tangent of the branch. Each segment and observable that is watched has a row.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray, IntArray
from contfric.bvp.equations import close_chain, segment_jacobian
from contfric.compiled import allocating_helper, helper

#: Most stationary values of a row that are followed: a slide has a few. A stick of many periods of the
#: excitation has more, and is not followed.
MOST_FOLLOWED = 16
#: In the place of a number of values: the row is not followed.
_NOT_FOLLOWED = -1
#: Places in the slots: the last point but one, the last one, and a new one.
EARLIER, BEFORE, HERE = range(3)


class Followed(NamedTuple):
    """What a march remembers of its last points, to see what happens between them.

    Attributes
    ----------
    slots : where each of the three points is in the arrays
    counts : number of stationary values of each row: of each interior margin, then of each label; of margins
        that share segment and observable only the first has them, shape (3, rows)
    times, values : times after the start of the segment, and values, shape (3, rows, MOST_FOLLOWED)
    ends : values at the end of the segment of each row of labels, shape (3, rows)
    levels : of the surfaces, shape (3, surfaces)
    slope : tangent of the joint at the end of a segment, shape (m,)
    """

    slots: IntArray
    counts: IntArray
    times: FloatArray
    values: FloatArray
    ends: FloatArray
    levels: FloatArray
    slope: FloatArray


@allocating_helper
def followed_values(rows, surfaces, m):  # type: ignore[no-untyped-def]
    """Return space for what is remembered of three points; of nothing without rows."""
    return Followed(
        np.arange(3),
        np.full((3, rows), _NOT_FOLLOWED, np.int64),
        np.empty((3, rows, MOST_FOLLOWED)),
        np.empty((3, rows, MOST_FOLLOWED)),
        np.empty((3, rows)),
        np.empty((3, surfaces)),
        np.empty(m),
    )


@helper
def remember(followed):  # type: ignore[no-untyped-def]
    """Make the new point the last one; the last one but one is forgotten."""
    slots = followed.slots
    slots[0], slots[1], slots[2] = slots[1], slots[2], slots[0]


@helper
def forget(followed):  # type: ignore[no-untyped-def]
    """Make an unknown point the last one."""
    for row in range(followed.counts.shape[1]):
        followed.counts[followed.slots[HERE], row] = _NOT_FOLLOWED
    remember(followed)


@helper
def count_followed(layout):  # type: ignore[no-untyped-def]
    """Return the number of rows of a layout."""
    return layout.interior.shape[0] + layout.labels.shape[0]


@helper
def keep_levels(functions, p, followed, workspace):  # type: ignore[no-untyped-def]
    """Keep the levels of all surfaces at a new point."""
    if followed.counts.shape[1] > 0:
        for surface in range(followed.levels.shape[1]):
            followed.levels[followed.slots[HERE], surface] = functions.level(
                surface, p, workspace.none, workspace.empty
            )


@helper
def keep_values(followed, row, found, stationary):  # type: ignore[no-untyped-def]
    """Keep the stationary values of a row of a new point, if there is space for them."""
    if row >= followed.counts.shape[1]:
        return
    here = followed.slots[HERE]
    followed.counts[here, row] = _NOT_FOLLOWED
    if 0 <= found <= MOST_FOLLOWED:
        followed.counts[here, row] = found
        for j in range(found):
            followed.times[here, row, j] = stationary.times[j]
            followed.values[here, row, j] = stationary.values[j]


@helper
def keep_end(followed, row, value):  # type: ignore[no-untyped-def]
    """Keep the value at the end of the segment of a row of a new point."""
    if row < followed.counts.shape[1]:
        followed.ends[followed.slots[HERE], row] = value


@helper
def segment_and_observable(layout, row):  # type: ignore[no-untyped-def]
    """Return the segment and the observable of a row."""
    first = layout.interior.shape[0]
    if row < first:
        return layout.interior[row, 0], layout.observables[layout.interior[row, 1]]
    return layout.labels[row - first, 0], layout.labels[row - first, 1]


@helper
def stationary_slope(  # type: ignore[no-untyped-def]
    functions, layout, i, c, time, start, start_slope, p, which, w_slope, workspace
):
    """Return how fast a stationary value of observable c in segment i changes along the branch.

    Parameters
    ----------
    time : of the stationary point, after the start of the segment
    start, start_slope : joint at which it begins, and its tangent
    w_slope : tangent of the parameters ``which``
    """
    n, state, jac, grad = start.shape[0] - 1, workspace.state, workspace.jac, workspace.grad
    segment_jacobian(functions, layout, i, start, time, p, which, jac, workspace)
    functions.observe(c, start[0] + time, state, p, which, grad)
    slope = grad[0] * start_slope[0]
    for a in range(n):
        change = 0.0
        for k in range(1 + n):
            change += jac[a, k] * start_slope[k]
        for k in range(which.shape[0]):
            change += jac[a, 2 + n + k] * w_slope[k]
        slope += grad[1 + a] * change
    for k in range(which.shape[0]):
        slope += grad[1 + n + k] * w_slope[k]
    return slope


@helper
def end_rates(  # type: ignore[no-untyped-def]
    functions, layout, i, c, surface, is_exit, z, tz, p, which, w_slope, workspace
):
    """Return how fast observable c less its level at the end of segment i changes along the branch.

    With ``is_exit`` its rate along the segment's mode instead.
    """
    count, m = z.shape
    equations, slope = workspace.equations, workspace.followed.slope
    grad, after = equations.grad, equations.last
    if i + 1 < count:
        after = z[i + 1]
        for a in range(m):
            slope[a] = tz[i + 1, a]
    else:
        close_chain(functions, layout, z, p, which, equations)
        for a in range(m):
            slope[a] = 0.0
            for b in range(m):
                slope[a] += equations.close[a, b] * tz[0, b]
        for k in range(which.shape[0]):
            slope[0] += equations.close_w[0, k] * w_slope[k]
    if is_exit:
        functions.rate(layout.modes[i], c, after[0], after[1:], p, which, grad)
    else:
        functions.observe(c, after[0], after[1:], p, which, grad)
    total = 0.0
    for a in range(m):
        total += grad[a] * slope[a]
    for k in range(which.shape[0]):
        total += grad[m + k] * w_slope[k]
    if not is_exit:
        functions.level(surface, p, which, equations.level_grad)
        for k in range(which.shape[0]):
            total -= equations.level_grad[k] * w_slope[k]
    return total
