"""A bilinear oscillator: what grazes the contact is followed, though nothing jumps and nothing rests."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import contfric as cf

MODEL = Path(__file__).parents[1] / "models" / "bilinear.yaml"


@pytest.fixture(scope="module")
def diagram():
    return cf.explore(cf.find_orbit(MODEL, {"omega": 0.8}), "omega", (0.75, 0.95))


@pytest.mark.slow
def test_there_are_no_loose_ends(diagram):
    assert [str(end) for end in diagram.loose_ends] == []
    grazing = [b for b in diagram.bifurcations if b.kind in (cf.Kind.CS, cf.Kind.GS)]
    assert min(abs(b.params["omega"] - 0.825048765741) for b in grazing) < 1e-11
    names = {b.name for b in diagram.branches}
    assert len(names) >= 4  # with and without a second contact, and doubled


def period_map(start, omega):
    def field(t, y):
        force = 20.0 * max(y[0], 0.0)
        return y[1], -y[0] - 0.1 * y[1] - force + np.cos(omega * t)

    # the kink at contact is passed with small steps: the field is continuous there
    found = solve_ivp(
        field,
        (0.0, 2 * np.pi / omega),
        start,
        method="DOP853",
        rtol=1e-11,
        atol=1e-12,
        max_step=0.01,
    )
    return found.y[:, -1]


def test_the_doubling_is_one(diagram):
    doubling = next(
        b
        for b in diagram.bifurcations
        if b.kind is cf.Kind.PD and b.orbit.periods == 1 and b.params["omega"] < 0.92
    )
    omega, orbit = doubling.params["omega"], doubling.orbit
    start = orbit.state(0.0)
    assert np.abs(period_map(start, omega) - start).max() < 1e-8
    step = 1e-5
    columns = [
        (period_map(start + step * e, omega) - period_map(start - step * e, omega)) / (2 * step)
        for e in np.eye(2)
    ]
    multipliers = np.linalg.eigvals(np.array(columns).T)
    assert np.abs(multipliers + 1.0).min() < 1e-4
