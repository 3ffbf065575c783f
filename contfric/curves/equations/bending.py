"""Second derivatives of one segment in a direction, compiled: of its end, its exit row, an observable.

For a direction (tau, xi, delta) of (t_i, y_i, duration) they are the change of the exact first
derivatives. A flow may give that of its own (:mod:`contfric.flow.oscillator.second`); else they are central
differences.

*After a reset* a segment is ``phi(t_i, R(t_i, y_i), d)``, and its derivatives follow by the chain rule.
Central differences of those contain the second derivatives of R.

*Divided exit rows.* The exit row of a short segment that begins on its exit surface is the mean of the
rate, ``q = int_0^1 r'(s d) ds = r(d) / d`` with r the distance to the surface
(:mod:`contfric.bvp.short_exits`). It is a function of ``(t_i, y_i, d)`` as the flow is, and of no later
state; D_v of its gradient takes the place of the observable's. Of the quotient itself, where r = 0,

    D_v D_w (r / d) = D_v D_w r / d - (D_v r D_w d + D_w r D_v d) / d^2:

the cross terms do not vanish, and at d = 0 all of it is a quotient of zeros. Of q nothing is.
"""

from __future__ import annotations

from contfric.bvp.after_reset import apply_reset
from contfric.bvp.equations import segment_jacobian
from contfric.bvp.short_exits import mean_rate_row
from contfric.compiled import helper

#: Step of the differences where a flow has no second derivatives of its own, against the size of the
#: direction: the cube root of rounding.
DIFFERENCE = 6e-6


@helper
def bend_flow(way, i, start, duration, along, out):  # type: ignore[no-untyped-def]
    """Write the derivative of the flow's jacobian in a direction."""
    functions, second, layout, p, which = way.functions, way.second, way.layout, way.p, way.which
    bordered, equations = way.workspace.bordered, way.workspace.equations
    mode = layout.modes[i]
    none = min(mode, 0) - 1  # -1, but no literal
    if layout.resets[i] < 0 and second.second(
        mode, none, start[0], start[1:], duration, p, which, along, out, bordered.numbers
    ):
        return
    m = start.shape[0]
    step, displaced = bordered.difference[0], bordered.start
    bordered.difference[1] = 1.0
    for side in range(2):
        h = step if side == 0 else -step
        for j in range(m):
            displaced[j] = start[j] + h * along[j]
        jac, lasts = out if side == 0 else bordered.plus, duration + h * along[m]
        segment_jacobian(functions, layout, i, displaced, lasts, p, which, jac, equations)
    for row in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[row, j] = (out[row, j] - bordered.plus[row, j]) / (2.0 * step)


@helper
def bend_mean_rate(way, i, start, duration, along):  # type: ignore[no-untyped-def]
    """Write the derivative of a divided exit row in a direction of (t, y, duration)."""
    functions, layout, p, which = way.functions, way.layout, way.p, way.which
    workspace = way.workspace
    bordered, equations, rows = workspace.bordered, workspace.equations, workspace.elimination.rows
    m, free, step = start.shape[0], which.shape[0], bordered.difference[0]
    bordered.difference[1] = 1.0
    row, displaced, out = 2 * m - 1, bordered.start, bordered.divided
    for side in range(2):
        h = step if side == 0 else -step
        for j in range(m):
            displaced[j] = start[j] + h * along[j]
        if layout.resets[i] >= 0:
            apply_reset(functions, layout, i, displaced, p, which, equations)
        lasts = duration + h * along[m]
        mean_rate_row(functions, layout, i, m, displaced, lasts, p, which, equations, rows)
        for k in range(1 + m + free):
            # columns of both joints: t and the end of the duration, y, parameters
            value = rows[row, m + k]
            if k == 0:
                value += rows[row, 2 * m]
            elif k > m:
                value = rows[row, 3 * m + k - m - 1]
            out[k] = value if side == 0 else (out[k] - value) / (2.0 * step)


@helper
def bend_observable(way, c, at, along, out):  # type: ignore[no-untyped-def]
    """Write the derivative of an observable's gradient in a direction of (t, y) to the first row."""
    functions, second, p, which = way.functions, way.second, way.p, way.which
    bordered, equations = way.workspace.bordered, way.workspace.equations
    if second.second(0, c, at[0], at[1:], 0.0, p, which, along, out, bordered.numbers):
        return
    m, step = at.shape[0], bordered.difference[0]
    displaced, grad = bordered.start, equations.grad
    for side in range(2):
        h = step if side == 0 else -step
        for j in range(m):
            displaced[j] = at[j] + h * along[j]
        functions.observe(c, displaced[0], displaced[1:], p, which, grad)
        for j in range(grad.shape[0]):
            out[0, j] = grad[j] if side == 0 else (out[0, j] - grad[j]) / (2.0 * step)
