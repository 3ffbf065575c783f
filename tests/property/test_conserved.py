"""Contacts that never slip: where they rest is a datum, and no disturbance."""

from __future__ import annotations

import json

import numpy as np
import pytest

import contfric as cf
from contfric.bvp.conserved import conserved, kept_by
from contfric.models.described.evaluate import floats
from contfric.orbit.itinerary.one_way import only_grows
from contfric.signature import canonical_itinerary
from contfric.simulation.simulate import Trajectory

PARAMETERS = {"Omega": 0.9, "k": 1.0, "S1": 0.3, "S2": 1.5}
FREE = {"c1": {"kind": "friction", "velocity": "v1", "kinetic": "S1"}}
BOTH = FREE | {"c2": {"kind": "friction", "velocity": "v2", "kinetic": "S2"}}


def two_masses() -> cf.Model:
    return cf.Mechanism(
        np.eye(2),
        0.05 * np.eye(2),
        [["2*k", "-k"], ["-k", "2*k"]],
        contacts=BOTH,
        force={"q1": "cos(Omega*t)"},
        parameters=PARAMETERS,
        period="2*pi/Omega",
        name="two masses",
    )


def one_mass(rest: float) -> cf.Model:
    """The first mass, the second one fixed where it rests."""
    return cf.Mechanism(
        [[1.0]],
        [[0.05]],
        [["2*k"]],
        contacts=FREE,
        force={"q1": f"cos(Omega*t) + k*({rest!r})"},
        parameters={name: PARAMETERS[name] for name in ("Omega", "k", "S1")},
        period="2*pi/Omega",
        name="one mass",
    )


@pytest.mark.parametrize("rest", [0.0, 0.2, -0.35])
def test_an_orbit_with_a_contact_at_rest_is_that_of_the_others(rest: float) -> None:
    model = two_masses()
    settled = cf.simulate(model, {}, state=[0.0, rest, 0.0, 0.0], periods=40, domain=None)
    assert abs(settled.last[2][1] - rest) < 1e-12
    orbit = cf.find_orbit(model, {}, state=[0.0, rest, 0.0, 0.0])
    alone = cf.find_orbit(one_mass(rest), {})
    assert orbit.joints[:, 2] == pytest.approx(rest, abs=1e-10)
    assert orbit.x_max == pytest.approx(alone.x_max, rel=1e-9)
    mine = orbit.as_whole().multipliers
    other = alone.as_whole().multipliers
    assert np.sort_complex(mine[:2]) == pytest.approx(np.sort_complex(other), abs=1e-8)
    assert np.all(mine[2:] == 0.0)
    assert orbit.stable


def test_a_branch_keeps_the_datum() -> None:
    model = two_masses()
    orbit = cf.find_orbit(model, {}, state=[0.0, 0.2, 0.0, 0.0])
    branch = cf.continue_orbit(orbit, "Omega", (0.75, 1.1))
    assert len(branch) > 20
    for index in range(0, len(branch), 5):
        assert branch[index].joints[:, 2] == pytest.approx(0.2, abs=1e-10)
    kinds = {b.kind for b in branch.bifurcations}
    assert not kinds & {cf.Kind.SN, cf.Kind.BP, cf.Kind.PD}


def test_what_a_itinerary_conserves() -> None:
    model = two_masses()
    itinerary = (("ps", "c1"), ("ns", "c1"))
    (direction,) = conserved(model, itinerary)
    assert np.abs(direction) == pytest.approx([0.0, 1.0, 0.0, 0.0], abs=1e-9)
    assert conserved(model, (*itinerary, ("np", "c2"))).shape == (0, 4)
    assert conserved(cf.load_model("coulomb"), (("slide+", "v"),)).shape == (0, 2)
    mirror = -np.eye(4)
    assert kept_by(mirror, direction[None, :]).shape == (0, 4)
    assert np.abs(kept_by(np.eye(4), direction[None, :])) == pytest.approx(
        np.abs(direction[None, :])
    )


def test_a_slider_that_never_slips_has_an_offset() -> None:
    """The stretch of a Jenkins element less the displacement."""
    model = cf.load_model("jenkins")
    (direction,) = conserved(model, (("stick+", "stop"), ("stick-", "stop")))
    assert np.abs(direction) == pytest.approx(np.array([1.0, 0.0, 1.0]) / np.sqrt(2.0), abs=1e-9)
    assert direction[0] == pytest.approx(-direction[2])
    assert conserved(model, (("stick+", "z+"), ("slip+", "stop"))).shape == (0, 3)


def test_the_fields_of_contacts_at_rest_conserve_it_exactly() -> None:

    model = two_masses()
    field = floats(model.description).field("ps", model.defaults, 0.3, [0.5, 0.2, 0.7, 0.0])
    assert field[1] == 0.0
    assert field[3] == 0.0


@pytest.mark.parametrize("offset", [0.08, -0.2])
def test_a_stuck_branch_off_the_centre_ends_where_its_slider_begins_to_creep(offset: float) -> None:
    """The stretch is ``k d/(k + kt)`` on the average for an offset d, about which a linear oscillator moves.

    Beyond the force at which it reaches the limit on one side the slider slips to that side alone.
    """
    model = cf.load_model("jenkins")
    p = model.defaults
    orbit = cf.find_orbit(model, {"F": 0.05}, state=[0.0, 0.0, offset])
    diagram = cf.explore(orbit, "F", (0.01, 1.3))
    assert not diagram.loose_ends
    start, end = diagram.branches[0].ends
    assert start.reason.name == "RANGE"
    assert end.reason.name == "SHAKEDOWN"
    mean = p["k"] * abs(offset) / (p["k"] + p["kt"])
    stiff = p["k"] + p["kt"] - p["W"] ** 2 + 2j * p["zeta"] * p["W"]
    assert end.bifurcation is not None
    expected = (p["muN"] / p["kt"] - mean) * abs(stiff)
    assert end.bifurcation.params["F"] == pytest.approx(expected, abs=1e-9)
    # beyond it orbits have other offsets, each of a continuum: their indices are not to be summed
    assert diagram.verify(restarts=1).passed


def slipping(kinetic: str, jenkins: bool = False) -> cf.Model:
    """A mass between two springs with friction, next to one that has friction (or a Jenkins element), too."""
    slider = {"kind": "jenkins", "displacement": "q2", "stiffness": "1", "limit": "S"}
    contacts = {"a": {"kind": "friction", "velocity": "v1", "kinetic": kinetic}}
    return cf.Mechanism(
        [1.0, 1.0],
        0.2 * np.eye(2),
        [[2.0, -1.0], [-1.0, 2.0]],
        contacts=contacts | ({"b": slider} if jenkins else {"b": FREE["c1"] | {"velocity": "v2"}}),
        force={"q1": "F*cos(w*t)"},
        parameters={"F": 0.2, "w": 0.7, "S": 0.3, "S1": 0.3},
        period="2*pi/w",
    )


@pytest.mark.parametrize("start", [-0.07, -0.055])
def test_a_mass_that_creeps_rests_where_its_load_just_reaches_the_limit(start: float) -> None:
    """It slips up a little in each period until ``F - 2 q = S``, by the square of what is left."""
    with pytest.raises(cf.ConvergenceError, match="comes to rest at") as caught:
        cf.find_orbit(slipping("S"), state=[start, 0.0, 0.0, 0.0])
    trajectory = caught.value.result
    assert isinstance(trajectory, Trajectory)
    assert trajectory.last[2][:2] == pytest.approx([(0.2 - 0.3) / 2.0, 0.0], abs=1e-5)


def test_a_motion_that_dies_away_next_to_a_stuck_contact_comes_to_rest() -> None:
    """The events that it meets in the end are rounding: it was called aperiodic."""
    with pytest.raises(cf.ConvergenceError, match="comes to rest at") as caught:
        cf.find_orbit(slipping("S", jenkins=True), state=[-0.02, 0.1, 0.0, 0.0, 0.1])
    assert isinstance(caught.value.result, Trajectory)
    q1, q2, *_, stretch = caught.value.result.last[2]
    assert -q1 + 2.0 * q2 + stretch == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_a_random_stuck_branch_off_the_centre_has_no_loose_end(seed: int) -> None:
    """Solutions near its end may go to other orbits: it ends there all the same, and the diagram says why."""
    draw = np.random.default_rng([59, seed])
    about = {"W": 1.06, "k": 1.0545, "kt": 2.267, "zeta": 0.01875, "F": 0.86646, "muN": 0.99391}
    params = {name: value * draw.uniform(0.999, 1.001) for name, value in about.items()}
    diagram = cf.explore(cf.find_orbit("jenkins", params), "muN", (0.8, 1.17))
    assert "SHAKEDOWN" in {end.reason.name for branch in diagram.branches for end in branch.ends}
    assert not diagram.loose_ends
    assert diagram.verify(restarts=1).passed


@pytest.mark.parametrize("force", [0.25, 0.4, 1.2])
def test_an_orbit_is_solved_by_its_own_signature(force: float) -> None:
    """The simulation meets sections, on which an orbit has no joints; where an element rests is left free."""
    found = cf.find_orbit("iwan", {"F": force})
    solved = cf.solve_orbit("iwan", found.signature, found.params)
    assert solved.admissible and solved.residual < 1e-10
    own = [
        canonical_itinerary(orbit.as_whole().itinerary, found.model) for orbit in (solved, found)
    ]
    assert own[0] == own[1]
    if force > 1.0:  # all elements slip
        assert abs(solved.x_max - found.x_max) < 1e-11


@pytest.mark.parametrize("seed", range(3))
def test_where_sliders_begin_to_slip_the_stuck_branch_is_found_from_the_slipping_one(
    seed: int,
) -> None:
    """Two sliders reach both limits at once by a touch; nothing can be held: the flow says what follows."""
    draw = np.random.default_rng([36, seed])
    about = {
        "W": 1.0836,
        "k": 0.9129,
        "c": 0.043,
        "kt": 0.4199,
        "S": 0.05507,
        "n": 1.93,
        "m": 4.627,
    }
    params = {name: value * draw.uniform(0.99, 1.01) for name, value in about.items()}
    orbit = cf.find_orbit("iwan", params | {"F": 0.16}, state=[0.05, 0, 0.05, 0.05, 0.05])
    diagram = cf.explore(orbit, "F", (0.09, 0.17), max_periods=1)
    assert len([b for b in diagram.branches if not b.mirrored]) == 2
    assert not diagram.loose_ends
    assert diagram.verify(restarts=2).faults == ()


@pytest.mark.parametrize("seed", range(3))
def test_the_strongest_of_parallel_sliders_begins_to_creep_while_the_others_slip_both_ways(
    seed: int,
) -> None:
    """All stop at one surface (x' = 0), and only the strongest one has slipped to one side alone."""
    draw = np.random.default_rng([47, seed])
    about = {"W": 1.029, "k": 1.123, "c": 0.0463, "kt": 0.596, "S": 0.0405, "n": 1.803, "m": 3.598}
    params = {name: value * draw.uniform(0.99, 1.01) for name, value in about.items()}
    orbit = cf.find_orbit("iwan", params | {"F": 0.274}, state=[0.05, 0, 0.05, 0.05, 0.05])
    diagram = cf.explore(orbit, "F", (0.25, 0.3), max_periods=1)
    assert not diagram.loose_ends
    assert diagram.verify(restarts=1).passed
    ends = [end for branch in diagram.branches for end in branch.ends if "SHAKE" in end.reason.name]
    assert ends and all(end.bifurcation is not None for end in ends)
    event = ends[0].bifurcation
    assert event is not None
    limit = params["m"] * params["S"] / params["kt"]
    assert np.max(np.abs(event.orbit.cycle[:, 5])) == pytest.approx(limit, abs=1e-9)
    # just beyond it the strong one slips, and to one side only
    time, *state = event.orbit.cycle[0]
    beyond = event.params | {"F": event.params["F"] * (1.0 + 1e-6)}
    run = cf.simulate("iwan", beyond, state=state, time=time, periods=20)
    assert len({exit_ for _, exit_ in run.itinerary} & {"strong+", "strong-"}) == 1


def test_what_grows_on_one_side_grows_in_some_of_its_modes_only() -> None:
    model = cf.load_model("iwan")
    up = (("pps", "strong+"), ("ppp", "weak"))
    down = (
        ("sss", "weak-"),
        ("nss", "middle-"),
        ("nns", "weak"),
        ("sss", "weak+"),
        ("pss", "middle+"),
    )
    assert only_grows(model, up + down) == ("ppp",)
    both = (("nns", "strong-"), ("nnn", "weak"))
    assert only_grows(model, up + down[:2] + both + down[3:]) == ()
    assert only_grows(model, (("pps", "weak"), *down)) == ()


@pytest.mark.parametrize(
    ("seed", "rubbing"), [*((seed, 1 + seed % 2) for seed in range(6)), (6, 3), (7, 5), (8, 10)]
)
def test_a_structure_of_which_friction_never_slips_moves_as_a_linear_one(
    seed: int, rubbing: int
) -> None:
    """The masses at rest are taken out of the matrices; what is left is solved as a linear system."""
    draw = np.random.default_rng(seed)
    n = max(int(draw.integers(2, 6)), rubbing + 1) + (rubbing > 3)
    held = sorted(draw.choice(n, min(rubbing, n - 1), replace=False).tolist())
    chain = np.diag(2.0 + draw.random(n)) - np.eye(n, k=1) - np.eye(n, k=-1)
    mass, amplitudes, w = 1.0 + draw.random(n), draw.normal(size=n), 0.3 + draw.random()
    model = cf.Mechanism(
        mass.tolist(),
        0.2,
        chain,
        contacts={
            f"c{i}": {"kind": "friction", "velocity": f"v{i + 1}", "kinetic": 50, "static": 60}
            for i in held
        },
        force={
            f"q{i + 1}": f"{a!r}*cos(w*t) + {a!r}*sin(2*w*t)"
            for i, a in enumerate(map(float, amplitudes))
        },
        parameters={"w": w},
        period="2*pi/w",
    )
    rest = draw.normal(size=n) * np.isin(range(n), held)
    orbit = cf.find_orbit(model, state=[*rest, *np.zeros(n)])
    free = [i for i in range(n) if i not in held]
    own = np.ix_(free, free)
    waves = [
        np.linalg.solve(
            chain[own] - (k * w) ** 2 * np.diag(mass)[own] + 0.2j * k * w * np.eye(len(free)), f
        )
        for k, f in ((1, amplitudes[free]), (2, -1j * amplitudes[free]))
    ]
    middle = np.linalg.solve(chain[own], -chain[np.ix_(free, held)] @ rest[held])
    t = orbit.joints[:, 0]
    moved = [
        np.real(x * np.exp(1j * k * w * t[:, None])) for k, x in zip((1, 2), waves, strict=True)
    ]
    assert orbit.joints[:, 1:][:, free] == pytest.approx(middle + sum(moved), abs=1e-9)
    assert orbit.joints[:, 1:][:, held] == pytest.approx(
        np.tile(rest[held], (len(t), 1)), abs=1e-12
    )
    assert orbit.admissible
    assert [orbit.quantity(f"work(c{i})") for i in held] == [0.0] * len(held)
    assert all(abs(orbit.quantity(f"max(force(c{i}))")) < 60.0 for i in held)


def test_indices_are_not_summed_where_a_contact_that_rests_begins_to_slip() -> None:
    """Where it slips its map jumps; the orbits at rest are a continuum, which has an index as a whole."""
    model = cf.Mechanism(
        [1.0, 1.0],
        0.05,
        [["2", "-1"], ["-1", "2"]],
        contacts={"c": {"kind": "friction", "velocity": "v2", "kinetic": "0.5", "static": "0.6"}},
        force={"q1": "0.2*cos(w*t)"},
        parameters={"w": 0.9},
        period="2*pi/w",
    )
    diagram = cf.explore(cf.find_orbit(model, state=[0.0, 0.1, 0.0, 0.0]), "w", (0.8, 1.4))
    assert any(b.kind in (cf.Kind.AS, cf.Kind.GS) for b in diagram.bifurcations)
    assert diagram.verify().passed


def many(seed: int, contacts: int, static: float = 1.0) -> cf.Model:
    """A chain of masses of which all but one or two rub, and do not slip at first."""
    draw = np.random.default_rng([5, seed])
    n = contacts + 1 + int(draw.integers(2))
    stiffness = np.diag(2.0 + draw.random(n)) - np.eye(n, k=1) - np.eye(n, k=-1)
    return cf.Mechanism(
        (1.0 + draw.random(n)).tolist(),
        0.05 * stiffness,
        stiffness,
        contacts={
            f"c{i}": {
                "kind": "friction",
                "velocity": f"v{i}",
                "kinetic": "S",
                "static": f"{static!r}*S",
            }
            for i in range(1, contacts + 1)
        },
        force={f"q{n}": "F*cos(w*t)"},
        parameters={"F": 0.3, "w": float(draw.uniform(0.5, 0.9)), "S": 1.0},
        period="2*pi/w",
    )


def transfer(model: cf.Model, contacts: int) -> np.ndarray:
    """The force on each contact at rest, of a force of size 1 on the last mass, by the linear equations."""
    data = json.loads(model.definition)["structure"]
    p, n = model.defaults, len(data["mass"])
    stiffness = np.array(data["stiffness"], dtype=float)
    dynamic = stiffness * (1.0 + 0.05j * p["w"]) - p["w"] ** 2 * np.diag(
        np.array(data["mass"], dtype=float)
    )
    free = list(range(contacts, n))
    moved = np.linalg.solve(dynamic[np.ix_(free, free)], np.eye(len(free))[:, -1])
    return np.asarray(np.abs(dynamic[np.ix_(range(contacts), free)] @ moved))


SLOW = [pytest.param(*case, marks=pytest.mark.slow) for case in ((2, 7), (3, 8))]


@pytest.mark.parametrize(("seed", "contacts"), [(0, 5), (1, 6), *SLOW])
def test_many_contacts_that_never_slip_are_followed_until_one_does(
    seed: int, contacts: int
) -> None:
    """The first slips where the largest of the forces on them, of the linear system, is S."""
    model = many(seed, contacts)
    first = float(1.0 / np.max(transfer(model, contacts)))
    orbit = cf.find_orbit(model, {"F": 0.2 * first}, state=np.zeros(len(model.states)))
    assert len(orbit.system.itinerary) <= 2
    diagram = cf.explore(orbit, "F", (0.1 * first, 1.02 * first), max_periods=1)
    assert not diagram.loose_ends
    events = [b for b in diagram.bifurcations if b.params["F"] < first * (1.0 + 1e-9)]
    assert [b.kind for b in events] == [cf.Kind.AS]
    assert events[0].params["F"] == pytest.approx(first, rel=1e-10)
    assert max(branch.values.max() for branch in diagram.branches) > 1.01 * first
    assert diagram.verify(restarts=2).passed


def test_a_datum_off_the_centre_is_kept_until_its_contact_creeps() -> None:
    """Six contacts: the last rests where its springs pull, and reaches its limit on one side."""
    model = many(9, 6)
    first = float(1.0 / np.max(transfer(model, 6)))
    state = np.zeros(len(model.states))
    state[5] = 0.1
    orbit = cf.find_orbit(model, {"F": 0.2 * first}, state=state)
    assert len(orbit.system.layout.conserved) == 6
    branch, *_ = cf.explore(orbit, "F", (0.1 * first, first), max_periods=1).branches
    assert {end.reason.name for end in branch.ends} == {"RANGE", "SHAKEDOWN"}
    for k in range(0, len(branch), 10):
        assert branch[k].joints[:, 6] == pytest.approx(0.1, abs=1e-12)


@pytest.mark.parametrize("seed", [0, 3])
def test_with_a_higher_static_limit_a_stuck_contact_slips_by_some_length_at_once(seed: int) -> None:
    """A hold there could not be periodic, whatever its length: the branch ends, and says why.

    Beyond it the simulated mass leaves its position, and sticks again at another one.
    """
    draw = np.random.default_rng([61, seed])
    about = {"W": 0.5086, "F": 0.3698, "k": 1.1966, "c": 0.025, "S": 0.2168, "S0": 0.29896}
    params = {name: value * draw.uniform(0.97, 1.03) for name, value in about.items()}
    orbit = cf.find_orbit("braced-chain", params, longest=1000)
    diagram = cf.explore(orbit, "W", (0.97 * params["W"], 1.12 * params["W"]), max_periods=1)
    assert not diagram.loose_ends
    (end,) = (e for e in diagram.branches[0].ends if e.reason.name == "SHAKEDOWN")
    assert end.bifurcation is not None
    last, before = end.bifurcation.orbit, diagram.branches[0][-10]
    beyond = last.params | {"W": last.params["W"] + 1e-4}
    kept, *_ = np.flatnonzero(np.ptp(last.joints[:, 1:], axis=0) < 1e-12)  # its velocity is, too
    for begun, values in ((before, before.params), (last, beyond)):
        time, *state = begun.joints[0]
        run = cf.simulate("braced-chain", values, state=state, time=time, periods=300)
        position = run.states[:, kept]
        assert (abs(position[-1] - position[0]) > 1e-3) == (begun is last)
        assert np.ptp(position[-20:]) < 1e-12
