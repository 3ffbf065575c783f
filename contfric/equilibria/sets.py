"""Whole sets of equilibria: where a field vanishes along a line, a curve or a plane.

A field that vanishes along a line has no isolated equilibria there. What counts is where the line leaves the
region of its mode: a mass that sticks rests between the limits of static friction.
"""

from __future__ import annotations

import itertools

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.interrupts import whole
from contfric.equilibria.newton import Zeros
from contfric.equilibria.result import EquilibriumSet

#: Along a set that is no straight line: steps and how many, in natural sizes of the states; how near its end
#: is bisected to, and how near two states of one set are.
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
        return [found] if found is not None else []
    size = float(np.max(zeros.scale))
    cuts = sorted(places)
    edges = [cuts[0] - _BEYOND * size, *cuts, cuts[-1] + _BEYOND * size] if cuts else [-size, size]
    inside = []
    for low, high in itertools.pairwise(edges):
        middle = y + 0.5 * (low + high) * direction
        inside.append(high > low and not zeros.region.domain_of(middle, zeros.p)[1])
    pieces: list[EquilibriumSet] = []
    k = 0
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
        states = np.array([y + edges[i] * direction for i in (first, k)])
        pieces.append(_set(zeros, middle, direction[None, :], states, tuple(ends)))
    return pieces


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
    """Return the set through a state, followed both ways out of the region; None if that is outside."""
    if zeros.region.domain_of(y, zeros.p)[1]:
        return None
    (low, down), (high, up) = (_half(zeros, y, sign * direction) for sign in (-1.0, 1.0))
    ends = [(s, states[-1]) for s, states in ((low, down), (high, up)) if s]
    return _set(zeros, y, direction[None, :], np.array([*down[::-1], y, *up]), tuple(ends))


def _half(zeros: Zeros, y: FloatArray, direction: FloatArray) -> tuple[str, list[FloatArray]]:
    """Return the surface at which a set leaves the region, empty if it does not, and states up to there."""
    region, p = zeros.region, zeros.p
    found: list[FloatArray] = []
    length = _STEP * float(np.min(zeros.scale))
    for _ in range(_STEPS):
        ahead = zeros.newton(y + length * direction)
        if ahead is None:
            break
        if wrong := region.domain_of(ahead, p)[1]:
            return wrong[0], [*found, _bisected(zeros, y, ahead)]
        chord = ahead - y
        direction, y = chord / max(float(np.linalg.norm(chord)), 1e-300), ahead
        found.append(ahead)
    return "", found


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
    """Return the set of dimension 2 or more through a zero, at the state farthest inside; None if outside.

    The state is that of the largest ball (Chebyshev centre) in the region, a linear program where heights are
    affine.
    """
    linprog = whole("scipy.optimize").linprog

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
                return _set(zeros, inside, directions, inside[None, :], ())
    return None


def holds_state(found: EquilibriumSet, y: FloatArray, scale: FloatArray) -> bool:
    """Tell whether a state is one of a set: near a chord of its states, or in its plane."""
    if found.dimension > 1:
        apart = (y - found.state) / scale
        basis = np.linalg.qr((found.directions / scale).T)[0]
        return bool(np.max(np.abs(apart - basis @ (basis.T @ apart))) <= _NEAR)
    states, at = found.states / scale, y / scale
    if len(states) < 2:
        return bool(np.max(np.abs(at - states[0])) <= _NEAR)
    chords = np.diff(states, axis=0)
    squares = np.maximum(np.sum(chords**2, axis=1), 1e-300)
    shares = np.clip(np.sum((at - states[:-1]) * chords, axis=1) / squares, 0.0, 1.0)
    apart = at - states[:-1] - shares[:, None] * chords
    return bool(np.min(np.linalg.norm(apart, axis=1)) <= _NEAR)


def _set(
    zeros: Zeros,
    y: FloatArray,
    directions: FloatArray,
    states: FloatArray,
    ends: tuple[tuple[str, FloatArray], ...],
) -> EquilibriumSet:
    own = zeros.region.fields.eigenvalues(y, zeros.p)
    order = np.argsort(np.abs(own), kind="stable")[len(directions) :]
    return EquilibriumSet(zeros.region, zeros.p, y, directions, states, ends, own[np.sort(order)])
