"""A symmetry with a shift, ``x -> c - x``: the model measured from ``c/2`` is the one without a shift."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import contfric as cf
from contfric.base.resources import bundled_dir
from contfric.models.definition import Model
from contfric.models.reading.files import from_data, loaded
from contfric.plot.appearance.style import row_of
from tests.rescaled import put_in

#: Dry friction that depends on the direction of motion, moved by (Sm - Sp)/2.
DIRECTED = """
name: directed
states: [x, v]
parameters:
  Omega: 0.5
  Sp: 0.3
  Sm: 0.2
  more: 0.1
  zeta: 0.01
period: 2*pi/Omega
define: {c: Sm - Sp}
observables: {u: x - cos(Omega*t)}
surfaces:
  F+: {observable: u, level: Sm + more}
  F-: {observable: u, level: -Sp - more}
  v: {observable: v, level: 0}
modes:
  forward: {in: {v: +}, field: {x: v, v: -u - 2*zeta*v - Sp}}
  backward: {in: {v: -}, field: {x: v, v: -u - 2*zeta*v + Sm}}
  stick: {in: {v: 0, F+: -, F-: +}, field: {x: 0, v: 0}}
symmetry: x -> c - x, v -> -v, t -> t + T/2
quantities: {highest: x_max, lowest: x_min, middle: mean(x), size: "amplitude(x, 1)"}
"""


def model_of(text: str) -> Model:
    return from_data(loaded(yaml.safe_load(text), Path()))


def events(diagram: cf.Diagram, name: str) -> list[tuple[str, float]]:
    found = (e.bifurcation for e in diagram.events)
    return sorted((b.label, b.params[name]) for b in found)


def assert_same(one: cf.Diagram, other: cf.Diagram, name: str) -> None:
    assert sorted(b.name for b in one.branches) == sorted(b.name for b in other.branches)
    first, second = events(one, name), events(other, name)
    assert first and [label for label, _ in first] == [label for label, _ in second]
    assert np.allclose([p for _, p in first], [p for _, p in second], rtol=0, atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_friction_that_depends_on_the_direction_has_the_diagram_of_coulomb(seed: int) -> None:
    rng = np.random.default_rng([621, seed])
    model, shift = model_of(DIRECTED), float(rng.uniform(-0.4, 0.4)) if seed else -0.1
    mean, more = (0.25, 0.1) if seed == 0 else (float(rng.uniform(0.2, 0.3)), 0.08)
    params = {"Omega": 0.5, "Sp": mean - shift / 2, "Sm": mean + shift / 2, "more": more}
    ours = cf.find_orbit(model, params)
    theirs = cf.find_orbit("coulomb", {"Omega": 0.5, "S": mean, "S0": mean + more, "zeta": 0.01})
    assert np.isclose(ours.quantity("size"), theirs.quantity("amplitude(x, 1)"), rtol=1e-10)
    # quantities of the file are in its own coordinates, results of states from the centre
    assert np.isclose(ours.quantity("highest"), ours.x_max + shift / 2, rtol=0, atol=1e-12)
    assert np.isclose(ours.quantity("lowest"), ours.x_min + shift / 2, rtol=0, atol=1e-12)
    span = (0.42, 0.56)
    ours_, theirs_ = cf.explore(ours, "Omega", span), cf.explore(theirs, "Omega", span)
    assert_same(ours_, theirs_, "Omega")
    assert not ours_.loose_ends


def test_the_shift_moves_with_its_parameters() -> None:
    """Its derivatives are those of the model without a symmetry."""
    data = yaml.safe_load(DIRECTED)
    shifted = model_of(DIRECTED)
    plain = from_data(loaded({k: v for k, v in data.items() if k != "symmetry"}, Path()))
    params = {"Omega": 0.5, "Sp": 0.3, "Sm": 0.2, "more": 0.1}
    begun = cf.find_orbit(plain, params)
    again = cf.find_orbit(
        shifted, params, state=[begun.joints[0][1] + 0.05, 0.0], time=begun.joints[0][0]
    )
    gradients = [o.gradient("middle") for o in (begun, again)]
    for name in params:
        assert np.isclose(gradients[0][name], gradients[1][name], rtol=0, atol=1e-9), name


def shifted(data: dict[str, Any], shifts: dict[str, str], symmetry: str) -> dict[str, Any]:
    """Return a model's data with states moved by expressions of parameters."""
    images = {s: f"({s} - ({shift}))" for s, shift in shifts.items()}

    def texts(rows: dict[str, Any]) -> dict[str, Any]:
        return {k: put_in(v, images) for k, v in rows.items()}

    found = {**data, "symmetry": symmetry}
    for key in ("define", "observables", "field"):
        if key in data:
            found[key] = {k: v if k == v else put_in(v, images) for k, v in data[key].items()}
    found["modes"] = {
        n: {**m, **({"field": texts(m["field"])} if "field" in m else {})}
        for n, m in data["modes"].items()
    }
    found["surfaces"] = {
        n: {**s, "level": f"{s.get('level', 0)} + {shifts[s['observable']]}"}
        if s["observable"] in shifts
        else s
        for n, s in data["surfaces"].items()
    }
    return found


#: Bundled models: their states, the symmetry with shifts of them, what varies and where.
SEVERAL = {
    "jenkins": ("x -> {0} - x, v -> -v, z -> {1} - z, t -> t + T/2", ("x", "z"), "W", 0.1),
    "pendulum": ("theta -> {0} - theta, omega -> -omega, t -> t + T/2", ("theta",), "W", 0.01),
}


@pytest.mark.parametrize("name", SEVERAL)
def test_shifts_of_several_states_and_of_angles(name: str) -> None:
    symmetry, states, vary, part = SEVERAL[name]
    data = yaml.safe_load((bundled_dir("models") / f"{name}.yaml").read_text("utf-8"))
    rng, model = np.random.default_rng(len(name)), cf.load_model(name)
    numbers = rng.uniform(-0.7, 0.7, len(states))
    moves = {s: f"{shift!r}" for s, shift in zip(states, (float(n) for n in numbers), strict=True)}
    own = shifted(data, moves, symmetry.format(*(f"2*({m})" for m in moves.values())))
    moved = from_data(loaded(own, Path()))
    centre = model.defaults[vary]
    span = (centre * (1.0 - part), centre * (1.0 + part))
    diagrams = [cf.explore(cf.find_orbit(m, model.defaults), vary, span) for m in (model, moved)]
    assert sorted(b.name for b in diagrams[0].branches) == sorted(
        b.name for b in diagrams[1].branches
    )
    pairs = zip(*(events(d, vary) for d in diagrams), strict=True)
    assert all(a[0] == b[0] and abs(a[1] - b[1]) < 1e-9 for a, b in pairs)


@pytest.mark.parametrize(
    ("symmetry", "says"),
    [
        ("x -> 1 + x, v -> -v, t -> t + T/2", "leaves no x where it is"),
        ("x -> Sp*x + 1, v -> -v, t -> t + T/2", "linear in the states"),
        ("x -> x*x + 1, v -> -v, t -> t + T/2", "linear in the states"),
        ("x -> Sp - x, v -> -v, t -> t + T/2", "is not one of the surfaces"),
        ("x -> T - x, v -> -v, t -> t + T/2", "linear in the states"),
    ],
)
def test_a_shift_that_is_no_symmetry_is_refused(symmetry: str, says: str) -> None:
    data = yaml.safe_load(DIRECTED) | {"symmetry": symmetry}
    with pytest.raises(cf.ModelError, match=says):
        from_data(loaded(data, Path()))


def test_a_picture_says_from_where_a_state_is_measured() -> None:
    model = model_of(DIRECTED)
    assert row_of("x_max", model).label.endswith(f"from {dict(model.origins)['x']}")
    assert (
        "from"
        not in row_of("period", model).label + row_of("x_max", cf.load_model("coulomb")).label
    )


@pytest.mark.parametrize(
    ("shift", "half"),
    [
        ("c", "(Sm - Sp)/2"),
        ("Sm - Sp - 0", "(Sm - Sp)/2"),
        ("-more", "-more/2"),
        ("0.4", "0.4/2"),
        ("2*Sm*more - Sp/zeta + 1", "(1 + 2*Sm*more - Sp*zeta**(-1))/2"),
        ("sqrt(Sm)", "0.5*(sqrt(Sm)-0)"),
    ],
)
def test_what_a_state_is_measured_from_is_shown_as_one_would_write_it(
    shift: str, half: str
) -> None:
    data = yaml.safe_load(DIRECTED)
    for name in ("surfaces", "modes"):
        del data[name]
    data |= {"surfaces": {"v": {"observable": "v", "level": 0, "sliding": "filippov"}}}
    data |= {"field": {"x": "v", "v": f"{shift} - 2*x - 0.1*v - sign(v) + 3*cos(Omega*t)"}}
    data |= {"modes": {"forward": {"in": {"v": "+"}}, "backward": {"in": {"v": "-"}}}}
    model = from_data(
        loaded(data | {"symmetry": f"x -> {shift} - x, v -> -v, t -> t + T/2"}, Path())
    )
    assert dict(model.origins)["x"].replace(" ", "") == half.replace(" ", "")
    at = {"Sp": 0.31, "Sm": 0.17, "more": 0.7, "zeta": 0.05}
    known = at | {"c": at["Sm"] - at["Sp"], "sqrt": np.sqrt}
    assert eval(dict(model.origins)["x"], known) == pytest.approx(
        0.5 * eval(shift, known), abs=1e-15
    )


def test_tables_and_files_say_from_where_a_state_is_measured(tmp_path: Path) -> None:
    model = model_of(DIRECTED)
    origin = dict(model.origins)["x"]
    orbit = cf.find_orbit(model, {"zeta": 0.05})
    branch = cf.continue_orbit(orbit, "Omega", (0.49, 0.51))
    for table in (orbit.to_dataframe(), branch.to_dataframe()):
        assert table.attrs["origins"] == {"x": origin}
    cf.export(branch, tmp_path / "branch.csv")
    names, units = (tmp_path / "branch.csv").read_text().splitlines()[:2]
    said = dict(zip(names.split(","), units.split(","), strict=True))
    assert said["x_max"] == said["stop_1"] == f"1 from {origin}"
    assert "from" not in said["period"] + said["Omega"]
