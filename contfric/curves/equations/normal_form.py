"""Coefficients of the normal forms along a curve, compiled: where they vanish a curve changes its nature.

* Along a fold curve, ``a = u^T F_zz v v``: the parameters turn back where it is zero, a cusp.
* Along a curve of multiplier -1 (period doubling; the breaking of a symmetry) Lyapunov-Schmidt reduction
  of the doubled orbit, ``F(z + eps v, ..)`` with v changing sign after one turn, leaves an odd equation in
  eps. Its cubic coefficient is

      b = u^T [ F_zzz v v v / 6 + F_zz v h / 2 ],      J_1 h = -F_zz v v,

  where h is periodic (sigma = 1), for the product of two odd parts is even. Where b is zero the
  bifurcation changes between super- and subcritical, and a fold curve of the doubled orbits begins
  (Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory, sections 8.2 and 9.4).

Of an autonomous orbit the doubled one has its end pinned after two turns. Its null vectors, its adjoint
ones and h are those of one turn and their images, the first turn shifted in time so that times agree
between them. Segments and their equations do not feel a common shift, so that b is the same expression (the
adjoint equations have no component along the shift either: ``u_i^T B_i e_t`` is the same for all i, and zero
for the first).

F_zzz v v v is the central difference of the exact second derivatives along v, with Richardson's
extrapolation; everything is local to a segment.
"""

from __future__ import annotations

from contfric.bvp.short_exits import is_divided
from contfric.compiled import helper
from contfric.curves.equations.bending import bend_flow, bend_mean_rate, bend_observable
from contfric.curves.equations.bordered import _THIRD, end_of, segment_direction
from contfric.curves.equations.chain import chain_solve, set_border


@helper
def second_order(way, i, ends, sign, others, twist, divided, out):  # type: ignore[no-untyped-def]
    """Write F_i,zz v w (m numbers) between two joints; w is ``others``, closed by ``twist``.

    ``divided`` says whether the exit row is divided by the duration: that of the orbit, near it as well.
    """
    bordered, equations, (start, after) = way.workspace.bordered, way.workspace.equations, ends
    m = start.shape[0]
    n, close, along, other = m - 1, equations.close, bordered.along, bordered.other
    segment_direction(bordered.v, i, sign, close, along)
    segment_direction(others, i, twist, close, other)
    lasts, bent = after[0] - start[0], bordered.bent
    bend_flow(way, i, start, lasts, along, bent)
    for j in range(n):
        out[j] = 0.0
        for k in range(1 + m):
            out[j] += bent[j, k] * other[k]
    out[n] = 0.0
    if divided:
        bend_mean_rate(way, i, start, lasts, along)
        for k in range(1 + m):
            out[n] += bordered.divided[k] * other[k]
        return
    for j in range(m):
        along[j] = end_of(bordered.v, i, sign, close, j)
    bend_observable(way, way.layout.observables[way.layout.exits[i]], after, along, bordered.bent)
    for k in range(m):
        out[n] += bordered.bent[0, k] * end_of(others, i, twist, close, k)


@helper
def divides_exit(way, i, z):  # type: ignore[no-untyped-def]
    """Tell whether the exit row of segment i of an orbit is divided by its duration."""
    equations = way.workspace.equations
    after = z[i + 1] if i + 1 < z.shape[0] else equations.last
    lasts = after[0] - z[i, 0]
    return is_divided(way.functions, way.layout, i, z[i], lasts, way.p, way.which, equations)


@helper
def third_order(way, i, z, sign, out):  # type: ignore[no-untyped-def]
    """Return ``u_i^T F_i,zzz v v v``."""
    workspace, bordered, close = (
        way.workspace,
        way.workspace.bordered,
        way.workspace.equations.close,
    )
    v, u = bordered.v, bordered.u
    count, m = z.shape
    start, after = ends = workspace.z_ref[i], bordered.after
    divided = divides_exit(way, i, z)
    slopes = 0.0
    for level in range(2):
        step = _THIRD if level == 0 else 0.5 * _THIRD
        weight = -1.0 / 3.0 if level == 0 else 4.0 / 3.0
        for side in range(2):
            h = step if side == 0 else -step
            for j in range(m):
                end = z[i + 1, j] if i + 1 < count else workspace.equations.last[j]
                start[j] = z[i, j] + h * v[i, j]
                after[j] = end + h * end_of(v, i, sign, close, j)
            second_order(way, i, ends, sign, v, sign, divided, out)
            for j in range(m):
                slopes += weight * u[i, j] * out[j] / (2.0 * h)
    return slopes


@helper
def bend_segment(way, i, z, sign, others, twist, out):  # type: ignore[no-untyped-def]
    """Write F_i,zz v w of segment i of the orbit; w is ``others``, closed by ``twist``."""
    ends = z[i], (z[i + 1] if i + 1 < z.shape[0] else way.workspace.equations.last)
    second_order(way, i, ends, sign, others, twist, divides_exit(way, i, z), out)


@helper
def cubic_coefficient(way, z):  # type: ignore[no-untyped-def]
    """Return b; the blocks of the Jacobian and the null vectors are in the workspace."""
    workspace, sign = way.workspace, way.condition.sign
    bordered, close = workspace.bordered, workspace.equations.close
    v, u, even = bordered.v, bordered.u, bordered.even
    count, m = z.shape
    spare = workspace.pencil[0, 0]
    total = 0.0
    for i in range(count):
        bend_segment(way, i, z, sign, v, sign, spare)
        for j in range(m):
            even[i, j] = -spare[j]
    workspace.z_ref[:, :] = 0.0
    set_border(bordered, v, 1.0, 0.0)
    plain, periodic = count < 0, 1.0
    if not chain_solve(bordered, periodic, workspace.z_ref, even, plain, close, workspace.pencil):
        return 0.0
    for i in range(count):
        for j in range(m):
            even[i, j] = bordered.work.z[i, j, 0]
    for i in range(count):
        bend_segment(way, i, z, sign, even, periodic, spare)
        for j in range(m):
            total += 0.5 * u[i, j] * spare[j]
        total += third_order(way, i, z, sign, spare) / 6.0
    return total
