"""Lyapunov exponents of solutions that begin at rest: a mode of rest forgets states, whichever they are."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

import contfric as cf
from contfric.base.resources import bundled_dir

CONTACTS = {
    "a": {"kind": "friction", "velocity": "v1", "kinetic": "S", "static": "S0"},
    "b": {"kind": "friction", "velocity": "v2", "kinetic": "S", "static": "S0"},
    "pad": {"kind": "jenkins", "displacement": "q1 - q2", "stiffness": "kd", "limit": "S"},
}


@pytest.mark.parametrize("names", list(itertools.combinations(CONTACTS, 2)), ids=" ".join)
def test_exponents_are_those_of_the_orbit_that_is_found(names: tuple[str, ...]) -> None:
    """Rest forgets the velocity of its own contact, and the exponents are those of the multipliers."""
    structure = cf.Mechanism(
        np.diag([1.0, 1.7]),
        np.array([[0.1, 0.0], [0.0, 0.15]]),
        np.array([[2.0, -1.0], [-1.0, 1.4]]),
        contacts={name: CONTACTS[name] for name in names},
        force={"q1": "F*cos(Omega*t)"},
        parameters={"Omega": 0.7, "S": 0.1, "S0": 0.13, "kd": 0.4, "F": 1.0},
        period="2*pi/Omega",
    )
    for displaced in np.random.default_rng(7).uniform(-0.1, 0.1, (6, 2)):
        state = np.zeros(len(structure.states))
        state[:2] = displaced
        found = cf.lyapunov_exponent(structure, state=state)
        orbit = cf.find_orbit(structure, state=state)
        assert found.motion is cf.Motion.PERIODIC
        sizes = np.sort(np.abs(orbit.multipliers))[::-1]
        kept = sizes > 1e-12
        expected = np.log(sizes[kept]) / orbit.period
        np.testing.assert_allclose(found.exponents[kept], expected, rtol=0.0, atol=1e-7)


def test_the_order_of_states_does_not_matter(tmp_path: Path) -> None:
    """Rest keeps the displacement, which is not the first state here; chaotic, from a start that sticks."""
    text = (bundled_dir("models") / "coulomb-yaml.yaml").read_text(encoding="utf-8")
    path = tmp_path / "turned.yaml"
    path.write_text(text.replace("states: [x, v]", "states: [v, x]"), encoding="utf-8")
    limits, params = {"periods": 200, "transient": 20}, {"Omega": 0.35, "S": 0.05, "S0": 0.4}
    turned = cf.lyapunov_exponent(cf.load_model(path), params, state=[0.0, 0.9], **limits)
    usual = cf.lyapunov_exponent("coulomb", params, state=[0.9, 0.0], **limits)
    assert turned.motion is usual.motion is cf.Motion.CHAOTIC
    assert turned.largest > 0.0
