"""Points and directions of branches and curves, compiled: the scaled product, prediction, what is passed.

A point is the joints z of a chain, shape (N, m), with the q parameters w that are free: one along a branch,
two along a curve. The product of two directions is
``<a, b> = (1/N) sum a_i b_i + sum_k a_k b_k / width_k^2``,
so that neither the number of segments nor the unit of a parameter matters.

Points come as the rows that a march writes (:class:`Points`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray, IntArray
from contfric.compiled import blocks, helper, i8, indices, matrix, table, vector


class Points(NamedTuple):
    """The points of a branch or curve as the march writes them, one a row.

    Attributes
    ----------
    joints, w : shapes (rows, N, m) and (rows, q)
    tangents, directions : the unit tangent of each, of the joints and of the parameters
    arc : arclength
    tests, labels, mu : what is watched
    """

    joints: FloatArray
    w: FloatArray
    tangents: FloatArray
    directions: FloatArray
    arc: FloatArray
    tests: FloatArray
    labels: IntArray
    mu: NDArray[np.complex128]


PointsType = types.NamedTuple(
    [blocks, matrix, blocks, matrix, vector, matrix, table, types.complex128[:, ::1]], Points
)


class Course(NamedTuple):
    """One call of a march: from where, how far, in which steps, and where to.

    Attributes
    ----------
    options : (first step, largest step, smallest step, step below which none is refused for its angle, most
        points that are solved for in this call, whether the last trial was not finite, size of a correction
        after which no other is asked for)
    box : lower corner, upper corner, widths of the free parameters, shape (3, q)
    last : last row that is given; an earlier one serves the prediction. -1: row 0 alone is solved, normal to
        the tangent given there
    start_z, start_w : first point with its tangent, shapes (2, N, m) and (2, q)
    taken : points since then
    points : filled from row ``last + 1``
    counts : what is counted
    """

    options: FloatArray
    box: FloatArray
    last: int
    start_z: FloatArray
    start_w: FloatArray
    taken: int
    points: Points
    counts: IntArray


CourseType = types.NamedTuple([vector, matrix, i8, blocks, matrix, i8, PointsType, indices], Course)


@helper
def product(za, wa, zb, wb, scale):  # type: ignore[no-untyped-def]
    """Return the scaled product of two directions."""
    total = 0.0
    for i in range(za.shape[0]):
        for j in range(za.shape[1]):
            total += za[i, j] * zb[i, j]
    total /= za.shape[0]
    for k in range(wa.shape[0]):
        total += wa[k] * wb[k] * scale[k]
    return total


@helper
def distance(za, wa, zb, wb, scale):  # type: ignore[no-untyped-def]
    """Return the distance of two points in the scaled product."""
    total = 0.0
    for i in range(za.shape[0]):
        for j in range(za.shape[1]):
            total += (za[i, j] - zb[i, j]) ** 2
    total /= za.shape[0]
    for k in range(wa.shape[0]):
        total += (wa[k] - wb[k]) ** 2 * scale[k]
    return math.sqrt(total)


@helper
def copy_to(target, source):  # type: ignore[no-untyped-def]
    """Copy a matrix."""
    for i in range(source.shape[0]):
        for j in range(source.shape[1]):
            target[i, j] = source[i, j]


@helper
def copy_vector(target, source):  # type: ignore[no-untyped-def]
    """Copy a vector."""
    for k in range(source.shape[0]):
        target[k] = source[k]


@helper
def largest_state(z):  # type: ignore[no-untyped-def]
    """Return the largest component of the states, times left out."""
    size = 0.0
    for i in range(z.shape[0]):
        for j in range(1, z.shape[1]):
            size = max(size, abs(z[i, j]))
    return size


@helper
def predict(points, k, step):  # type: ignore[no-untyped-def]
    """Write the predicted point and the last tangent to row k + 1.

    The cubic through the last two points and their tangents, ``z_k + t_k x + A x^2 + B x^3`` with
    ``A = (2 t_k + t_{k-1} - 3 D) / h`` and ``B = (t_k + t_{k-1} - 2 D) / h^2``, D the chord over h.
    """
    zs, ws, tzs, tws, arc = points.joints, points.w, points.tangents, points.directions, points.arc
    back = arc[k] - arc[k - 1] if k > 0 else 0.0
    square, cube = 0.0, 0.0
    if back > 0.0:
        square, cube = step * step / back, step**3 / (back * back)
    for i in range(zs.shape[1]):
        for j in range(zs.shape[2]):
            t = tzs[k, i, j]
            value = zs[k, i, j] + step * t
            if back > 0.0:
                chord = (zs[k, i, j] - zs[k - 1, i, j]) / back
                before = tzs[k - 1, i, j]
                value += square * (2.0 * t + before - 3.0 * chord)
                value += cube * (t + before - 2.0 * chord)
            zs[k + 1, i, j] = value
            tzs[k + 1, i, j] = t
    for j in range(ws.shape[1]):
        t = tws[k, j]
        value = ws[k, j] + step * t
        if back > 0.0:
            chord = (ws[k, j] - ws[k - 1, j]) / back
            value += square * (2.0 * t + tws[k - 1, j] - 3.0 * chord)
            value += cube * (t + tws[k - 1, j] - 2.0 * chord)
        ws[k + 1, j], tws[k + 1, j] = value, t


@helper
def keep(directions, before, z):  # type: ignore[no-untyped-def]
    """Give a predicted point the data of the point before it (:mod:`contfric.bvp.conserved`).

    Corrections leave them alone; a cubic through points would carry their rounding farther and farther.
    """
    n = directions.shape[1]
    for d in range(directions.shape[0]):
        for i in range(z.shape[0]):
            apart = 0.0
            for j in range(n):
                apart += directions[d, j] * (z[i, 1 + j] - before[i, 1 + j])
            for j in range(n):
                z[i, 1 + j] -= apart * directions[d, j]


@helper
def interpolate(points, x):  # type: ignore[no-untyped-def]
    """Write the point at a share x of the step from row 0 to row 1 to row 2, by the cubic through them."""
    zs, ws, tzs, tws, arc = points.joints, points.w, points.tangents, points.directions, points.arc
    y, length = 1.0 - x, arc[1] - arc[0]
    ha, hb = y * y * (1.0 + 2.0 * x), x * x * (3.0 - 2.0 * x)
    ga, gb = x * y * y * length, -x * x * y * length
    for i in range(zs.shape[1]):
        for j in range(zs.shape[2]):
            value = ha * zs[0, i, j] + hb * zs[1, i, j]
            zs[2, i, j] = value + ga * tzs[0, i, j] + gb * tzs[1, i, j]
            tzs[2, i, j] = y * tzs[0, i, j] + x * tzs[1, i, j]
    for k in range(ws.shape[1]):
        ws[2, k] = ha * ws[0, k] + hb * ws[1, k] + ga * tws[0, k] + gb * tws[1, k]
        tws[2, k] = y * tws[0, k] + x * tws[1, k]
    arc[2] = arc[0] + x * length


@helper
def outside(w, box):  # type: ignore[no-untyped-def]
    """Tell whether parameters have left the box (lower corner, upper corner)."""
    for k in range(w.shape[0]):
        if w[k] < box[0, k] or w[k] > box[1, k]:
            return True
    return False


@helper
def seen_from(start_z, start_w, z, w, later, scale):  # type: ignore[no-untyped-def]
    """Return how far a point, made earlier by ``later``, is from a start, and how far along its tangent."""
    total, ahead = 0.0, 0.0
    for i in range(z.shape[0]):
        for j in range(z.shape[1]):
            gap = z[i, j] - start_z[0, i, j]
            if j == 0:
                gap -= later
            total += gap * gap
            ahead += gap * start_z[1, i, j]
    total /= z.shape[0]
    ahead /= z.shape[0]
    for k in range(w.shape[0]):
        gap = w[k] - start_w[0, k]
        total += gap * gap * scale[k]
        ahead += gap * start_w[1, k] * scale[k]
    return math.sqrt(total), ahead


@helper
def anchor(workspace, z, p, which, tz, tw, scale):  # type: ignore[no-untyped-def]
    """Set the first border row: the plane normal to a tangent through the point (z, p)."""
    count = tz.shape[0]
    for i in range(count):
        for j in range(tz.shape[1]):
            workspace.d[0, i, j] = tz[i, j] / count
            workspace.z_ref[i, j] = z[i, j]
    for k in range(which.shape[0]):
        workspace.e[0, k] = tw[k] * scale[k]
    copy_vector(workspace.p_ref, p)


@helper
def take_tangent(work, tz, tw, scale):  # type: ignore[no-untyped-def]
    """Replace a tangent by the unit one of the last elimination; tell whether it has one."""
    count, m = tz.shape
    total = 0.0
    for i in range(count):
        for j in range(m):
            total += work.z[i, j, 1] ** 2
    total /= count
    for k in range(tw.shape[0]):
        total += work.w[k, 1] ** 2 * scale[k]
    norm = math.sqrt(total)
    if not math.isfinite(norm) or norm == 0.0:
        return False
    for i in range(count):
        for j in range(m):
            tz[i, j] = work.z[i, j, 1] / norm
    for k in range(tw.shape[0]):
        tw[k] = work.w[k, 1] / norm
    return True
