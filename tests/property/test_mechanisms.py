"""Structures with contacts: each mode obeys the equations of motion and the laws of its contacts."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import mmwrite
from scipy.sparse import csr_matrix

import contfric as cf
from contfric.errors import ModelError
from contfric.models.described.evaluate import floats

PARAMETERS = {"Omega": 0.9, "S": 0.25, "S0": 0.3, "F": 1.1, "kd": 1.7, "e": 0.6}
#: Directions of contacts that act on masses of their own where the mass matrix is diagonal.
FRICTION = {"brake": ("v1 - 0.2*cos(Omega*t)", {0: 1.0}), "pad": ("2*v2 - v3", {1: 2.0, 2: -1.0})}


def random_structure(seed: int) -> tuple[cf.Model, dict[str, np.ndarray]]:
    """Return four masses with two friction contacts, a Jenkins element, a spring and a wall."""
    rng = np.random.default_rng(seed)
    mass = np.diag(rng.uniform(0.5, 2.0, 4))
    damping, stiffness = (m @ m.T for m in rng.normal(size=(2, 4, 4)))
    contacts = {
        name: {"kind": "friction", "velocity": velocity, "kinetic": "S", "static": "S0"}
        for name, (velocity, _) in FRICTION.items()
    }
    contacts |= {
        "jk": {"kind": "jenkins", "displacement": "q1 - q4", "stiffness": "kd", "limit": "S"},
        "pad2": {"kind": "spring", "gap": "0.3 - q3 + q4", "stiffness": "3*kd"},
        "wall": {"kind": "impact", "gap": "1.5 - q4 + 0.1*sin(Omega*t)", "restitution": "e"},
    }
    model = cf.Mechanism(
        mass,
        damping,
        stiffness,
        contacts=contacts,
        force={"q1": "F*cos(Omega*t)", "q3": "0.2*F*sin(Omega*t)"},
        parameters=PARAMETERS,
        period="2*pi/Omega",
        name=f"random-{seed}",
    )
    return model, {"M": mass, "C": damping, "K": stiffness}


def pulls(letters: dict[str, str], y: np.ndarray) -> np.ndarray:
    """Return the forces of all contacts but those that stick, from their laws."""
    q, z = y[:4], y[8]
    found = -PARAMETERS["kd"] * z * np.array([1.0, 0.0, 0.0, -1.0])
    if letters["pad2"] == "c":
        gap = 0.3 - q[2] + q[3]
        found += -3.0 * PARAMETERS["kd"] * gap * np.array([0.0, 0.0, -1.0, 1.0])
    for name, (_, direction) in FRICTION.items():
        sign = {"p": -1.0, "n": 1.0, "s": 0.0}[letters[name]]
        for i, w in direction.items():
            found[i] += sign * PARAMETERS["S"] * w
    return found


@pytest.mark.slow
@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_every_mode_obeys_the_equations_of_motion(seed: int) -> None:
    model, parts = random_structure(seed)
    evaluator = floats(model.description)
    rng, omega, checked = np.random.default_rng(seed + 1), PARAMETERS["Omega"], 0
    for mode in model.modes:
        states = mode.name.removesuffix("-")  # where nothing acts the mode is divided by a section
        letters = dict(zip((*FRICTION, "jk", "pad2"), states, strict=True))
        t, y = float(rng.uniform(0.0, 7.0)), rng.normal(size=9)
        rates = np.array(evaluator.field(mode.name, PARAMETERS, t, list(map(float, y))))
        v, a = y[4:8], rates[4:8]
        force = np.array([np.cos(omega * t), 0.0, 0.2 * np.sin(omega * t), 0.0]) * PARAMETERS["F"]
        rest = parts["M"] @ a + parts["C"] @ v + parts["K"] @ y[:4] - force - pulls(letters, y)
        assert np.allclose(rates[:4], v)
        assert rates[8] == pytest.approx(v[0] - v[3] if letters["jk"] == "s" else 0.0)
        for name, (_, direction) in FRICTION.items():
            w = np.array([direction.get(i, 0.0) for i in range(4)])
            if letters[name] == "s":  # the velocity keeps the given one; the multiplier is the load
                given_rate = -0.2 * omega * np.sin(omega * t) if name == "brake" else 0.0
                assert w @ a == pytest.approx(given_rate, abs=1e-11)
                load = evaluator.height(f"{name}+", PARAMETERS, t, list(map(float, y))) + 0.3
                closed = letters["pad2"] == "c" and name == "pad"
                if not closed:
                    rest += w * load
                else:
                    other = evaluator.height(f"{name}+pad2", PARAMETERS, t, list(map(float, y)))
                    rest += w * (other + 0.3)
                checked += 1
        assert np.max(np.abs(rest)) < 1e-10
    assert len(model.modes) == 54 + 1
    assert checked == 36 + 2


@pytest.mark.parametrize("seed", range(4))
def test_derivatives_of_a_slide_are_those_of_its_values_beside_its_surfaces(seed: int) -> None:
    model, _ = random_structure(seed)
    draw, every = np.random.default_rng(seed), np.arange(len(model.parameter_names))
    n, slides = (
        len(model.states),
        [name for name in model.mode_by_name if "s" in name[:2]],
    )
    assert slides
    for name in draw.choice(slides, min(len(slides), 6), replace=False):
        m, p = model.mode_index[str(name)], model.vector({}) * draw.uniform(0.9, 1.1, len(every))
        x = np.array([draw.uniform(0.0, 3.0), *draw.normal(size=n), draw.uniform(0.2, 2.0), *p])
        end, jac = np.empty(n), np.empty((n, 2 + n + len(every)))
        model.flow.flow(m, x[0], x[1 : 1 + n].copy(), x[1 + n], p, every, end, jac)
        for j in range(len(x)):
            h = 1e-5 * max(1.0, abs(x[j]))
            ends = [_moved(model, m, x + side * h * np.eye(len(x))[j]) for side in (1.0, -1.0)]
            slope = (ends[0] - ends[1]) / (2.0 * h)
            assert np.max(np.abs(slope - jac[:, j])) <= 1e-6 * (1.0 + np.max(np.abs(jac[:, j])))


def _moved(model: cf.Model, m: int, x: np.ndarray) -> np.ndarray:
    """Return the end of a solution from its start, duration and parameters, in one vector."""
    n = len(model.states)
    end, none, nothing = np.empty(n), np.empty(0, dtype=np.int64), np.empty((0, 0))
    model.flow.flow(m, x[0], x[1 : 1 + n].copy(), x[1 + n], x[2 + n :].copy(), none, end, nothing)
    return end


def test_one_mass_is_the_oscillator_of_the_article() -> None:
    contacts = {"brake": {"kind": "friction", "velocity": "v1", "kinetic": "S", "static": "S0"}}
    model = cf.Mechanism(
        [[1.0]],
        [["2*zeta"]],
        [[1.0]],
        contacts=contacts,
        force={"q1": "cos(Omega*t)"},
        parameters={"Omega": 0.5, "S": 0.32, "S0": 0.4, "zeta": 0.0},
        constraints=["S0 >= S"],
        period="2*pi/Omega",
    )
    params = {"Omega": 0.52, "S": 0.32, "S0": 0.4, "zeta": 0.03}
    mine, theirs = cf.find_orbit(model, params), cf.find_orbit("coulomb", params)
    assert mine.x_max == pytest.approx(theirs.x_max, rel=1e-11)
    assert sorted(map(abs, mine.multipliers)) == pytest.approx(
        sorted(map(abs, theirs.multipliers)), abs=1e-10
    )
    assert model.symmetry is not None


@pytest.mark.parametrize(
    ("load", "symmetric"),
    [
        ("R", True),
        ("R/(1 + abs(v1))", True),
        ("R*(1 + 0.2*cos(2*w*t))", True),
        ("R*(1 + 0.2*cos(w*t))", False),
        ("R*exp(0.3*q2)", False),
        ("R*pressed", False),
    ],
)
def test_a_load_that_differs_half_a_period_later_leaves_no_symmetry(
    load: str, symmetric: bool
) -> None:
    model = cf.Mechanism(
        [1.0, 0.5],
        0.1 * np.eye(2),
        [[2.0, -1.0], [-1.0, 2.0]],
        contacts={"pad": {"kind": "friction", "velocity": "v1", "kinetic": load}},
        force={"q1": "cos(w*t)"},
        parameters={"w": 0.8, "R": 0.3},
        period="2*pi/w",
        define={"pressed": "1 + 0.1*q2"},
    )
    assert (model.symmetry is not None) == symmetric


def test_a_jenkins_element_is_that_of_its_equations() -> None:
    contacts = {"z": {"kind": "jenkins", "displacement": "q1", "stiffness": "kt", "limit": "muN"}}
    model = cf.Mechanism(
        [[1.0]],
        [["2*zeta"]],
        [["k"]],
        contacts=contacts,
        force={"q1": "F*cos(W*t)"},
        parameters={"W": 0.9, "F": 1.0, "k": 1.0, "kt": 2.0, "zeta": 0.02, "muN": 0.8},
        period="2*pi/W",
    )
    mine, theirs = cf.find_orbit(model, {}), cf.find_orbit("jenkins", {})
    assert mine.x_max == pytest.approx(theirs.x_max, rel=1e-10)


def test_a_wall_is_that_of_its_equations() -> None:
    impact = cf.load_model("impact")
    orbit = cf.find_orbit(impact, {})
    assert orbit.stable
    contacts = {"wall": {"kind": "impact", "gap": "1 - q1", "restitution": "r"}}
    model = cf.Mechanism(
        [["m"]],
        [[0.1]],
        [["k"]],
        contacts=contacts,
        force={"q1": "cos(w*t)"},
        parameters={"w": 2.2, "m": 1.3, "k": 1.0, "r": 0.7},
        period="2*pi/w",
    )
    view = model.view(model.vector({}))
    for v in (0.3, 1.7):
        assert view.reset("wall", 0.2, np.array([1.0, v]))[1] == pytest.approx(-0.7 * v)


def test_two_masses_that_hit_each_other_keep_their_momentum() -> None:
    contacts = {"pound": {"kind": "impact", "gap": "0.2 + q2 - q1", "restitution": 0.5}}
    model = cf.Mechanism(
        np.diag([1.0, 3.0]),
        0.02 * np.eye(2),
        np.diag([1.0, 4.0]),
        contacts=contacts,
        force={"q1": "cos(w*t)", "q2": "cos(w*t)"},
        parameters={"w": 0.8},
        period="2*pi/w",
    )
    before = np.array([0.5, 0.3, 1.1, -0.4])
    after = model.view(model.vector({})).reset("pound", 0.0, before)
    assert after[2] + 3.0 * after[3] == pytest.approx(before[2] + 3.0 * before[3])
    assert after[3] - after[2] == pytest.approx(-0.5 * (before[3] - before[2]))
    orbit = cf.find_orbit(model, {})
    assert orbit.admissible


RUBS = {"kind": "friction", "velocity": "v1", "kinetic": "S"}
ELEMENT = {"kind": "jenkins", "displacement": "2*q1", "stiffness": "k", "limit": "S"}
SPRING = {"kind": "spring", "gap": "1 - q1", "stiffness": "k"}
WALL = {"kind": "impact", "gap": "1 - q1", "restitution": 0.5}

WRONG: list[tuple[dict[str, Any], str]] = [
    ({"mass": [[1.0, 0.5], [0.0, 1.0]]}, "a mass matrix is symmetric"),
    (
        {"mass": [[1.0, 2.0], [2.0, 1.0]]},
        "positive definite; the smallest eigenvalue of this one is -1",
    ),
    ({"mass": [[1.0, 0.0], [0.0, 0.0]]}, "leave out coordinates without mass"),
    ({"mass": [["m", 0.1], [0.1, 1.0]]}, "parameters cannot stand in it"),
    ({"mass": [1.0, 2.0, 3.0]}, "'mass' is a matrix of 2 rows of 2"),
    ({"mass": [1.0, 2.0, 3.0]}, "it has 3 rows, and there are 2 coordinates"),
    ({"stiffness": [[1.0, "k"], [0.0]]}, "row 2 is"),
    ({"stiffness": np.eye(2) * (1.0 + 1.0j)}, "stiffness -> 0 -> 0: an entry of 'stiffness'"),
    ({"contacts": {"a": WALL | {"gap": "1 - v1"}}}, "made of coordinates, .* such as 0.1 - q1"),
    ({"force": {"q3": "1"}}, "unknown key 'q3'"),
    (
        {"contacts": {"a": {"kind": "glue", "velocity": "v1"}}},
        "'kind' has no 'glue'. Valid: friction, jenkins",
    ),
    (
        {"contacts": {"a": {"kind": "friction", "velocity": "v7", "kinetic": "S"}}},
        "unknown name 'v7'",
    ),
    (
        {"contacts": {"a": {"kind": "friction", "velocity": "q1", "kinetic": "S"}}},
        "made of velocities",
    ),
    ({"contacts": {"a": {"kind": "friction", "velocity": "m*v1", "kinetic": "S"}}}, "are numbers"),
    (
        {"contacts": {"a": {"kind": "friction", "velocity": "0.3", "kinetic": "S"}}},
        "nothing moves this",
    ),
    ({"contacts": {"a": {"kind": "friction", "velocity": "v1"}}}, "key 'kinetic' is missing"),
    (
        {"contacts": {"a": {"kind": "impact", "gap": "q1*q2", "restitution": 1}}},
        "linear in the states",
    ),
    ({"contacts": {"a": RUBS, "b": RUBS}}, "contacts -> b: 'b' locks with 'a'.* indeterminate"),
    (
        {
            "contacts": {
                "a": RUBS,
                "b": RUBS | {"velocity": "v2"},
                "c": RUBS | {"velocity": "v1-v2"},
            }
        },
        "contacts -> c: 'c' locks with 'a', 'b'",
    ),
    ({"contacts": {"a": RUBS, "z": ELEMENT}}, "contacts -> z: 'a' and 'z' act along one direction"),
    ({"contacts": {"a": WALL, "b": WALL}}, "contacts -> b: 'b' has the gap of 'a'"),
    ({"contacts": {"a": WALL | {"gap": "1 - q7"}}}, "contacts -> a -> gap: unknown name 'q7'"),
    ({"contacts": {"q1": RUBS}}, "contacts -> q1: 'q1' is a coordinate"),
    ({"contacts": {"my brake": RUBS}}, "contacts -> my brake: contact 'my brake'"),
    ({"contacts": {}}, "contacts: a structure has at least one contact"),
    ({"stiffness": [["kk", 0.0], [0.0, 1.0]]}, "stiffness -> 0: unknown name 'kk'"),
    ({"force": {"q1": "cos(w*t)"}}, "force -> q1: unknown name 'w'"),
    ({"contacts": {"a": RUBS | {"kinetic": "mu*S"}}}, "a -> kinetic: unknown name 'mu'"),
    ({"contacts": {"z": ELEMENT | {"limit": "S/(1 + vv)"}}}, "z -> limit: unknown name 'vv'"),
    ({"period": "0"}, "period: a period is above 0; '0' is 0 at the defaults"),
    ({"period": "-2*pi"}, "period: a period is above 0"),
    ({"mass": 1, "damping": 1, "stiffness": "k", "coordinates": None}, "give 'stiffness' as rows"),
    (
        {"mass": [[1.0, 0.0], [0.0, float("nan")]]},
        "mass -> 1 -> 1: an entry of 'mass' must be an expression or a finite number",
    ),
    (
        {"contacts": {"a": WALL | {"restitution": -0.2}}},
        "contacts -> a -> restitution: .* at least 0",
    ),
    ({"contacts": {"a": WALL | {"restitution": "1.5*m"}}}, r"1.5\*m = 1.5 at the defaults"),
    ({"contacts": {"a": RUBS | {"kinetic": "-S"}}}, "a -> kinetic: friction is at least 0"),
    ({"contacts": {"a": RUBS | {"kinetic": "S*(k - 2)"}}}, "a -> kinetic: friction is at least 0"),
    ({"contacts": {"a": RUBS | {"static": 0.1}}}, "a -> static: .* no larger than static friction"),
    (
        {"contacts": {"z": ELEMENT | {"stiffness": 0}}},
        "z -> stiffness: .* above 0; 'z' has stiffness 0",
    ),
    ({"contacts": {"z": ELEMENT | {"limit": "-k"}}}, "z -> limit: .* slips is above 0"),
    (
        {"contacts": {"a": SPRING | {"stiffness": -1}}},
        "a -> stiffness: .* of a spring is at least 0",
    ),
]


@pytest.mark.parametrize(("change", "message"), WRONG)
def test_mistakes_say_what_and_where(change: dict[str, Any], message: str) -> None:
    given = {
        "mass": np.eye(2),
        "damping": np.zeros((2, 2)),
        "stiffness": np.eye(2),
        "contacts": {"a": {"kind": "friction", "velocity": "v1", "kinetic": "S"}},
        "force": {"q1": "cos(t)"},
        "parameters": {"S": 0.2, "m": 1.0, "k": 1.0},
        "period": "2*pi",
        "coordinates": ["q1", "q2"],
    } | change
    with pytest.raises(ModelError, match=message):
        cf.Mechanism(given.pop("mass"), given.pop("damping"), given.pop("stiffness"), **given)


@pytest.mark.parametrize(
    ("contact", "valid", "wrong", "message"),
    [
        (WALL | {"restitution": "e"}, {"e": 0.0}, {"e": -0.01}, "needs 0 <= e"),
        (WALL | {"restitution": "e"}, {"e": 1.0}, {"e": 1.01}, "needs e <= 1"),
        (RUBS | {"kinetic": "mu*N"}, {"mu": 0.0}, {"N": -1.0}, "needs 0 <= N"),
        (
            RUBS | {"kinetic": "mu*N", "static": "mu0*N"},
            {"mu": 0.5},
            {"mu": 0.6},
            "needs mu <= mu0",
        ),
        (RUBS | {"static": "S0"}, {"S": 0.3}, {"S": 0.31}, "needs S <= S0"),
        (ELEMENT, {"k": 0.1}, {"k": 0.0}, "needs 0 < k"),
        (SPRING, {"k": 0.0}, {"k": -0.1}, "needs 0 <= k"),
    ],
)
def test_numbers_of_contacts_are_in_their_ranges(
    contact: dict[str, str], valid: dict[str, float], wrong: dict[str, float], message: str
) -> None:
    eye = np.eye(2)
    params = {"e": 0.5, "mu": 0.3, "mu0": 0.5, "N": 1.0, "S": 0.2, "S0": 0.3, "k": 1.0}
    model = cf.Mechanism(eye, eye, eye, contacts={"a": contact}, parameters=params)
    assert model.check_params(valid) == params | valid
    with pytest.raises(cf.errors.ParameterError, match=message + ".* Contact 'a': "):
        model.check_params(wrong)


def test_a_mass_that_is_pressed_to_a_wall_stays_there() -> None:
    """Impacts that follow each other too fast end a simulation before it goes through the wall."""
    params = {"w": 1.3, "e": 0.5, "push": 2.0, "c": 0.1, "d": 0.1}
    model = cf.Mechanism(
        [[1.0]],
        [["c"]],
        [[1.0]],
        contacts={"wall": {"kind": "impact", "gap": "d - q1", "restitution": "e"}},
        force={"q1": "push + 0.3*cos(w*t)"},
        parameters=params,
        period="2*pi/w",
    )
    draw = np.random.default_rng(3)
    for restitution in (0.0, 0.0, 0.02, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9) * 4:
        wall = float(draw.uniform(-0.3, 0.3))
        given_ = {"e": restitution, "push": draw.uniform(1.0, 3.0), "c": draw.uniform(0.0, 0.3)}
        start = [wall - float(draw.uniform(0.0, 2.0)), 0.0]
        found = cf.simulate(model, given_ | {"d": wall}, state=start, periods=60)
        assert found.end.name == "CHATTER"
        assert np.max(found.states[:, 0], initial=wall) <= wall + 1e-12
        assert found.last[2][0] == pytest.approx(wall, abs=1e-12)


def test_a_mass_without_restitution_leaves_a_wall_that_it_is_pulled_from() -> None:
    model = cf.Mechanism(
        [[1.0]],
        [[0.0]],
        [[1.0]],
        contacts={"wall": {"kind": "impact", "gap": "0.5 - q1", "restitution": 0}},
        force={"q1": "0.1*cos(w*t)"},
        parameters={"w": 0.5},
        period="2*pi/w",
    )
    found = cf.simulate(model, {}, state=[-1.0, 0.0], periods=0.9)
    t = float(found.times[[exit_ for _, exit_ in found.itinerary].index("wall")])
    ended = cf.simulate(model, {}, state=[-1.0, 0.0], periods=(t + 1.0) / (4.0 * np.pi))
    forced = 0.1 / 0.75  # x = forced cos(t/2) + a cos(t - t0) + b sin(t - t0)
    a, b = 0.5 - forced * np.cos(0.5 * t), 0.5 * forced * np.sin(0.5 * t)
    x = forced * np.cos(0.5 * (t + 1.0)) + a * np.cos(1.0) + b * np.sin(1.0)
    assert ended.last[2][0] == pytest.approx(x, abs=1e-12)
    assert [exit_ for _, exit_ in ended.itinerary].count("wall") == 1


def test_contacts_that_share_their_load_and_too_many_are_refused() -> None:
    def rubs(velocity: str) -> dict[str, str]:
        return {"kind": "friction", "velocity": velocity, "kinetic": "0.2"}

    eye = np.eye(7)
    wall = {"kind": "impact", "gap": "1 - q7", "restitution": "0.5"}
    with pytest.raises(ModelError, match="the loads of 'a' and 'b' depend on each other"):
        contacts = {"a": rubs("v1"), "b": rubs("v1 - v2"), "wall": wall}
        cf.Mechanism(eye, eye, eye, contacts=contacts)
    many = {f"c{i}": rubs(f"v{i}") for i in range(1, 7)}
    many["wall"] = wall
    with pytest.raises(
        ModelError, match="729 combinations of states, and with impacts each is listed"
    ):
        cf.Mechanism(eye, eye, eye, contacts=many)


def test_matrices_from_files(tmp_path: Any) -> None:
    stiffness = np.array([[2.0, -1.0], [-1.0, 2.0]])
    np.savez(tmp_path / "frame.npz", K=stiffness)
    lines = [
        "name: frame",
        "coordinates: {q: 2}",
        "parameters: {Omega: 0.9, S: 0.25}",
        "period: 2*pi/Omega",
        "damping: 0.05",
        "stiffness: {file: frame.npz, array: K}",
        "force: {q2: cos(Omega*t)}",
        "contacts: {brake: {kind: friction, velocity: v1, kinetic: S}}",
    ]
    path = tmp_path / "frame.yaml"
    path.write_text("\n".join(lines))
    model = cf.load_model(path)
    y = [0.3, -0.7, 0.4, 0.1]
    rates = floats(model.description).field("p", model.defaults, 0.0, y)
    force = np.array([-0.25, 1.0]) - 0.05 * np.array(y[2:]) - stiffness @ np.array(y[:2])
    assert rates[2:] == pytest.approx(list(force))
    path.write_text("\n".join(lines).replace("array: K", "array: KK"))
    with pytest.raises(
        ModelError, match=r"frame.yaml:6: frame.npz has no array 'KK'.*did you mean 'K'"
    ):
        cf.load_model(path)
    path.write_text("\n".join(lines).replace(", array: K", ""))
    with pytest.raises(ModelError, match=r"frame.yaml:6: say which array of frame.npz: K"):
        cf.load_model(path)
    np.save(tmp_path / "frame.npy", stiffness)
    path.write_text("\n".join(lines).replace("frame.npz", "frame.npy"))
    with pytest.raises(ModelError, match=r"frame.yaml:6: frame.npy is no npz"):
        cf.load_model(path)


@pytest.mark.parametrize(
    ("coordinates", "contact", "line", "message"),
    [
        (["a", "b", "a"], "rub", 7, "the coordinate 'a' has the name of a coordinate"),
        (["a", "v3", "b"], "rub", 6, "the coordinate 'v3' has the name of a velocity"),
        (["a", "t", "b"], "rub", 6, "coordinate 't': this name means"),
        (["a", "b", "c"], "c", 10, "the stretch of 'c' has the name of a coordinate"),
        (["a", "b", "c"], "v2", 10, "the stretch of 'v2' has the name of a velocity"),
    ],
)
def test_a_name_that_is_taken_is_reported_in_its_line(
    tmp_path: Any, coordinates: list[str], contact: str, line: int, message: str
) -> None:
    lines = [
        "name: taken",
        "parameters: {W: 0.9}",
        "period: 2*pi/W",
        "coordinates:",
        *(f"  - {name}" for name in coordinates),
        "force: {a: cos(W*t)}",
        "contacts:",
        f"  {contact}: {{kind: jenkins, displacement: a, stiffness: 1, limit: 0.2}}",
    ]
    path = tmp_path / "taken.yaml"
    path.write_text("\n".join(lines))
    with pytest.raises(ModelError, match=rf"taken.yaml:{line}: {message}"):
        cf.load_model(path)


def test_masses_side_by_side_move_as_one_alone() -> None:
    """Masses that share nothing move as one alone does."""
    contacts = {
        f"c{i}": {"kind": "friction", "velocity": f"v{i}", "kinetic": "S", "static": "S0"}
        for i in (1, 2, 3)
    }
    model = cf.Mechanism(
        np.eye(3),
        np.zeros((3, 3)),
        np.eye(3),
        contacts=contacts,
        force={f"q{i}": "cos(Omega*t)" for i in (1, 2, 3)},
        parameters={"Omega": 0.5, "S": 0.32, "S0": 0.4},
        period="2*pi/Omega",
    )
    alone = cf.simulate(
        "coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4}, state=[1.3, 0.0], periods=3.2
    )
    state = list(itertools.chain([1.3, 1.1, 0.9], [0.0] * 3))
    together = cf.simulate(model, {}, state=state, periods=3.2)
    mine = [
        k for k, exit_ in enumerate(together.exits) if model.surfaces[exit_].name.startswith("c1")
    ]
    stops = [(c, t) for c, t in zip(together.cycles[mine], together.times[mine], strict=True)]
    wanted = [
        (c, t)
        for c, t, m, k in zip(alone.cycles, alone.times, alone.modes, alone.exits, strict=True)
        if alone.model.surfaces[k].name == "v" or alone.model.modes[m].name == "stick"
    ]
    assert len(wanted) >= 8
    assert np.allclose(np.array(stops), np.array(wanted), atol=1e-10)


def test_a_normal_force_that_vanishes_somewhere_is_warned_of() -> None:
    """A pad whose normal force depends on a state: where it is negative, no mode is missing."""
    pad = {
        "kind": "friction",
        "velocity": "v1 - vb",
        "kinetic": "mu*(N0 + kc*q2)",
        "static": "1.2*mu*(N0 + kc*q2)",
    }
    model = cf.Mechanism(
        np.eye(2),
        0.02 * np.eye(2),
        [["1", "-0.3"], ["-0.3", "1.5 + kc"]],
        contacts={"pad": pad},
        parameters={"mu": 0.5, "N0": 1.0, "kc": 1.0, "vb": 0.4},
    )
    report = cf.check_model(model)
    assert report.ok
    assert any("friction limit that is negative" in f.message for f in report.findings)


def test_a_sweep_of_a_structure_needs_no_section() -> None:
    """Its contacts have several velocities, and no stops: the points are those at phase 0."""
    pad = {"kind": "friction", "velocity": "v2", "kinetic": "R"}
    model = cf.Mechanism(
        [1.0, 0.5],
        0.1 * np.eye(2),
        [[2.0, -1.0], [-1.0, 2.0]],
        contacts={"pad": pad},
        force={"q1": "cos(w*t)"},
        parameters={"w": 0.8, "R": 0.1},
        period="2*pi/w",
    )
    found = cf.sweep(model, "w", [0.8, 0.9])
    assert found.section == 0.0
    orbit = cf.find_orbit(model, {"w": 0.9})
    assert found.up.states[-1] == pytest.approx(orbit.as_whole().state(0.0), abs=1e-8)
    assert cf.poincare(model, state=[0.1, 0.0, 0.0, 0.0], periods=3).section == 0.0


FROM_FILE = """
name: from-file
coordinates: [q1, q2]
parameters: {S: 0.2}
period: 2*pi
mass: identity
damping: 0.05
stiffness: {file: FILE, array: K}
force: {q1: cos(t)}
contacts:
  pad: {kind: friction, velocity: v1, kinetic: S}
"""


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.eye(2) * (1.0 + 1.0j), "'K' of given.npz has 2 dimensions of complex128"),
        (np.zeros((2, 2, 2)), "has 3 dimensions of float64"),
        (np.array([["1", "k"], ["k", "1"]]), "a matrix has rows of real numbers"),
        (np.eye(3), "it has 3 rows, and there are 2 coordinates"),
        (None, "given.npz is no npz file"),
    ],
)
def test_what_a_file_has_is_a_matrix_of_real_numbers(
    array: np.ndarray | None, message: str, tmp_path: Path
) -> None:
    """An imaginary part (hysteretic damping) is not left out without a word."""
    written = tmp_path / "given.npz"
    if array is None:
        written.write_text("1 0 0 1")
    else:
        np.savez(written, K=array)
    file = tmp_path / "model.yaml"
    file.write_text(FROM_FILE.replace("FILE", "given.npz"))
    with pytest.raises(ModelError, match=message):
        cf.load_model(file)


@pytest.mark.parametrize("seed", range(4))
def test_a_matrix_from_a_file_that_changes_a_little_is_another_one(
    seed: int, tmp_path: Path
) -> None:
    """A model is read once, and anew if any digit of any entry differs, of large matrices too."""
    rng = np.random.default_rng(seed)
    size = (2, 5, 35, 40)[seed]
    stiffness = np.eye(size) + 0.1 / size * np.abs(rng.normal(size=(size, size)))
    file = tmp_path / "model.yaml"
    text = FROM_FILE.replace("FILE", "given.npz").replace("[q1, q2]", f"{{q: {size}}}")
    file.write_text(text)
    i, j = rng.integers(size, size=2)
    for step in (0.0, 1e-11, 0.01):
        stiffness[i, j] += step
        np.savez(tmp_path / "given.npz", K=stiffness)
        model = cf.load_model(file)
        y = np.zeros(2 * size)
        y[j] = 1.0
        rates = floats(model.description).field("p", model.defaults, 0.0, list(y))
        force = float(i == 0) * (1.0 - 0.2)
        assert rates[size + i] == pytest.approx(force - stiffness[i, j], rel=1e-14, abs=1e-14)


def test_sparse_matrices_are_matrices(tmp_path: Path) -> None:
    stiffness = [[2.0, -1.0], [-1.0, 2.0]]
    mmwrite(tmp_path / "K.mtx", csr_matrix(stiffness))
    file = tmp_path / "model.yaml"
    file.write_text(FROM_FILE.replace("FILE, array: K", "K.mtx"))
    own = {"contacts": {"pad": RUBS}, "force": {"q1": "cos(t)"}, "parameters": {"S": 0.2}}
    typed = cf.Mechanism(np.eye(2), [0.05, 0.05], csr_matrix(stiffness), period="2*pi", **own)
    orbits = [cf.find_orbit(model) for model in (typed, cf.load_model(file))]
    assert np.max(np.abs(orbits[0].joints - orbits[1].joints)) < 1e-12


@pytest.mark.parametrize("seed", range(3))
def test_masses_that_nothing_holds_are_found_where_they_are_symmetric(seed: int) -> None:
    """Their orbits are a continuum, moved by a constant: the symmetric one alone has a continuation."""
    draw = np.random.default_rng([61, seed])
    stiffness = draw.uniform(0.8, 1.2) * np.array([[1.0, -1.0], [-1.0, 1.0]])
    rubs = {
        name: RUBS | {"velocity": v, "kinetic": f"{draw.uniform(0.5, 1.0):.3f}*S"}
        for name, v in (("a", "v1"), ("b", "v2"))
    }
    model = cf.Mechanism(
        np.diag(draw.uniform(0.8, 1.5, 2)),
        0.05 * stiffness,
        stiffness,
        contacts=rubs,
        force={"q1": "F*cos(W*t)"},
        parameters={"W": 0.7, "S": 0.15, "F": 1.0},
        period="2*pi/W",
    )
    orbit = cf.find_orbit(model)
    assert orbit.symmetric and orbit.admissible and orbit.residual < 1e-12
    branch = cf.continue_orbit(orbit, "F", (0.9, 1.1))
    assert {end.reason.name for end in branch.ends} <= {"RANGE", "CS", "SS", "AS", "GS"}


@pytest.mark.parametrize("seed", [pytest.param(0, marks=pytest.mark.slow), 1])
def test_a_preloaded_train_of_four_gaps_moves_as_a_linear_one(seed: int) -> None:
    """All its gaps are closed all the time: one of 16 modes, and no surface is met."""
    draw = np.random.default_rng(seed)
    n, w, stiff = 5, float(draw.uniform(0.5, 1.5)), draw.uniform(2.0, 5.0, 4)
    mass, preload = draw.uniform(0.5, 2.0, n), 50.0
    chain = np.diag(draw.uniform(1.0, 2.0, n))
    gaps = {
        f"g{i + 1}": {"kind": "spring", "gap": f"q{i + 2} - q{i + 1}", "stiffness": float(k)}
        for i, k in enumerate(stiff)
    }
    load = {"q1": f"{preload} + cos(w*t)", "q5": f"-{preload}"}
    model = cf.Mechanism(
        mass.tolist(), 0.3, chain, contacts=gaps, force=load, parameters={"w": w}, period="2*pi/w"
    )
    orbit = cf.find_orbit(model)
    closed = chain.copy()
    for i, k in enumerate(stiff):
        closed[np.ix_([i, i + 1], [i, i + 1])] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])
    mean = np.linalg.solve(closed, preload * np.array([1.0, 0, 0, 0, -1.0]))
    wave = np.linalg.solve(closed - w**2 * np.diag(mass) + 0.3j * w * np.eye(n), np.eye(n)[0])
    assert np.all(np.diff(mean) + 2.0 * np.abs(wave).max() < 0.0)  # closed all the time
    for t, *y in orbit.joints:
        assert y[:n] == pytest.approx(mean + np.real(wave * np.exp(1j * w * t)), abs=1e-9)
    assert orbit.admissible
    assert orbit.stable


def test_walls_hit_at_the_same_time_are_named() -> None:
    """Equal masses hit equal walls together; set back a little, one after the other."""
    side = {"kind": "impact", "restitution": 0.6}
    model = cf.Mechanism(
        np.eye(2),
        0.05 * np.eye(2),
        np.array([[1.3, -0.3], [-0.3, 1.3]]),
        contacts={"left": {**side, "gap": "0.8 - q1"}, "right": {**side, "gap": "0.8 + b - q2"}},
        force={"q1": "cos(w*t)", "q2": "cos(w*t)"},
        parameters={"w": 0.8, "b": 0.0},
        period="2*pi/w",
    )
    with pytest.raises(cf.ConvergenceError, match="'left' and 'right' are hit at the same time"):
        cf.find_orbit(model)
    apart = cf.find_orbit(model, {"b": 1e-3})
    assert [surface for _, surface in apart.itinerary] == ["left", "right"] and apart.stable
