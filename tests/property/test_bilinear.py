"""A bilinear oscillator: what grazes the contact is followed, though nothing jumps and nothing rests."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from by_scipy import after
from typed import typed

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
    return after(field, start, (0.0, 2 * np.pi / omega), max_step=0.01)


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


BILINEAR = """
name: bilinear
states: [x, v]
parameters: {omega: 0.89, k: 20.634, zeta: 0.04128, gap: -0.0733, A: 1.0545}
period: 2*pi/omega
surfaces:
  contact: {observable: x, level: gap}
  stop: {observable: v}
field: {x: v, v: "-x - 2*zeta*v - k*max(x - gap, 0) + A*cos(omega*t)"}
modes:
  pressed: {in: {contact: +}}
  free: {in: {contact: -}}
"""


def test_a_branch_between_a_doubling_and_a_grazing_is_found_from_both(tmp_path: Path) -> None:
    """It is 2e-5 of the parameter wide: a little farther from the grazing its orbits are of one period."""
    model = typed(tmp_path, BILINEAR)
    for seed in range(3):
        rng = np.random.default_rng([612, seed])
        names = ("k", "zeta", "gap", "A")
        moved = {n: float(model.defaults[n] * rng.uniform(0.98, 1.02)) for n in names}
        orbit = cf.find_orbit(model, moved, longest=1000)
        found = cf.explore(orbit, "omega", (0.88, 0.95), max_periods=2)
        assert not found.loose_ends
        narrow = [b for b in found.branches if np.ptp(b.values) < 1e-4]
        assert [b.system.periods for b in narrow] == [2]
        checked = found.verify(3)  # from the branch beyond the grazing, too
        assert checked.passed, str(checked)
