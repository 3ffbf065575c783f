"""The derivative of a turn in balls has the multipliers of the engine; pairs on the circle are told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from flint import arb, arb_mat

import contfric as cf
from contfric.certify.equations.chain import Chain, segments_of
from contfric.certify.equations.monodromy import monodromy
from contfric.certify.tubes.circle import no_pair
from contfric.models.balls.build import ball_model
from contfric.models.balls.numbers import Vector, working
from contfric.orbit.orbit import Orbit


def balls(orbit: Orbit, radius: float = 0.0) -> Vector:
    return [arb(float(x), radius) for x in orbit.joints.ravel()]


def of_turn(orbit: Orbit, radius: float = 0.0) -> arb_mat | None:
    model = replace(ball_model(orbit.model, orbit.params), slopes=None)
    chain = Chain(segments_of(orbit.system), model)
    return monodromy(chain, chain.joints(balls(orbit, radius)))


def centres(matrix: arb_mat) -> np.ndarray:
    return np.array([[float(x.mid()) for x in row] for row in matrix.tolist()])


#: Sticks, impacts, elements with a memory, symmetric orbits that are solved on their half.
MODELS = (
    "coulomb",
    "impact",
    "jenkins",
    "dead-band",
    "blade-damper",
    "pounding",
    "coulomb-yaml",
)


@pytest.mark.parametrize("name", MODELS)
def test_its_eigenvalues_are_the_multipliers(name: str) -> None:
    """With those of the engine, which are from the elimination of a chain, at random parameters."""
    rng, model, tried = np.random.default_rng(len(name)), cf.load_model(name), 0
    while tried < 4:
        params = {k: v * rng.uniform(0.9, 1.1) for k, v in model.defaults.items()}
        try:
            orbit = cf.find_orbit(
                model, params, state=rng.normal(size=len(model.states)), longest=500
            )
        except cf.ContfricError:
            continue
        tried += 1
        with working(80):
            found = of_turn(orbit)
            wide = of_turn(orbit, 1e-12)
        assert found is not None and wide is not None and wide.contains(found)
        mine = np.linalg.eigvals(centres(found))
        for mu in orbit.turn_multipliers[: len(mine) - len(orbit.resting)]:  # without what is kept
            assert np.min(np.abs(mine - mu)) < 1e-6 * (1.0 + abs(mu)), (orbit, mine)


def test_a_continuous_field_divides_by_no_rate(tmp_path) -> None:
    """Next to a graze of a soft stop the balls are as wide as those of the joints, not of their quotient."""
    spring = {"kind": "spring", "gap": "d - q1", "stiffness": 3.0}
    force, params = {"q1": "cos(w*t)"}, {"w": 2.0, "d": 0.3326}
    beam = cf.Mechanism(
        [[1.0]],
        [[0.1]],
        [[1.0]],
        contacts={"stop": spring},
        force=force,
        parameters=params,
        period="2*pi/w",
    )
    orbit = cf.find_orbit(beam)
    assert len(orbit.joints) > 1  # the stop is met, slowly
    with working(80):
        found = of_turn(orbit, 1e-9)
    assert found is not None
    assert max(float(x.rad()) for x in found.entries()) < 1e-6


@pytest.mark.parametrize("seed", range(6))
def test_a_pair_on_the_circle_is_never_denied(seed: int) -> None:
    rng = np.random.default_rng(seed)
    size = int(rng.integers(3, 7))
    angle = rng.uniform(0.1, 3.0)
    values = np.diag(rng.uniform(-0.9, 0.9, size))
    values[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    basis = rng.normal(size=(size, size))

    def ball(scale: float, radius: float) -> arb_mat:
        block = values.copy()
        block[:2, :2] *= scale
        matrix = basis @ block @ np.linalg.inv(basis)
        return arb_mat([[arb(float(x), radius) for x in row] for row in matrix])

    assert not no_pair(ball(1.0, 1e-12))
    assert not no_pair(ball(0.999, 0.1))  # which the ball has
    assert no_pair(ball(0.9, 1e-9)) and no_pair(ball(1.1, 1e-9))
