"""Where contacts rest that never slip: random structures against linear algebra, and against simulations."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from two_masses import stuck_next_to_a_gap

import contfric as cf
from contfric.base.arrays import FloatArray
from contfric.models.definition import Model
from contfric.orbit.orbit import Orbit


def _structure(
    seed: int, contacts: int
) -> tuple[Model, list[str], tuple[FloatArray, FloatArray, FloatArray]]:
    """Return a random chain with friction that sticks on some masses, its contacts and matrices."""
    rng = np.random.default_rng(seed)
    n = contacts + int(rng.integers(1, 3))
    k = rng.uniform(0.5, 2.0, n + 1)
    stiffness = np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)
    damping, forces = 0.1 * stiffness, rng.uniform(-0.3, 0.3, n)
    rubbing = sorted(rng.choice(n, contacts, replace=False).tolist())
    model = cf.Mechanism(
        np.eye(n),
        damping,
        stiffness,
        contacts={
            f"c{i + 1}": {
                "kind": "friction",
                "velocity": f"v{i + 1}",
                "kinetic": 2.0,
                "static": 2.0,
            }
            for i in rubbing
        },
        force={f"q{i + 1}": f"{f}*cos(w*t)" for i, f in enumerate(forces)},
        parameters={"w": float(rng.uniform(0.3, 2.5))},
        period="2*pi/w",
    )
    return model, [f"c{i + 1}" for i in rubbing], (damping, stiffness, forces)


def _expected(
    model: Model,
    damping: FloatArray,
    stiffness: FloatArray,
    forces: FloatArray,
    at: dict[str, float],
) -> list[tuple[float, float]]:
    """Return the interval of each contact by the static and the harmonic solution of the masses that move."""
    stuck = [int(name[1:]) - 1 for name in at]
    free = [i for i in range(len(forces)) if i not in stuck]
    w, places = model.defaults["w"], np.array(list(at.values()))
    inner, across = np.ix_(free, free), np.ix_(stuck, free)
    dynamic = stiffness[inner] + 1j * w * damping[inner] - w**2 * np.eye(len(free))
    moving = np.linalg.solve(dynamic, forces[free])
    wave = np.abs(forces[stuck] - (stiffness + 1j * w * damping)[across] @ moving)
    reduced = stiffness[np.ix_(stuck, stuck)] - stiffness[across] @ np.linalg.solve(
        stiffness[inner], stiffness[across].T
    )
    found, mean, room = [], -reduced @ places, 2.0 - wave
    for k in range(len(stuck)):
        slopes = -reduced[:, k]
        with np.errstate(divide="ignore"):  # those that do not feel it set no limit
            ends = np.array([(s * room - mean) / slopes for s in (-1.0, 1.0)])
        found.append((float(ends.min(axis=0).max()), float(ends.max(axis=0).min())))
    return [(p + low, p + high) for p, (low, high) in zip(places, found, strict=True)]


@pytest.mark.parametrize(
    ("seed", "contacts"),
    [
        pytest.param(*case, marks=[] if case == (1, 3) else pytest.mark.slow)
        for case in itertools.product(range(3), (1, 2, 3))
    ],
)
def test_intervals_are_those_of_linear_algebra(seed: int, contacts: int) -> None:
    model, names, matrices = _structure(seed, contacts)
    rng = np.random.default_rng(seed)
    at = {name: float(rng.uniform(-0.2, 0.2)) for name in names}
    orbit = cf.find_orbit(model, at=at)
    assert orbit.converged
    assert orbit.admissible
    assert {r.contact: r.value for r in orbit.resting} == pytest.approx(at, abs=1e-12)
    found = [(r.lower, r.upper) for r in orbit.resting]
    for own, expected in zip(found, _expected(model, *matrices, at), strict=True):
        assert own == pytest.approx(expected, abs=1e-10)


def _kept_by_simulation(orbit: Orbit, contact: str, by: float) -> bool:
    """Tell whether the solution from an orbit's state, with one contact moved, leaves the contact there."""
    model, i, whole = orbit.model, int(contact[1:]) - 1, orbit.as_whole()
    lasts = whole.ends[:, 0] - whole.cycle[:, 0]
    k = int(np.argmax(lasts))
    time = float(whole.cycle[k, 0] + 0.5 * lasts[k])
    state = orbit.state(time)
    state[i] += by
    state[len(state) // 2 + i] = 0.0
    end = cf.simulate(model, orbit.params, state=state, time=time, periods=60)
    return bool(abs(float(end.states[-1, i]) - state[i]) < 1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_ends_are_those_of_simulations_where_a_gap_closes_on_the_way(seed: int) -> None:
    """Another mass meets a spring for some positions: the interval goes on with other segments."""
    rng = np.random.default_rng(seed)
    gap = float(rng.uniform(0.15, 0.3))
    model = stuck_next_to_a_gap(rng, gap)
    orbit = cf.find_orbit(model, at={"c1": 0.0})
    (rests,) = orbit.resting
    assert rests.limits == ("c1+", "c1-")
    for end, out in ((rests.lower, -1.0), (rests.upper, 1.0)):
        near = orbit.resting_at({"c1": end - out * 1e-6})
        assert near.admissible
        assert _kept_by_simulation(near, "c1", 0.0)
        assert not _kept_by_simulation(near, "c1", out * 2e-5)
    closed = [mode[1] == "c" for mode, _ in orbit.resting_at({"c1": rests.upper - 1e-6}).itinerary]
    assert any(closed)
    assert not any(mode[1] == "c" for mode, _ in orbit.itinerary)


def test_ten_contacts_rest_where_they_are_put() -> None:
    """Modes that are made when they are visited."""
    n = 6
    stiffness = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    contacts = {
        f"c{i}": {
            "kind": "friction",
            "velocity": f"v{i}",
            "kinetic": 0.5,
            "static": 0.6,
            "at": "0.1*a",
        }
        for i in range(1, n)
    }
    model = cf.Mechanism(
        np.eye(n),
        0.1 * stiffness,
        stiffness,
        contacts=contacts,
        force={f"q{n}": "0.2*cos(w*t)"},
        parameters={"w": 0.7, "a": 0.5},
        period="2*pi/w",
    )
    orbit = cf.find_orbit(model, {"a": -0.8}, at={"c2": 0.04})
    assert {r.contact: r.value for r in orbit.resting} == pytest.approx(
        {f"c{i}": 0.04 if i == 2 else -0.08 for i in range(1, n)}, abs=1e-13
    )
    # c2 carries 2 q2 - q1 - q3, and its neighbours 2 (-0.08) - q2 - (-0.08) or less
    (second,) = [r for r in orbit.resting if r.contact == "c2"]
    assert (second.lower, second.upper) == pytest.approx((-0.38, 0.22), abs=1e-12)


def test_a_start_at_rest_is_in_a_domain() -> None:
    """A contact sticks there and the gap of a spring stands still: what its rate does next says where."""
    model = cf.Mechanism(
        np.eye(2),
        0.1 * np.eye(2),
        [[2.0, -1.0], [-1.0, 2.0]],
        contacts={
            "c1": {"kind": "friction", "velocity": "v1", "kinetic": 2.0, "static": 2.0},
            "stop": {"kind": "spring", "gap": "3 - q2", "stiffness": 2.0},
        },
        force={"q2": "a*cos(w*t)"},
        parameters={"w": 0.7, "a": 0.15},
        period="2*pi/w",
    )
    for a in (0.15, -0.15):
        assert len(cf.simulate(model, {"a": a}, state=[0.05, 0.0, 0.0, 0.0], periods=3))


def test_what_cannot_be_is_refused_in_one_line() -> None:
    model, (name,), *_ = _structure(0, 1)
    orbit = cf.find_orbit(model)
    with pytest.raises(cf.ParameterError, match=rf"'{name}' may rest with q\d in \[.*\], not at 9"):
        orbit.resting_at({name: 9.0})
    with pytest.raises(cf.ParameterError, match="has no contact 'brake' with a position of rest"):
        cf.find_orbit(model, at={"brake": 0.0})
    with pytest.raises(cf.ParameterError, match="finite number"):
        cf.find_orbit(model, at={name: "here"})  # type: ignore[dict-item]
    with pytest.raises(cf.ParameterError, match="'weak' has no position of rest along the orbit"):
        cf.find_orbit("iwan", {"F": 1.0}, at={"weak": 0.0})


def test_a_place_follows_a_parameter_that_is_tied() -> None:
    stiffness, names = [[2.0, -1.0], [-1.0, 2.0]], {"w": 0.7, "S": 0.5, "S0": 0.6}
    brake = {"kind": "friction", "velocity": "v1", "kinetic": "S", "static": "S0", "at": "0.2*S0"}
    asked = {"contacts": {"brake": brake}, "parameters": names, "period": "2*pi/w"}
    model = cf.Mechanism(
        np.eye(2), 0.1 * np.eye(2), stiffness, force={"q2": "0.2*cos(w*t)"}, **asked
    )
    (rests,) = cf.find_orbit(model, {"S": 0.4, "S0": {"tie": "1.5*S"}}).resting
    assert rests.value == pytest.approx(0.2 * 1.5 * 0.4, abs=1e-14)
