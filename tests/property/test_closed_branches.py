"""Closed branches: orbits of several periods come back whole periods of the excitation later or earlier."""

import numpy as np
import pytest

import contfric as cf

POPP = {"omega": 1.72, "F": 0.1, "a0": 1.5, "a1": 1.5, "a2": 0.45}


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("vary", ["a1", "a2"])
def test_the_phase_may_turn_along_a_closed_branch(seed: int, vary: str) -> None:
    """The branch of period 2 is closed, and its orbits move by one period on the way round."""
    rng = np.random.default_rng([seed, 20])
    params = {name: value * (1.0 + rng.uniform(-0.005, 0.005)) for name, value in POPP.items()}
    orbit = cf.find_orbit("popp", params)
    assert round(orbit.period * params["omega"] / (2.0 * np.pi)) == 2

    branch = cf.continue_orbit(
        orbit, vary, (0.5 * params[vary], 2.0 * params[vary]), max_points=600
    )

    assert {end.reason for end in branch.ends} == {cf.EndReason.CLOSED}
    moved = (branch.joints[-1, 0, 0] - branch.joints[0, 0, 0]) * params["omega"] / (2.0 * np.pi)
    assert abs(moved) == pytest.approx(1.0, abs=0.05)
    # once round: both folds, once each
    kinds = [b.kind for b in branch.bifurcations]
    assert kinds.count(cf.Kind.SN) == 2 and kinds.count(cf.Kind.PD) in (0, 2)


@pytest.mark.parametrize("seed", range(3))
def test_subharmonics_of_a_smooth_oscillator_are_closed(seed: int, tmp_path) -> None:  # type: ignore[no-untyped-def]
    """The frequency varies: the period of the excitation at the end of a step is not that at its start."""
    file = tmp_path / "duffing.yaml"
    file.write_text(
        "name: duffing\nstates: [x, v]\nparameters: {w: 4.5, zeta: 0.02, A: 10}\nperiod: 2*pi/w\n"
        "field: {x: v, v: -x - x**3 - 2*zeta*v + A*cos(w*t)}\n",
        encoding="utf-8",
    )
    rng = np.random.default_rng([seed, 21])
    for _ in range(40):
        params = {"w": rng.uniform(4, 9), "zeta": rng.uniform(0.01, 0.02), "A": rng.uniform(8, 15)}
        try:
            orbit = cf.find_orbit(file, params, state=rng.uniform(-4, 4, 2), longest=6)
        except cf.ContfricError:
            continue
        if round(orbit.period * params["w"] / (2.0 * np.pi)) == 3:
            break
    else:
        pytest.fail("no start leads to an orbit of period 3")
    branch = cf.continue_orbit(orbit, "w", (0.5, 40.0), max_points=600)
    assert {end.reason for end in branch.ends} == {cf.EndReason.CLOSED}
    w = branch.params["w"]
    assert np.count_nonzero(np.diff(np.sign(np.diff(w)))) == 2
