"""Solved orbits of the bundled structures, by the flow without derivatives and by matrix exponentials.

Newton's method sees the flow with derivatives. The other one, which simulation uses, and the exponentials in
40 digits must agree with the joints that it has found, along branches and where they bifurcate.
"""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

import contfric as cf
from contfric.models.described.evaluate import floats

#: What is followed of each structure: a parameter, its range, and where an orbit is looked for.
STRUCTURES: dict[str, tuple[str, tuple[float, float], dict[str, float]]] = {
    "beam-stop": ("W", (5.99, 6.02), {}),
    "blade-damper": ("F", (0.13, 0.2), {}),
    "braced-chain": ("W", (0.45, 0.55), {"W": 0.5}),
    "drill-string": ("w", (0.25, 0.35), {"w": 0.3}),
    "iwan": ("F", (0.3, 0.5), {}),
    "pounding": ("w", (0.75, 0.9), {}),
    "storeys": ("W", (0.58, 0.62), {}),
    "two-blocks": ("vb", (0.15, 0.3), {"vb": 0.2}),
}
STARTS = {"drill-string": [-0.25, -0.5, -0.75, -1.0, -0.3, -0.3, -0.3, -0.3]}
#: Rounding of the longest segments, of stiff ones, and of exits that are met slowly.
ROUNDING = 1e-12


def residual(orbit: cf.Orbit) -> float:
    """Return how far the segments of an orbit are from their ends, and these from their surfaces."""
    worst, flow = 0.0, orbit.flow
    for i, (mode, surface) in enumerate(orbit.itinerary):
        (t0, *start), (t1, *end) = orbit.begins[i], orbit.ends[i]
        found = flow.state(mode, t0, np.array(start), t1 - t0)
        worst = max(worst, float(np.max(np.abs(found - end) / (1.0 + np.abs(end)))))
        worst = max(worst, abs(flow.height(surface, t1, np.array(end))))
    return worst


def solved(name: str) -> list[cf.Orbit]:
    """Return the orbits of a branch and of its bifurcations."""
    parameter, span, params = STRUCTURES[name]
    orbit = cf.find_orbit(name, params, state=STARTS.get(name))
    branch = cf.continue_orbit(orbit, parameter, span)
    return [orbit, *branch, *(b.orbit for b in branch.bifurcations)]


def exponential(orbit: cf.Orbit, i: int) -> np.ndarray:
    """Return where a segment ends by the exponential of its matrix, whose rates are affine.

    With ``y' = A y + c + a cos(w t) + b sin(w t)`` the vector (y, 1, cos, sin) has linear rates.
    """
    fields, n = floats(orbit.model.description), len(orbit.model.states)
    mode, _ = orbit.itinerary[i]
    period = orbit.flow.period

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        return np.array(fields.field(mode, orbit.params, t, list(y)), dtype=float)

    rest = np.zeros(n)
    first, half, quarter = (rates(share * period, rest) for share in (0.0, 0.5, 0.25))
    mean = (first + half) / 2.0
    w = 2.0 * np.pi / period if period else 0.0
    matrix = np.zeros((n + 3, n + 3))
    matrix[:n, :n] = np.column_stack([rates(0.0, row) - first for row in np.eye(n)])
    matrix[:n, n], matrix[:n, n + 1], matrix[:n, n + 2] = mean, (first - half) / 2.0, quarter - mean
    matrix[n + 1, n + 2], matrix[n + 2, n + 1] = -w, w
    (t0, *start), (t1, *_) = orbit.begins[i], orbit.ends[i]
    with mpmath.workdps(60):  # squarings take some of them; 40 are left
        turn = mpmath.mpf(w) * mpmath.mpf(t0)
        begin = mpmath.matrix([*start, 1.0, mpmath.cos(turn), mpmath.sin(turn)])
        duration = mpmath.mpf(t1) - mpmath.mpf(t0)
        end = mpmath.expm(mpmath.matrix(matrix.tolist()) * duration) * begin
        return np.array([float(end[k]) for k in range(n)])


@pytest.mark.parametrize(
    "name",
    [pytest.param(s, marks=pytest.mark.slow) if s == "beam-stop" else s for s in STRUCTURES],
)
def test_orbits_solve_their_equations_without_derivatives(name: str) -> None:
    orbits = solved(name)
    assert len(orbits) > 3
    assert max(map(residual, orbits)) < ROUNDING


@pytest.mark.parametrize("name", ["blade-damper", "iwan", "two-blocks"])
def test_segments_end_where_exponentials_do(name: str) -> None:
    for orbit in solved(name)[::4]:
        for i, end in enumerate(orbit.ends):
            assert exponential(orbit, i) == pytest.approx(end[1:], abs=ROUNDING)


@pytest.mark.slow
def test_the_beam_beyond_its_graze() -> None:
    """Two segments, of which one is as short as a contact that only touches, up to the doubling."""
    orbit = cf.find_orbit("beam-stop")
    diagram = cf.explore(orbit, "W", (6.0, 6.16), max_periods=1)
    found = {b.kind: b.orbit for b in diagram.bifurcations}
    assert {cf.Kind.GS, cf.Kind.NS, cf.Kind.PD} <= set(found)
    orbits = [*found.values(), *(orbit for branch in diagram.branches for orbit in branch)]
    assert max(map(residual, orbits)) < ROUNDING
    for i, end in enumerate(found[cf.Kind.PD].ends):
        assert exponential(found[cf.Kind.PD], i) == pytest.approx(end[1:], abs=ROUNDING)
