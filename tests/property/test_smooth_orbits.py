"""Models without a surface at rest: orbits that meet no surface, and what grazes one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from by_scipy import after
from typed import typed

import contfric as cf
from contfric.models.shorthand.chatter import with_chatter

MODELS = Path(__file__).parents[1] / "models"
RANDOM = np.random.default_rng(13)


def amplitude(params: dict[str, float]) -> float:
    """Return the amplitude of the linear response."""
    omega, zeta = params["omega"], params["zeta"]
    return float(params["A"] / np.hypot(1.0 - omega**2, 2.0 * zeta * omega))


def linear_multipliers(params: dict[str, float]) -> np.ndarray:
    """Return the multipliers of the linear oscillator."""
    roots = np.roots([1.0, 2.0 * params["zeta"], 1.0])
    return np.sort_complex(np.exp(roots * 2.0 * np.pi / params["omega"]))


def drawn(count: int) -> list[dict[str, float]]:
    """Return parameters below the resonance: a stop bends the branch from the grazing to closer stops."""
    return [
        {
            "omega": float(RANDOM.uniform(0.3, 0.9)),
            "zeta": float(RANDOM.uniform(0.02, 0.3)),
            "k": float(10.0 ** RANDOM.uniform(-1.0, 0.5)),
            "A": float(RANDOM.uniform(0.5, 1.5)),
        }
        for _ in range(count)
    ]


@pytest.mark.parametrize("params", drawn(6), ids=str)
@pytest.mark.parametrize("name", ["soft_stops", "bilinear"])
def test_the_linear_motion_takes_over_where_stops_are_grazed(
    name: str, params: dict[str, float]
) -> None:
    size = amplitude(params)
    found = cf.explore(
        cf.find_orbit(MODELS / f"{name}.yaml", {**params, "gap": 0.9 * size}),
        "gap",
        (0.8 * size, 1.2 * size),
    )
    assert [str(end) for end in found.loose_ends] == []
    grazing = [b.params["gap"] for b in found.bifurcations if b.kind is cf.Kind.GS]
    assert min(abs(gap - size) for gap in grazing) < 1e-11
    free = max(found.branches, key=lambda branch: branch.params["gap"].max())
    assert free.params["gap"].max() == pytest.approx(1.2 * size)
    assert free.x_max == pytest.approx(np.full(len(free), size), abs=1e-11)
    apart = np.sort_complex(free.multipliers[-1]) - linear_multipliers(params)
    assert np.abs(apart).max() < 1e-11


@pytest.mark.parametrize("seed", range(4))
def test_a_wall_gives_one_diagram_from_every_branch(seed: int) -> None:
    draw = np.random.default_rng(seed)
    params = {"omega": draw.uniform(0.6, 0.9), "zeta": 0.05, "A": 1.0, "r": draw.uniform(0.4, 0.9)}
    size = amplitude(params)
    low, high = 0.95 * size, 1.05 * size
    answer = 1.0 / (1.0 - params["omega"] ** 2 + 2j * params["zeta"] * params["omega"])
    state = (answer.real, -params["omega"] * answer.imag)  # other solutions hit the wall
    free = cf.find_orbit(MODELS / "one_wall.yaml", {**params, "gap": 1.02 * size}, state=state)
    assert free.signature.segments == ("free-", "free")
    found = cf.explore(free, "gap", (low, high), max_periods=2)
    [grazing] = [e for e in found.events if abs(e.bifurcation.params["gap"] - size) < 1e-11]
    assert len(grazing.branches) >= 2
    assert [str(end) for end in found.loose_ends] == []
    for branch in found.branches:
        again = cf.explore(branch[len(branch) // 2], "gap", (low, high), max_periods=2)
        [same] = [e for e in again.events if abs(e.bifurcation.params["gap"] - size) < 1e-11]
        itineraries = [
            {(d.branches[i][1].signature.canonical, d.branches[i][1].periods) for i in e.branches}
            for d, e in ((found, grazing), (again, same))
        ]
        assert itineraries[0] == itineraries[1]


@pytest.mark.parametrize(
    ("name", "start", "parameter", "span"),
    [
        ("preloaded", {"A": 0.3}, "A", (0.1, 3.0)),
        ("preloaded", {"A": 1.8}, "A", (0.1, 3.0)),
        ("driven_box", {"d": 9.0}, "d", (1.5, 9.0)),
        ("soft_pendulum", {}, "p", (0.05, 1.0)),
    ],
)
def test_nothing_differs_from_another_start(
    name: str, start: dict[str, float], parameter: str, span: tuple[float, float]
) -> None:
    diagram = cf.explore(cf.find_orbit(MODELS / f"{name}.yaml", start), parameter, span)
    report = diagram.verify()
    assert report.restarts and not report.faults, str(report)


def test_a_smooth_orbit_of_several_modes_doubles() -> None:
    """The phase divides all of a model's modes; joints of one are not those of another."""
    orbit = cf.find_orbit(MODELS / "soft_pendulum.yaml")
    diagram = cf.explore(orbit, "p", (0.05, 1.0))
    doubling = next(
        b
        for b in diagram.bifurcations
        if b.kind is cf.Kind.PD and set(b.orbit.signature.segments) == {"free", "free-"}
    )
    p, omega = doubling.params, doubling.params["omega"]

    def field(t: float, y: np.ndarray) -> tuple[float, float]:
        pull = (1.0 + p["p"] * np.cos(omega * t)) * np.sin(y[0])
        return y[1], -2.0 * p["zeta"] * y[1] - pull + p["e"] * np.cos(omega * t)

    def turn(start: np.ndarray) -> np.ndarray:
        return after(field, start, (0.0, 2.0 * np.pi / omega))

    start = doubling.orbit.state(0.0)
    assert np.abs(turn(start) - start).max() < 1e-9
    steps = 1e-5 * np.eye(2)
    columns = np.array([(turn(start + h) - turn(start - h)) / 2e-5 for h in steps]).T
    assert np.abs(np.linalg.eigvals(columns) + 1.0).min() < 1e-5


def test_a_model_needs_no_surface_at_all(tmp_path: Path) -> None:
    """The Duffing oscillator: its folds, held against a shooting method of scipy's."""
    branch = cf.continue_orbit(
        cf.find_orbit(
            typed(
                tmp_path,
                "name: duffing\nstates: [x, v]\nparameters: {w: 1.2, zeta: 0.05, A: 0.3}\nperiod: 2*pi/w\n"
                "field: {x: v, v: -x - x**3 - 2*zeta*v + A*cos(w*t)}\n",
            )
        ),
        "w",
        (1.0, 2.0),
    )
    folds = [b for b in branch.bifurcations if b.kind is cf.Kind.SN]
    assert len(folds) == 2
    for fold in folds:
        w = fold.params["w"]

        def field(t: float, y: np.ndarray, w: float = w) -> tuple[float, float]:
            return y[1], -y[0] - y[0] ** 3 - 0.1 * y[1] + 0.3 * np.cos(w * t)

        def turn(start: np.ndarray, w: float = w) -> np.ndarray:
            return after(field, start, (0.0, 2.0 * np.pi / w))

        start = fold.orbit.state(0.0)
        assert np.abs(turn(start) - start).max() < 1e-9
        steps = 1e-5 * np.eye(2)
        columns = np.array([(turn(start + h) - turn(start - h)) / 2e-5 for h in steps]).T
        assert np.abs(np.linalg.eigvals(columns) - 1.0).min() < 1e-4


def test_a_model_without_surfaces_in_which_nothing_moves_is_refused(tmp_path: Path) -> None:
    text = "name: a\nstates: [x, v]\nparameters: {c: 1}\nperiod: 2*pi/c\nfield: {x: 0, v: 0}\n"
    (tmp_path / "a.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(cf.ModelError, match="surface"):
        cf.load_model(tmp_path / "a.yaml")


def test_an_orbit_around_a_centre_is_one_of_a_family(tmp_path: Path) -> None:
    """Of ``x'' = -c x`` every solution is an orbit, of period ``2 pi / c^(1/2)`` and with a multiplier 1."""
    text = "name: a\nstates: [x, v]\nparameters: {c: 4}\nautonomous: true\nfield: {x: v, v: -c*x}\n"
    (tmp_path / "a.yaml").write_text(text, encoding="utf-8")
    found = cf.find_orbit(cf.load_model(tmp_path / "a.yaml"), {}, state=[0.7, 0.0])
    assert found.period == pytest.approx(np.pi, rel=1e-12)
    assert np.abs(found.multipliers - 1.0).min() < 1e-6


@pytest.mark.parametrize("gap", [0.3, 0.8, 1.2, 2.0])
def test_a_mass_at_rest_on_a_wall_leaves_it_where_nothing_presses(gap: float) -> None:
    resting = with_chatter(cf.load_model(MODELS / "one_wall.yaml"))
    assert resting is not None
    params = {"gap": gap, "omega": 0.8, "A": 1.0, "zeta": 0.05}
    found = cf.simulate(resting, params, state=(gap, 0.0), periods=1)
    rests = found.itinerary[0][0] == "chatter"
    assert rests == (np.cos(0.0) - gap > 0.0)  # the force on a mass there


def test_labels_leave_the_phase_out() -> None:
    size = amplitude({"omega": 0.5, "zeta": 0.05, "A": 1.0})
    orbit = cf.find_orbit(MODELS / "soft_stops.yaml", {"omega": 0.5, "k": 1.0, "gap": 0.7 * size})
    assert str(orbit.signature) == "pressed -> free -> drawn -> free"
    assert orbit.signature.mirror() == orbit.signature.rotate(2)
    solved = cf.solve_orbit(orbit.model, orbit.signature, orbit.params)
    assert solved.x_max == pytest.approx(orbit.x_max, abs=1e-12)


def test_regions_may_have_names_of_their_own(tmp_path: Path) -> None:
    text = (MODELS / "soft_stops.yaml").read_text(encoding="utf-8")
    size = amplitude({"omega": 0.5, "zeta": 0.05, "A": 1.0})
    orbit = cf.find_orbit(
        typed(tmp_path, text + "domains: {middle: {mode: free, in: {right: -, left: +}}}\n"),
        {"omega": 0.5, "k": 1.0, "gap": 0.7 * size},
    )
    assert str(orbit.signature) == "pressed -> middle -> drawn -> middle"


def test_a_mass_that_never_slips_while_another_one_moves() -> None:
    """The ground holds one of two masses; the other is a linear oscillator."""
    model = MODELS / "stuck_mass.yaml"
    orbit = cf.find_orbit(model, {"mu": 2.0})
    assert set(orbit.signature.segments) == {"stick", "stick-"}
    roots = np.roots([1.0, 0.1, 1.5])
    wanted = np.sort_complex(np.exp(roots * 2.0 * np.pi / 0.7))
    moving = np.sort_complex(orbit.multipliers[np.abs(orbit.multipliers) > 1e-3])
    assert moving == pytest.approx(wanted, abs=1e-10)
    branch = cf.continue_orbit(orbit, "mu", (0.1, 3.0))
    at = branch.ends[0].bifurcation
    assert at is not None
    rest = orbit.state(0.0)[2]
    pull = 0.5 * (1.0 / abs(1.5 - 0.49 + 0.07j)) + abs(1.5 * rest - 0.25 * rest / 1.5)
    assert at.params["mu"] == pytest.approx(pull, abs=1e-9)


@pytest.mark.parametrize(
    "params",
    [
        {"zeta": 0.05, "a": 1.0, "f": 0.5, "omega": 0.5},
        {"zeta": 0.01, "a": 0.2, "f": 0.3, "omega": 0.6},  # superharmonic resonances with folds
        {"zeta": 0.02, "a": -0.3, "f": 0.05, "omega": 1.5},  # a softening one
        {"zeta": 0.1, "a": 1.0, "f": 4.0, "omega": 0.6},  # other pairs of folds and multipliers
    ],
    ids=str,
)
def test_long_steps_along_smooth_branches_miss_nothing(params: dict[str, float]) -> None:
    orbit = cf.find_orbit(MODELS / "duffing.yaml", params)
    short = cf.continue_orbit(orbit, "omega", (0.3, 3.0), max_step=0.01)
    branch = cf.continue_orbit(orbit, "omega", (0.3, 3.0))
    assert len(branch) < 0.4 * len(short)
    assert [end.reason for end in branch.ends] == [end.reason for end in short.ends]
    assert short.bifurcations
    for found, known in zip(branch.bifurcations, short.bifurcations, strict=True):
        assert found.kind is known.kind
        assert found.params["omega"] == pytest.approx(known.params["omega"], abs=1e-9)


def test_steps_next_to_a_surface_are_short_as_ever() -> None:
    params = {"omega": 0.5, "zeta": 0.1, "k": 1.0, "A": 1.0}
    size = amplitude(params)
    orbit = cf.find_orbit(MODELS / "bilinear.yaml", {**params, "gap": 2.0 * size})
    bounds = (1.5 * size, 2.5 * size)  # its stops are never met, and might be
    found, same = (cf.continue_orbit(orbit, "gap", bounds, max_step=m) for m in (None, 0.01))
    assert len(found) == len(same) > 30
