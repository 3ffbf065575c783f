"""Homoclinic ends in two parameters: the rimless wheel that just passes upright, in closed form."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq

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


def test_what_is_no_homoclinic_end_is_refused() -> None:
    with pytest.raises(cf.ParameterError, match="not one of the branch"):
        cf.continue_homoclinic(branch(), PLANE, RANGES, period=0.1)
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    other = cf.continue_orbit(orbit, "Omega", (0.49, 0.51))
    with pytest.raises(cf.ParameterError, match="no end of this branch is homoclinic"):
        cf.continue_homoclinic(other, ("Omega", "S"), {"Omega": (0, 1), "S": (0, 1)}, period=20.0)
