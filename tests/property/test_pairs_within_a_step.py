"""Two touches of a surface within one step: seen in coarse steps as in fine ones, on branches and curves."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

import contfric as cf
from contfric.continuation.core.dips import cubic_dip, mean_dip

#: Random scenes of which branches are traced, and those in which curves are.
SCENES, PLANES = 300, 110
#: Steps as shares of the range. The coarse one is twice that by default: more pairs fall into one.
COARSE, FINE = 0.02, 0.001
#: Places of one event (relative to the range): of a touch, to its conditioning.
SAME = 1e-8
#: A touch this near to the end of a branch belongs to the event there, and may be named or not.
AT_END = 1e-6


def scene(index: int) -> tuple[dict[str, float], str, tuple[float, float]]:
    """A random scene with little friction and slow excitation: slides of many stationary loads."""
    rng = np.random.default_rng([5, index])
    omega, S0 = rng.uniform(0.2, 0.6), rng.uniform(0.02, 0.06)
    S, zeta = S0 * rng.uniform(0.2, 0.9), rng.uniform(0.0, 0.1)
    vary = str(rng.choice(["zeta", "h", "S0"]))
    h = 0.0 if rng.random() < 0.5 else rng.uniform(-0.2, 0.2)
    params = {"Omega": omega, "S": S, "S0": S0, "h": h, "zeta": zeta}
    width = {"zeta": 0.05, "h": 0.12, "S0": 0.3 * S0}[vary]
    return params, vary, (params[vary] - width, params[vary] + width)


def touches(branch: cf.Branch, vary: str) -> list[float]:
    ends = [branch.values[0], branch.values[-1]]
    width = abs(ends[1] - ends[0])
    found = [b.params[vary] for b in branch.bifurcations if b.kind is cf.Kind.T]
    return sorted(v for v in found if min(abs(v - e) for e in ends) > AT_END * width)


def missing(some: list[float], others: list[float], width: float) -> list[float]:
    return [a for a in some if not any(abs(a - b) < SAME * width for b in others)]


@cache
def orbits() -> dict[int, cf.Orbit]:
    found = {}
    for index in range(SCENES):
        try:
            found[index] = cf.find_orbit("coulomb", scene(index)[0], longest=300)
        except cf.ContfricError:
            continue
    return found


@pytest.mark.slow
def test_branches_in_coarse_and_in_fine_steps() -> None:
    pairs = seen = 0
    for index, orbit in orbits().items():
        _, vary, bounds = scene(index)
        width = bounds[1] - bounds[0]
        coarse, fine = (
            touches(cf.continue_orbit(orbit, vary, bounds, max_step=step), vary)
            for step in (COARSE, FINE)
        )
        assert not missing(coarse, fine, width), index
        assert not missing(fine, coarse, width), index
        seen += len(fine)
        size = 1.0 + np.abs(orbit.joints[:, 1:]).max()  # steps grow with it
        pairs += sum(b - a < COARSE * size * width for a, b in pairwise(fine))
    assert seen > 200
    assert pairs > 12


@pytest.mark.slow
def test_curves_in_coarse_and_in_fine_steps() -> None:
    """Along curves of sliding events and branch points a touch is a point of codimension two."""
    traced = seen = 0
    for index, orbit in list(orbits().items())[:PLANES]:
        _, vary, bounds = scene(index)
        width = bounds[1] - bounds[0]
        other, range_ = ("zeta", (-0.1, 0.2)) if vary == "h" else ("h", (-0.3, 0.3))
        box = {vary: (bounds[0] - width, bounds[1] + width), other: range_}
        for event in cf.continue_orbit(orbit, vary, bounds).bifurcations:
            if event.kind is cf.Kind.T:
                continue
            try:
                curves = [
                    cf.continue_bifurcation(event, (vary, other), box, max_step=step)
                    for step in (COARSE, FINE)
                ]
            except cf.ContfricError:  # a continuum, or outside of what the model allows
                continue
            coarse, fine = (
                [p.params[vary] for p in curve.special if p.meets is cf.Kind.T] for curve in curves
            )
            assert not missing(coarse, fine, width), index
            assert not missing(fine, coarse, width), index
            traced, seen = traced + 1, seen + len(fine)
    assert traced > 40
    assert seen >= 3


# ------------------------------------------------------------------------------- interpolations


@pytest.mark.parametrize("seed", range(20))
def test_the_cubic_of_a_step(seed: int) -> None:
    """Where the least value of a cubic is, by its values on a fine grid."""
    rng = np.random.default_rng(seed)
    length = rng.uniform(0.5, 2.0)
    checked = 0
    for _ in range(1000):
        poly = np.polynomial.Polynomial(rng.normal(size=4) * [0.3, 1.0, 1.0, 1.0])
        ends = np.array([0.0, length])
        (f1, f2), (g1, g2) = poly(ends), poly.deriv()(ends)
        if f1 * f2 <= 0.0:
            continue
        share = cubic_dip.py_func(f1, g1, f2, g2, length)
        grid = np.linspace(0.0, length, 4001)
        least = np.min(np.sign(f1) * poly(grid))
        bound = 0.2 * min(abs(f1), abs(f2))
        if share > 0.0:
            assert np.sign(f1) * poly(share * length) == pytest.approx(least, abs=1e-6)
            assert least < bound
            checked += 1
        else:
            assert least > bound - 1e-6
    assert checked >= 5


@pytest.mark.parametrize("seed", range(20))
def test_two_folds_within_a_step(seed: int) -> None:
    """A parameter that turns twice, by the values and slopes at both ends alone."""
    rng = np.random.default_rng(seed)
    checked = 0
    for _ in range(200):
        slope = np.polynomial.Polynomial(rng.normal(size=3) * [0.2, 1.0, 1.5])
        s1, s2 = slope(0.0), slope(1.0)
        turns = [r.real for r in slope.roots() if abs(r.imag) < 1e-9 and 0.0 < r.real < 1.0]
        share = mean_dip.py_func(s1, s2, slope.integ()(1.0))
        if len(turns) == 2 and s1 * s2 > 0.0:
            assert min(turns) < share < max(turns)
            checked += 1
        elif share > 0.0:  # near to it
            assert abs(slope(share)) < 0.2 * min(abs(s1), abs(s2))
    assert checked >= 2
