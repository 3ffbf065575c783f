"""Steep friction laws next to Coulomb's: what is derived on the page, by integration and by orbits."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import contfric as cf

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))

from coulomb_limit import distances, extrema, holds, released
from coulomb_limit_theory import RELEASE, Law, amplification, amplitudes, interpolated

#: Integrated models from end to end: minutes of processor time, run by `make test-all`.
pytestmark = pytest.mark.slow

WHERE = {"Omega": 0.5, "S": 0.2, "S0": 0.4}
RATE = 0.4


@pytest.mark.parametrize("sigma0", [math.inf, 1e10])
def test_delay_of_a_release(sigma0: float) -> None:
    errors = [
        abs(released(law, RATE) - law.release(RATE)) / law.tau
        for law in (Law(0.2, 0.4, vS, sigma0) for vS in (1e-3, 1e-4))
    ]
    assert errors[1] < 0.03
    assert errors[1] < errors[0] / 2.5  # of the order of epsilon log^2 epsilon, epsilon ~ vS


def test_damping_shortens_the_delay() -> None:
    free, damped = Law(0.2, 0.4, 1e-3, 1e10), Law(0.2, 0.4, 1e-3, 1e10, 2e5)
    found = (released(damped, RATE) - released(free, RATE)) / damped.nu
    derived = (damped.release(RATE) - free.release(RATE)) / damped.nu
    early = math.log(amplification(free.kappa(RATE)))
    assert interpolated(free.kappa(RATE)) == pytest.approx(early, abs=1e-5)
    assert derived == pytest.approx(1.0 - math.log(0.04 / (RATE * 1e-3)) + early, abs=1e-5)
    assert found == pytest.approx(derived, rel=0.03)


def test_stiff_end_of_the_universal_function() -> None:
    """A = 1 + C kappa^(-2/3) + kappa^(-1) (c log kappa + d) + ..., without c and d by three values."""
    kappa = np.array([1e4, 1e5, 1e6])
    found = (np.array([amplification(k) for k in kappa]) - 1.0) * kappa ** (2 / 3)
    weight = np.array([1.0, -2.0, 1.0]) * kappa ** (1 / 3)
    assert weight @ found / weight.sum() == pytest.approx(RELEASE, rel=3e-3)


def test_soft_end_of_the_universal_function() -> None:
    """Log A tends to 2 / sqrt(kappa) from below, by a part that falls like kappa^(1/5)."""
    short = [1.0 - 0.5 * math.sqrt(k) * math.log(amplification(k)) for k in (1e-2, 1e-3)]
    assert short[1] / short[0] == pytest.approx(10**-0.2, rel=0.2)


def test_rebound_of_bristles() -> None:
    """Speed after a stop with load S0, by integration of F and v, without and with damping."""
    sigma0 = 1e6
    for m in (0.0, 0.7, 2.0):
        law = Law(0.2, 0.4, 1e9, sigma0, m * math.sqrt(sigma0))  # g stays S0

        def field(_: float, y: np.ndarray, sigma1: float = law.sigma1) -> list[float]:
            v, z = y
            dz = v - sigma0 * abs(v) / 0.4 * z
            return [0.4 - sigma0 * z - sigma1 * dz, dz]

        run = solve_ivp(field, (0.0, 0.05), [0.0, -0.4 / sigma0], "Radau", rtol=1e-10, atol=1e-13)
        assert run.y[0, -1] == pytest.approx(law.rebound, rel=2e-3)


@pytest.fixture(scope="module")
def limit() -> cf.Orbit:
    return cf.find_orbit("coulomb", WHERE)


def test_closed_form_of_the_limit(limit: cf.Orbit) -> None:
    found = amplitudes(Law(0.2, 0.4, 1.0), 0.5, 400, delays=False)
    assert found == pytest.approx(extrema(limit), abs=1e-11)


def test_stable_orbits_converge_as_derived(limit: cf.Orbit) -> None:
    gaps, left = [], []
    for vS in (0.004, 0.002):
        found = extrema(cf.find_orbit("stribeck", {**WHERE, "vS": vS}))
        gaps.append(found - extrema(limit))
        left.append(found - amplitudes(Law(0.2, 0.4, vS), 0.5, 400))
    # vS log(1 / vS) halves to 1 / 1.64 here, and what the formulas leave is of the second order
    assert gaps[0] / gaps[1] == pytest.approx([1.64, 1.64], abs=0.08)
    assert np.abs(left[1]).max() < 0.03 * np.abs(gaps[1]).max()
    assert np.abs(left[0]).max() > 1.9 * np.abs(left[1]).max()


def test_bridge_of_the_formulas_is_that_of_the_engine() -> None:
    start = cf.find_orbit("coulomb", WHERE)
    diagram = cf.explore(start, "Omega", (0.35, 0.52))
    bridge = next(b for b in diagram.branches if b.bridge and not b.mirrored)
    line = np.column_stack([bridge.values, bridge.x_max, -bridge.x_min])
    points = holds(Law(0.2, 0.4, 1.0), np.linspace(0.0, 1.0, 12), delays=False)
    assert distances(points, line).max() < 2e-5  # the polygon's own error
    again = holds(Law(0.2, 0.4, 1.0), bridge_lengths(bridge), delays=False)
    exact = line[[len(line) // 3, len(line) // 2]]
    assert again == pytest.approx(exact, abs=1e-9)


def bridge_lengths(bridge: cf.Branch) -> np.ndarray:
    """How long the holds at two points of the bridge last."""
    found = []
    for k in (len(bridge) // 3, len(bridge) // 2):
        orbit = bridge[k].as_whole()
        (hold,) = orbit.system.holds
        found.append(bridge[k].ends[hold.segment, 0] - bridge[k].cycle[hold.segment, 0])
    return np.array(found)


def test_page_shows_what_is_computed() -> None:
    docs = Path(__file__).parents[2] / "docs"
    page = (docs / "coulomb-limit.md").read_text()
    law = Law(0.2, 0.4, 0.01)
    row = f"| 0.01 | inf | inf | {released(law, RATE):.5f} | {law.release(RATE):.5f} |"
    assert row in page
    for name in ("release", "stable", "lugre", "meander", "bristles"):
        table = page.split(f"<!-- limit: {name} -->\n")[1].split("<!-- end -->")[0]
        assert len(table.splitlines()) > 4, name
    assert "images/coulomb_limit.png" in page
    assert (docs / "images" / "coulomb_limit.png").exists()
