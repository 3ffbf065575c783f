"""Sets of equilibria: the part of a line or plane of zeros that lies inside of a region.

A field that vanishes along a line has no isolated equilibria there. What counts is where the line leaves the
region of its mode: a mass that sticks rests between the limits of static friction.
"""

from __future__ import annotations

import numpy as np

from contfric.equilibria.newton import Zeros
from contfric.equilibria.result import EquilibriumSet
from contfric.models.definition import FloatArray

#: Along a set that is no straight line: steps and how many, in natural sizes of the states; how near its end is
#: bisected to, and how near two states of one set are.
_STEP, _STEPS, _NEAR = 0.02, 2000, 0.03
_BISECTIONS = 60
#: Relative: what an affine height differs by from its chord.
_AFFINE = 1e-9
#: Beyond the last surface that bounds a line: any share of the size will do.
_BEYOND = 1.0


def sets_of_line(zeros: Zeros, y: FloatArray, direction: FloatArray) -> list[EquilibriumSet]:
    """Return the pieces of a line of zeros that lie inside of the region, each with its ends.

    Heights that are not affine along the line are followed from the state outwards instead.
    """
    places = _crossings(zeros, y, direction)
    if places is None:
        found = followed(zeros, y, direction)
        return [] if found is None else [found]
    size = float(np.max(zeros.scale))
    cuts = sorted(places)
    edges = [cuts[0] - _BEYOND * size, *cuts, cuts[-1] + _BEYOND * size] if cuts else [-size, size]
    inside = []
    for low, high in zip(edges, edges[1:], strict=False):
        middle = y + 0.5 * (low + high) * direction
        inside.append(high > low and not zeros.region.domain_of(middle, zeros.p)[1])
    found, k = [], 0
    while k < len(inside):
        if not inside[k]:
            k += 1
            continue
        first = k
        while k < len(inside) and inside[k]:
            k += 1
        ends = [
            (places[edges[i]], y + edges[i] * direction) for i in (first, k) if edges[i] in places
        ]
        middle = y + 0.5 * (edges[first] + edges[k]) * direction
        found.append(_set(zeros, middle, direction[None, :], tuple(ends)))
    return found


def _crossings(zeros: Zeros, y: FloatArray, direction: FloatArray) -> dict[float, str] | None:
    """Return where a line meets surfaces that bound the region somewhere; None if a height is not affine."""
    region, size = zeros.region, float(np.max(zeros.scale))
    heights = region.heights
    near, far = (heights.value(y + s * size * direction, zeros.p) for s in (0.0, 1.0))
    half = heights.value(y + 0.5 * size * direction, zeros.p)
    bent = np.abs(near + far - 2.0 * half) > _AFFINE * (np.abs(near) + np.abs(far) + np.abs(half))
    found: dict[float, str] = {}
    for k, name in enumerate(heights.names):
        if not any(region.bounds(d, name) for d in region.domains):
            continue
        if bent[k]:
            return None
        rate = (far[k] - near[k]) / size
        if abs(rate) > _AFFINE * (abs(near[k]) + abs(far[k])) / size:
            found[float(-near[k] / rate)] = name
    return found


def followed(zeros: Zeros, y: FloatArray, direction: FloatArray) -> EquilibriumSet | None:
    """Return the set through a state, followed both ways until it leaves the region; None if that is outside."""
    if zeros.region.domain_of(y, zeros.p)[1]:
        return None
    ends = [_end(zeros, y, sign * direction) for sign in (-1.0, 1.0)]
    return _set(zeros, y, direction[None, :], tuple(end for end in ends if end is not None))


def _end(zeros: Zeros, y: FloatArray, direction: FloatArray) -> tuple[str, FloatArray] | None:
    """Return the surface and the state at which a set leaves the region in a direction; None if it does not."""
    region, p = zeros.region, zeros.p
    length = _STEP * float(np.min(zeros.scale))
    for _ in range(_STEPS):
        ahead = zeros.newton(y + length * direction)
        if ahead is None:
            return None
        if wrong := region.domain_of(ahead, p)[1]:
            return wrong[0], _bisected(zeros, y, ahead)
        chord = ahead - y
        direction, y = chord / max(float(np.linalg.norm(chord)), 1e-300), ahead
    return None


def _bisected(zeros: Zeros, inside: FloatArray, outside: FloatArray) -> FloatArray:
    for _ in range(_BISECTIONS):
        middle = zeros.newton(0.5 * (inside + outside))
        if middle is None:
            break
        if zeros.region.domain_of(middle, zeros.p)[1]:
            outside = middle
        else:
            inside = middle
    return inside


def set_of_plane(zeros: Zeros, y: FloatArray, directions: FloatArray) -> EquilibriumSet | None:
    """Return the set of dimension 2 or more through a zero, at the state farthest inside; None if none is inside.

    The state is that of the largest ball (Chebyshev centre) in the region, a linear program where heights are affine.
    """
    from scipy.optimize import linprog

    region, p = zeros.region, zeros.p
    heights, names = region.heights, region.heights.names
    values, slopes = heights.value(y, p), heights.slopes(y, p) @ directions.T
    count, size = len(directions), float(np.max(zeros.scale))
    for domain in region.domains:
        sides = region.sides(domain)
        rows = [(names.index(s), side) for s, side in sides.items() if region.bounds(domain, s)]
        a = np.array([[*(-side * slopes[k]), np.linalg.norm(slopes[k])] for k, side in rows])
        b = np.array([side * values[k] for k, side in rows])
        bounds = [(-10.0 * size, 10.0 * size)] * count + [(0.0, size)]
        cost = np.array([0.0] * count + [-1.0])
        best = linprog(cost, A_ub=a if rows else None, b_ub=b if rows else None, bounds=bounds)
        if best.status == 0 and best.x[-1] > 0.0:
            inside = zeros.newton(y + best.x[:-1] @ directions)
            if inside is not None and not region.domain_of(inside, p)[1]:
                return _set(zeros, inside, directions, ())
    return None


def holds_state(found: EquilibriumSet, y: FloatArray, scale: FloatArray) -> bool:
    """Tell whether a state is one of a set, as far as its ends and its direction tell."""
    apart = (y - found.state) / scale
    basis = np.linalg.qr((found.directions / scale).T)[0]
    along = basis @ (basis.T @ apart)
    if np.max(np.abs(apart - along)) > _NEAR * (1.0 + np.max(np.abs(along))):
        return False
    if found.dimension > 1 or len(found.ends) < 2:
        return True
    low, high = (end / scale for _, end in found.ends)
    share = float((y / scale - low) @ (high - low)) / float((high - low) @ (high - low))
    return -_NEAR <= share <= 1.0 + _NEAR


def _set(
    zeros: Zeros,
    y: FloatArray,
    directions: FloatArray,
    ends: tuple[tuple[str, FloatArray], ...],
) -> EquilibriumSet:
    own = zeros.region.eigenvalues(y, zeros.p)
    order = np.argsort(np.abs(own), kind="stable")[len(directions) :]
    return EquilibriumSet(zeros.region, zeros.p, y, directions, ends, own[np.sort(order)])
