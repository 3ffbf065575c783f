"""Starts at angles beyond a turn, and excitations whose period is not that of the model."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contfric as cf

BENT = """
name: bent
states: [x, v]
parameters: {{Omega: 0.7, W: 0.7, z: 0.1, k: 2.0, F: 1.0, n: 1}}
period: {period}
surfaces: {{wall: {{observable: {observable}, level: 1.0}}}}
field: {{x: v, v: "-x - 2*z*v + F*{force} - k*max(x - 1, 0)"}}
modes: {{free: {{in: {{wall: -}}}}, touch: {{in: {{wall: +}}}}}}
"""
TURNS = """
name: turns
states: [phi, w]
parameters: {a: 1.3, d: 0.4, W: 0.9}
period: 2*pi/W
angles: [phi]
surfaces: {stop: {observable: w}}
field: {phi: w, w: -d*w - sin(phi) + a*cos(W*t)}
modes: {cw: {in: {stop: +}}, ccw: {in: {stop: -}}}
"""


def bent(tmp_path: Path, period: str, force: str, observable: str = "x") -> Path:
    path = tmp_path / "bent.yaml"
    path.write_text(BENT.format(period=period, force=force, observable=observable))
    return path


@pytest.mark.parametrize("seed", range(5))
def test_another_period_is_said_before_anything_is_solved(seed: int, tmp_path: Path) -> None:
    """Phases are taken modulo the period: what is found would be a solution of no equation."""
    rng = np.random.default_rng(seed)
    ratio = float(rng.uniform(0.3, 3.0))
    if abs(ratio - round(ratio)) < 0.02:
        ratio += 0.1
    path = bent(tmp_path, "2*pi/Omega", f"cos({ratio:.6f}*Omega*t)")
    grid = {"x": [0.0, 0.5], "v": [0.0, 0.5]}
    tasks: tuple[Any, ...] = (
        lambda: cf.find_orbit(path),
        lambda: cf.simulate(path, periods=3),
        lambda: cf.sweep(path, "z", [0.1, 0.2]),
        lambda: cf.poincare(path),
        lambda: cf.basins(path, grid),
        lambda: cf.solve_orbit(path, cf.find_orbit(bent(tmp_path, "2*pi", "cos(t)")).signature),
    )
    for task in tasks[:5]:
        with pytest.raises(cf.ParameterError, match="'bent' is not the same one period") as raised:
            task()
        assert "\n" not in str(raised.value) and "Omega = 0.7" in str(raised.value)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_multiples_and_common_periods_are_none(n: int, tmp_path: Path) -> None:
    path = bent(tmp_path, "2*pi/Omega", "cos(n*Omega*t)")
    orbit = cf.find_orbit(path, {"n": n})
    assert orbit.converged and cf.continue_orbit(orbit, "Omega", (0.69, 0.71)).stable.any()
    with pytest.raises(cf.ParameterError, match="one period"):
        cf.find_orbit(path, {"n": n + 0.5})
    with pytest.raises(cf.ParameterError, match="one period"):
        cf.continue_orbit(orbit, "n", (0.5, 3.5))


def test_a_period_that_is_another_along_a_branch(tmp_path: Path) -> None:
    """At the defaults W is Omega."""
    orbit = cf.find_orbit(bent(tmp_path, "2*pi/Omega", "cos(W*t)"))
    for name in ("Omega", "W"):
        with pytest.raises(cf.ParameterError, match="common period of everything"):
            cf.continue_orbit(orbit, name, (0.6, 0.8))
    assert cf.continue_orbit(orbit, "z", (0.09, 0.11)).stable.any()


def test_an_observable_of_another_period(tmp_path: Path) -> None:
    path = bent(tmp_path, "2*pi/Omega", "cos(Omega*t)", "x - 0.1*cos(0.4*t)")
    with pytest.raises(cf.ParameterError, match=r"observable .* is not the same one period"):
        cf.find_orbit(path)


@pytest.mark.parametrize("turn", [-3, -1, 1, 2])
def test_an_angle_may_be_given_in_any_turn(turn: int, tmp_path: Path) -> None:
    path, rng = tmp_path / "turns.yaml", np.random.default_rng(5)
    path.write_text(TURNS)
    for _ in range(3):
        phi, w = rng.uniform(-3.0, 3.0), rng.uniform(-1.0, 1.0)
        here, there = (
            cf.simulate(path, state=(phi + 2 * np.pi * k, w), periods=2).last[2] for k in (0, turn)
        )
        np.testing.assert_allclose(there, here, atol=1e-10)
    grid = {"phi": np.array([-2.0, 0.4, 2.5]), "w": np.array([0.1, 0.7])}
    moved = grid | {"phi": grid["phi"] + 2 * np.pi * turn}
    found = [cf.basins(path, starts) for starts in (grid, moved)]
    assert np.array_equal(found[0].labels, found[1].labels)
    assert found[0].labels.max() >= 0
    swept = [
        cf.sweep(path, "a", [1.2, 1.3], state=(1.0 + 2 * np.pi * k, 0.2)).to_dataframe()
        for k in (0, turn)
    ]
    np.testing.assert_allclose(swept[0]["phi"], swept[1]["phi"], atol=1e-9)


@pytest.mark.parametrize("state", [[0.5, 1.0], [0.3, 1.0], [9.0, -2.0]])
def test_a_state_that_is_in_no_domain_is_told_its_distances(tmp_path, state) -> None:
    path = tmp_path / "hopper.yaml"
    path.write_text(
        "name: hopper\nstates: [x, v]\nparameters: {w: 1.5, d: 0.3}\nperiod: 2*pi/w\nsurfaces: {wall: "
        "{observable: x, level: d}}\nmodes: {free: {in: {wall: -}, field: {x: v, v: -x - 0.1*v + "
        "cos(w*t)}}}\nresets: {wall: {v: -0.8*v}}\n"
    )
    off = f"{state[0] - 0.3:+.3g}".replace("+", r"\+")
    with pytest.raises(
        cf.ParameterError, match=rf"in no domain of hopper\. .*wall: {off}[,;] .*no mode"
    ):
        cf.simulate(path, state=state)
