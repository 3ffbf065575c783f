"""Homoclinic ends in two parameters: the rimless wheel that just passes upright, in closed form."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from typed import typed

import contfric as cf

PLANE = ("slope", "alpha")
RANGES = {"slope": (0.001, 0.25), "alpha": (0.25, 0.35)}


@cache
def branch() -> cf.Branch:
    return cf.continue_orbit(cf.find_orbit("rimless-wheel"), "slope", (0.001, 0.25))


def exact(alpha: float) -> float:
    """Return the slope at which the wheel has just the speed to pass upright."""
    kept = math.cos(2 * alpha) ** 2

    def spare(slope: float) -> float:
        arrives = 4 * math.sin(alpha) * math.sin(slope) / (1 - kept)
        return kept * arrives - 2 * (1 - math.cos(slope - alpha))

    return float(brentq(spare, 1e-4, 0.2, xtol=1e-15))


def distance(period: float) -> float:
    curve = cf.continue_homoclinic(branch(), PLANE, RANGES, period=period)
    assert len(curve) > 10 and curve.label == f"HOM (period {period:g})"
    assert {end.reason.name for end in curve.ends} == {"RANGE"}
    assert np.array([o.period for o in curve]) == pytest.approx(period, abs=1e-9)
    return max(abs(slope - exact(alpha)) for slope, alpha in curve.values)


def test_curve_comes_to_the_homoclinic_one_exponentially() -> None:
    """The upright wheel has the eigenvalue 1: two units of time more are a factor e^-2 in the parameter."""
    errors = [distance(period) for period in (8.0, 10.0, 12.0, 14.0)]
    assert errors[2] < 5e-6
    for longer, shorter in zip(errors[1:], errors[:-1], strict=True):
        assert longer / shorter == pytest.approx(math.exp(-2.0), rel=0.02)


def test_curve_of_a_long_period() -> None:
    """Solutions part by 1e7 in a period: Newton converges at the ends from the cubic, not from the chord."""
    assert distance(16.0) < 5e-8


def test_curve_near_the_longest_period_of_the_branch() -> None:
    """At its own slope such an orbit is not found again: the period changes by 5e8 of what that does."""
    assert distance(20.0) < 1e-9
    with pytest.raises(cf.ParameterError, match="not one of the branch"):
        cf.continue_homoclinic(branch(), PLANE, RANGES, period=40.0)


KICKED = """
name: kicked
states: [x, v]
parameters: {{c: 0.3, e: {e}, d: 1.0, k: {k}}}
autonomous: true
surfaces: {{wall: {{observable: x, level: d}}}}
modes: {{free: {{in: {{wall: -}}, field: {{x: v, v: x + c*v - 0.3}}}}}}
resets: {{wall: {{v: -e*v - k}}}}
spread: {{x: 1, v: 1}}
"""


def eigenvalues(c: float) -> tuple[float, float]:
    root = math.sqrt(c * c + 4.0)
    return (c + root) / 2.0, (c - root) / 2.0


SMOOTH = """
name: smooth_loop
states: [x, v]
parameters: {mu: -0.9, b: 1.0}
autonomous: true
field: {x: v, v: x - x**2 + mu*v + b*x*v}
spread: {x: 1, v: 1}
"""


def test_a_loop_of_a_smooth_model_has_no_boundary_equilibrium(tmp_path: Path) -> None:
    """Its joints lie on the section on which the rate of x vanishes, as the saddle does."""
    branch = cf.continue_orbit(
        cf.find_orbit(typed(tmp_path, SMOOTH), {}, state=[0.6, 0.0]), "mu", (-0.99, -0.5)
    )
    end = branch.ends[1]
    assert end.reason is cf.EndReason.PERIOD and "boundary" not in str(end)
    assert branch.values[-1] == pytest.approx(
        -0.8645452474, abs=1e-9
    )  # by shooting from the saddle


@pytest.mark.parametrize("seed", range(4))
def test_period_grows_by_the_eigenvalue_that_is_nearer_to_zero(seed: int, tmp_path: Path) -> None:
    """Homoclinic where the wall sends what left the saddle back to it: -e lambda_u a - k = lambda_s a.

    The cycle is repelling, with c > 0: its period grows by the stable eigenvalue.
    """
    draw = np.random.default_rng(seed)
    e, k = float(draw.uniform(0.5, 0.65)), float(draw.uniform(0.05, 0.12))

    def apart(c: float, e: float) -> float:
        unstable, stable = eigenvalues(c)
        return -e * unstable * 0.7 - k - stable * 0.7

    end = float(brentq(apart, -1.0, 1.5, args=(e,), xtol=1e-15))
    assert end > 0.05
    orbit = cf.find_orbit(
        typed(tmp_path, KICKED.format(e=e, k=k)), {"c": end + 0.03}, state=[0.98, 0.0], longest=2000
    )
    ranges = {"c": (end - 1.0, end + 1.0), "e": (0.8 * e, 1.2 * e)}
    found = cf.continue_orbit(orbit, "c", ranges["c"])
    assert cf.EndReason.PERIOD in {side.reason for side in found.ends}
    for period in (
        4.0,
        8.0,
    ):  # a branch stops there, though it ends by its period in the same march
        stopped = cf.continue_orbit(orbit, "c", ranges["c"], stop_at={"period": period})
        assert cf.EndReason.STOP in {side.reason for side in stopped.ends}
        assert max(stopped.period) == pytest.approx(period, abs=1e-9)
    errors = []
    for period in (8.0, 10.0, 12.0, 14.0):
        curve = cf.continue_homoclinic(found, ("c", "e"), ranges, period=period)
        c, at = curve.values[np.argmin(np.abs(curve.values[:, 1] - e))]  # where it begins
        assert at == pytest.approx(e, abs=1e-12)
        errors.append(c - end)
    rates = np.log(np.array(errors[:-1]) / errors[1:]) / 2.0
    assert rates[-1] == pytest.approx(-eigenvalues(end)[1], rel=0.03)


def test_what_is_no_homoclinic_end_is_refused() -> None:
    with pytest.raises(cf.ParameterError, match="not one of the branch"):
        cf.continue_homoclinic(branch(), PLANE, RANGES, period=0.1)
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    other = cf.continue_orbit(orbit, "Omega", (0.49, 0.51))
    with pytest.raises(cf.ParameterError, match="no end of this branch is homoclinic"):
        cf.continue_homoclinic(other, ("Omega", "S"), {"Omega": (0, 1), "S": (0, 1)}, period=20.0)
