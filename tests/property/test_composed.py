"""Modes that are made when they are visited are those that would be listed."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.base.arrays import FloatArray
from contfric.errors import ModelError, ParameterError
from contfric.models.check.probe import Probe
from contfric.models.structures import structure as reading
from contfric.signature.holds import comes_to_rest, ends_rest, left_surface

PARAMETERS = {"Omega": 0.9, "S": 0.25, "S0": 0.3, "F": 1.1, "kd": 1.7}


def friction(velocity: str, static: str = "S0") -> dict[str, str]:
    return {"kind": "friction", "velocity": velocity, "kinetic": "S", "static": static}


def structure(seed: int, name: str) -> cf.Model:
    """Return four masses with two friction contacts, two Jenkins elements along one line, and a spring."""
    rng = np.random.default_rng(seed)
    mass = np.diag(rng.uniform(0.5, 2.0, 4))
    damping, stiffness = (m @ m.T for m in rng.normal(size=(2, 4, 4)))
    contacts = {
        "brake": friction("v1 - 0.2*cos(Omega*t)"),
        "pad": friction("2*v2 - v3"),
        "weak": {"kind": "jenkins", "displacement": "q4", "stiffness": "kd", "limit": "S"},
        "strong": {"kind": "jenkins", "displacement": "-2*q4", "stiffness": "kd", "limit": "2.7*S"},
        "stop": {"kind": "spring", "gap": "0.3 - q3 + q1", "stiffness": "3*kd"},
    }
    return cf.Mechanism(
        mass,
        damping,
        stiffness,
        contacts=contacts,
        force={"q1": "F*cos(Omega*t)", "q3": "0.2*F*sin(Omega*t)"},
        parameters=PARAMETERS,
        period="2*pi/Omega",
        name=name,
    )


def chain(contacts: int, masses: int, name: str, force: float = 1.0) -> cf.Model:
    """Return masses in a row on springs of their own and between them, some of which rub on the ground."""
    ones = np.eye(masses, k=1) + np.eye(masses, k=-1)
    between = np.diag(np.sum(ones, axis=1)) - ones
    stiffness = np.eye(masses) + 0.5 * between
    step = masses // contacts
    return cf.Mechanism(
        np.eye(masses),
        0.05 * stiffness,
        stiffness,
        contacts={f"b{i}": friction(f"v{i * step}", "S") for i in range(1, contacts + 1)},
        force={"q1": "F*cos(Omega*t)"},
        parameters={"Omega": 1.0, "F": force, "S": 0.05},
        period="2*pi/Omega",
        name=name,
    )


@pytest.fixture
def composing(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return a function that builds a model whose modes are made when they are visited, however few."""

    def built(make: Any, *arguments: Any) -> cf.Model:
        with monkeypatch.context() as patch:
            patch.setattr(reading, "_MANY_FRICTION", 1)
            return make(*arguments)  # type: ignore[no-any-return]

    return built


@pytest.mark.parametrize("seed", range(6))
def test_solutions_are_those_of_listed_modes(composing: Any, seed: int) -> None:
    listed = structure(seed, "listed")
    composed = composing(structure, seed, "composed")
    assert composed.composed and not listed.composed and len(composed.modes) == 1
    assert composed.states == listed.states
    assert {s.name: s.observable for s in listed.surfaces}.items() >= {
        s.name: s.observable for s in composed.surfaces if s.name != composed.phase
    }.items()
    state = np.random.default_rng(seed).normal(size=10) * np.array([*[1.0] * 8, 0.05, 0.05])
    motions = [cf.simulate(m, state=state, periods=12) for m in (listed, composed)]
    (one, states), (other, others) = map(_without_cuts, motions)
    assert len(one) > 20 and one == other
    np.testing.assert_allclose(states, others, atol=1e-9)
    assert len(composed.modes) <= len({mode for mode, _ in motions[1].itinerary}) + 1


def _without_cuts(motion: Any) -> tuple[list[tuple[str, str]], FloatArray]:
    """Return modes and surfaces, and states, but where a mode in which an orbit may stay is cut in two."""
    whole = [(mode.rstrip("-"), surface) for mode, surface in motion.itinerary]
    own = [k for k, pair in enumerate(whole) if pair != ("sssso", "weak") and pair[1] != "phase"]
    return [whole[k] for k in own], motion.states[own]


def test_a_branch_ends_where_that_of_listed_modes_does(composing: Any) -> None:
    found = []
    for model in (chain(3, 6, "listed"), composing(chain, 3, 6, "composed")):
        orbit = cf.find_orbit(model)
        branch = cf.continue_orbit(orbit, "Omega", (0.9, 1.2))
        events = [(b.kind, b.params["Omega"]) for b in branch.bifurcations if b.kind != "T"]
        found.append((orbit, sorted(events, key=lambda event: event[1])))
    (one, events), (other, same) = found
    assert one.itinerary == other.itinerary and one.symmetric == other.symmetric
    np.testing.assert_allclose(
        np.sort(np.abs(one.multipliers)), np.sort(np.abs(other.multipliers)), atol=1e-9
    )
    assert [kind for kind, _ in events] == [kind for kind, _ in same] and events
    np.testing.assert_allclose([w for _, w in events], [w for _, w in same], rtol=1e-9)


def test_a_diagram_goes_on_where_contacts_change_in_another_order() -> None:
    model = chain(5, 10, "composed")
    diagram = cf.explore(cf.find_orbit(model), "Omega", (1.0, 1.2), max_periods=1)
    assert not diagram.loose_ends
    events = [b for b in diagram.bifurcations if b.kind != "T"]
    assert len(events) >= 3
    for branch in diagram.branches:  # a simulation that starts on an orbit stays on it
        orbit = branch[len(branch) // 2]
        if not orbit.stable:
            continue
        joint = orbit.ends[-1]
        again = cf.find_orbit(model, orbit.params, state=joint[1:], time=float(joint[0]))
        assert abs(again.x_max - orbit.x_max) < 1e-8
        assert sorted(again.itinerary) in (
            sorted(orbit.itinerary),
            sorted(orbit.mirror().itinerary),
        )


def test_nothing_is_listed() -> None:
    model = chain(20, 20, "long")
    assert len(model.modes) == len(model.domains) == 1
    trajectory = cf.simulate(model, periods=3)
    assert len(trajectory) > 20
    assert len(model.modes) <= len(trajectory) + 2
    assert [m.name for m in model.modes] == list(model.mode_index)
    name = "p" * 20
    assert name in model.domain_by_name and "x" * 20 not in model.domain_by_name
    assert model.mirror_domain[name] == "n" * 20
    assert model.mode_by_name[name].rank == 40 and model.mode_by_name["s" * 20].rank == 20


def test_a_saved_orbit_comes_back_in_a_model_that_has_visited_nothing(tmp_path: Any) -> None:
    from contfric.models.reading.files import model_of

    orbit = cf.find_orbit(chain(5, 10, "saved"))
    cf.save(orbit, tmp_path / "orbit.npz")
    model_of.cache_clear()
    again = cf.load(tmp_path / "orbit.npz")
    assert again.model is not orbit.model and again.itinerary == orbit.itinerary
    np.testing.assert_allclose(again.joints, orbit.joints, atol=1e-12)
    assert again.signature.segments == orbit.signature.segments


@pytest.mark.parametrize("seed", range(4))
def test_signatures_do_not_depend_on_what_was_asked_before(composing: Any, seed: int) -> None:
    """Whatever modes were visited, and of whatever modes the followers were looked up."""
    texts = []
    for asked in (False, True):
        model = composing(chain, 6, 12, f"asked-{asked}")
        orbit = cf.find_orbit(model, {"F": np.random.default_rng(seed).uniform(0.8, 1.5)})
        modes = [mode for mode, _ in orbit.itinerary]
        k = np.random.default_rng(seed).integers(6)
        beside = [f"{mode[:k]}s{mode[k + 1 :]}" for mode in modes]  # another contact sticks
        for at in product([*modes, *beside] if asked else [], [s.name for s in model.surfaces]):
            model.targets.get(at)
        texts.append(str(orbit.signature))
    assert texts[0] == texts[1]


def test_forces_and_work_of_contacts(composing: Any) -> None:
    values = []
    for model in (chain(3, 6, "listed"), composing(chain, 3, 6, "composed")):
        orbit = cf.find_orbit(model)
        names = ("work(b1)", "work(b3)", "max(force(b2))")
        values.append([orbit.quantity(name) for name in names])
    np.testing.assert_allclose(values[0], values[1], rtol=1e-9)


def test_what_needs_all_modes_says_so() -> None:
    model = chain(5, 10, "many")
    with pytest.raises(ParameterError, match="modes are made when solutions visit them"):
        cf.lyapunov_exponent(model, state=np.ones(20), periods=10)
    with pytest.raises(ParameterError, match="call find_orbit at each value"):
        cf.sweep(model, model.parameter_names[0], [1.0, 1.1])


def test_forces_that_are_not_affine_are_refused() -> None:
    contacts = {f"b{i}": friction(f"v{i}", "S") for i in range(1, 6)}
    contacts["b1"] = {**contacts["b1"], "kinetic": "S/(1 + v1**2)"}
    with pytest.raises(ModelError, match="need affine forces"):
        cf.Mechanism(
            np.eye(5),
            0.1 * np.eye(5),
            np.eye(5),
            contacts=contacts,
            force={"q1": "cos(Omega*t)"},
            parameters={"Omega": 1.0, "S": 0.1},
            period="2*pi/Omega",
        )


@pytest.mark.parametrize("seed", range(6))
def test_a_contact_may_come_to_rest_while_others_stick(seed: int) -> None:
    """In random modes: a velocity that vanishes ends no rest of another contact, a limit of a load does."""
    draw = np.random.default_rng(seed)
    model = cf.load_model("braced-chain") if seed % 2 else chain(3, 6, "resting")
    own = [s.name for s in model.surfaces if s.name != model.phase]
    contacts = [name for name in own if not name.endswith(("+", "-"))]
    mode = "".join(draw.choice(["p", "n", "s"], len(contacts)))
    checked = 0
    for i, name in enumerate(contacts):
        if mode[i] == "s":
            released = mode[:i] + "p" + mode[i + 1 :]
            assert left_surface(model, mode, released) == name
            assert all(ends_rest(model, mode, f"{name}{sign}") for sign in "+-")
        else:
            assert comes_to_rest(model, mode, name)
            assert not ends_rest(model, mode, name)
        checked += 1
    assert checked == 3


def test_a_tangential_stop_is_a_graze_whatever_else_sticks() -> None:
    """While one mass of three sticks another one comes to rest without acceleration: nothing is added."""
    orbit = cf.find_orbit("braced-chain", {"W": 0.424})
    branch = cf.continue_orbit(orbit, "W", (0.4223, 0.4247))
    end = branch.ends[0].bifurcation
    assert end is not None
    assert end.kind is cf.Kind.GS
    assert end.params["W"] == pytest.approx(0.42242863571, abs=1e-10)
    i = end.tests[0].segment
    mode, surface = end.orbit.itinerary[i]
    assert "s" in mode
    observable = end.orbit.model.surface_by_name[surface].observable
    time, state = float(end.orbit.ends[i, 0]), end.orbit.ends[i, 1:]
    assert end.orbit.flow.observe(observable, time, state) == pytest.approx(0.0, abs=1e-10)
    assert abs(end.orbit.flow.rate(mode, observable, time, state)) < 1e-6


def test_a_slip_that_vanishes_is_one_event_to_its_end() -> None:
    """Near it multipliers are rounding over the product of two rates: their changes of sign are no events."""
    rng = np.random.default_rng(2)
    n = 20
    between = np.diag(rng.uniform(0.3, 0.7, n - 1), 1)
    between = between + between.T
    stiffness = np.diag(rng.uniform(0.8, 1.2, n) + between.sum(axis=1)) - between
    mass = np.diag(rng.uniform(0.8, 1.2, n))
    where = np.sort(rng.choice(np.arange(1, n + 1), 10, replace=False))
    rubs: dict[str, dict[str, Any]] = {
        f"b{i}": {
            "kind": "friction",
            "velocity": f"v{k}",
            "kinetic": f"{rng.uniform(0.5, 1.5):.4f}*S",
        }
        for i, k in enumerate(where)
    }
    model = cf.Mechanism(
        mass,
        0.02 * stiffness,
        stiffness,
        contacts=rubs,
        force={"q1": "cos(Omega*t)"},
        parameters={"Omega": 0.95636, "S": 0.03},
        period="2*pi/Omega",
        name="slip-vanishes",
    )
    branch = cf.continue_orbit(cf.find_orbit(model, periods=1), "Omega", (0.9563, 0.95637))
    (event,) = (b for b in branch.bifurcations if b.kind is not cf.Kind.T)
    assert event.kind.value in ("AS", "SS")
    assert abs(event.params["Omega"] - 0.95633425311519) < 1e-11
    orbit = event.orbit
    assert np.min(orbit.ends[:, 0] - orbit.cycle[:, 0]) < 1e-5 * orbit.period


@pytest.mark.parametrize("seed", range(4))
def test_the_field_of_a_visited_mode_is_that_of_its_flow(seed: int) -> None:
    """It was read from tables that ended before it: an excitation was said to have another period."""
    model = chain(5, 6, f"field-{seed}")
    cf.simulate(model, periods=4)
    probe, rng = Probe(model, model.defaults, seed=seed), np.random.default_rng(seed)
    assert len(model.modes) > 4
    for mode in model.modes:
        t, guess = float(rng.uniform(0.0, 6.0)), rng.normal(size=len(model.states))
        y = probe.flow.state(mode.name, t, guess, 0.0)
        rate = probe.flow.jacobian(mode.name, t, y, 0.0)[:, 1 + len(y)]
        assert probe.field(mode.name, t, y) == pytest.approx(rate, abs=1e-12)


@pytest.mark.parametrize(("element", "side"), [("weak", 1.0), ("strong", -1.0)])
def test_a_state_beyond_the_limit_of_an_element_is_none(
    composing: Any, element: str, side: float
) -> None:
    model, state = composing(structure, 3, "composed"), np.zeros(10)
    place = model.states.index(element)
    limit = PARAMETERS["S"] / PARAMETERS["kd"] * (2.7 if element == "strong" else 1.0)
    state[place] = side * limit * (1.0 + 1e-9)
    with pytest.raises(ParameterError, match="is in no domain"):
        cf.simulate(model, state=state, periods=1.0)
    state[place] = side * limit  # at its limit it may be
    assert len(cf.simulate(model, state=state, periods=1.0))


def test_the_check_of_a_composed_model_knows_what_acts_when_contacts_slide(composing: Any) -> None:
    for model in (composing(structure, 0, "composed"), chain(5, 10, "row")):
        cf.find_orbit(model)  # what it visits is no matter
        report = cf.check_model(model)
        assert report.ok and not [f for f in report.findings if f.severity.value != "note"], str(
            report
        )
