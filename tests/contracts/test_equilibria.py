"""Equilibria in studies, files, tables and figures, and the messages of what cannot be."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import contfric as cf

STUDY = """
model: popp
params: {F: 0.0, a2: 0.6}
equilibria: {parameter: a2, range: [0.3, 0.8]}
figures: [{kind: equilibria}]
"""


@pytest.fixture(scope="module")
def popp() -> cf.EquilibriumDiagram:
    return cf.explore_equilibria("popp", "a2", (0.3, 0.8), {"F": 0.0})


def test_a_study_of_equilibria(tmp_path: Path, popp: cf.EquilibriumDiagram) -> None:
    path = tmp_path / "rest.yaml"
    path.write_text(STUDY, encoding="utf-8")
    result = cf.run_study(path, out=tmp_path / "out")
    assert result.orbit is None  # nothing asks for one
    found = result.equilibria
    assert found is not None and [e.label for e in found.events] == ["H-"]
    names = {file.name for file in result.files}
    assert names == {"equilibria.csv", "equilibria.npz", "equilibria.png", "run.json"}
    with (tmp_path / "out" / "equilibria.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["event"] for row in rows if row["event"]] == ["H-"]
    points = [row for row in rows if not row["event"]]
    assert len(points) == len(popp.branches[0])
    values = np.array([[float(row["a2"]), float(row["x"])] for row in points])
    assert np.allclose(values[:, 0], values[:, 1], atol=1e-13)  # a0 = a1: x = a2
    entry = json.loads((tmp_path / "out" / "run.json").read_text(encoding="utf-8"))["equilibria"]
    assert entry["events"][0]["lyapunov"] == pytest.approx(-0.375)
    assert "supercritical" in entry["events"][0]["meaning"]


def test_what_is_saved_is_read_again(tmp_path: Path, popp: cf.EquilibriumDiagram) -> None:
    cf.save(popp, tmp_path / "a.npz")
    again = cf.load(tmp_path / "a.npz")
    assert isinstance(again, cf.EquilibriumDiagram) and repr(again) == repr(popp)
    for one, other in zip(popp.branches, again.branches, strict=True):
        assert np.array_equal(one.states, other.states) and one.ends == other.ends
        assert np.array_equal(one.eigenvalues, other.eigenvalues, equal_nan=True)
        assert one.modes == other.modes
    (before,), (after,) = popp.events, again.events
    assert isinstance(before, cf.HopfPoint) and isinstance(after, cf.HopfPoint)
    assert after.lyapunov == before.lyapunov and after.value == before.value
    cf.save(popp.branches[0], tmp_path / "b.npz")
    branch = cf.load(tmp_path / "b.npz")
    assert isinstance(branch, cf.EquilibriumBranch)
    assert np.array_equal(branch.values, popp.branches[0].values)


def test_boundary_points_and_sets_are_saved(tmp_path: Path) -> None:
    path = tmp_path / "focus.yaml"
    path.write_text(
        """
name: focus
states: [x, y]
parameters: {mu: 0.5, a: 0.2, c: 1.0}
autonomous: true
surfaces: {y: {observable: y, level: 0, sliding: filippov}, far: {observable: x, level: 9}}
modes:
  focus: {in: {y: +, far: -}, field: {x: a*x - (y - mu), y: x + a*(y - mu)}}
  push: {in: {y: -, far: -}, field: {x: c, y: 1}}
  still: {in: {far: +}, field: {x: 0, y: -y}}
""",
        encoding="utf-8",
    )
    found = cf.explore_equilibria(path, "mu", (-1.0, 1.0))
    cf.save(found, tmp_path / "a.npz")
    again = cf.load(tmp_path / "a.npz")
    assert isinstance(again, cf.EquilibriumDiagram)
    (before,), (after,) = found.of_kind("BE"), again.of_kind("BE")
    assert isinstance(after, cf.BoundaryPoint) and isinstance(before, cf.BoundaryPoint)
    assert (after.unfolding, after.partner) == (before.unfolding, before.partner)
    assert after.product == before.product
    assert len(again.sets) == len(found.sets) > 0
    assert again.sets[0].ends[0][0] == found.sets[0].ends[0][0] == "far"


def test_figures_tell_stable_from_unstable(popp: cf.EquilibriumDiagram) -> None:
    ax = popp.plot()
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert {"stable", "unstable"} < set(texts) and len(texts) == len(set(texts))
    assert any("Hopf point" in text for text in texts)
    styles = {line.get_linestyle() for line in ax.get_lines()}
    assert {"-", "--"} <= styles
    assert [line.get_gid() for line in ax.get_lines() if line.get_marker() == "h"] == ["H-"]
    assert ax.get_xlim() == (0.3, 0.8)
    assert popp.branches[0].plot(state="v").get_ylabel() == "$v$"
    with pytest.raises(cf.ParameterError, match="no state 'w'"):
        popp.branches[0].plot(state="w")


def test_tables(popp: cf.EquilibriumDiagram) -> None:
    frame = popp.to_dataframe()
    assert list(frame.columns) == ["a2", "mode", "x", "v", "stable", "admissible", "branch"]
    points = cf.find_equilibria("popp", {"F": 0.0}).to_dataframe()
    assert points["location"].tolist() == ["virtual", "admissible"]


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("equilibria: {parameter: a3, range: [0, 1]}", "no parameter 'a3'"),
        ("equilibria: {parameter: a2, range: [1, 0]}", "lower first"),
        ("equilibria: {parameter: a2, range: [0]}", "two finite numbers"),
        ("equilibria: {parameter: a2, range: [0, 1], starts: 0}", ">= 1"),
        ("figures: [{kind: equilibria}]", "needs 'equilibria'"),
    ],
)
def test_mistakes_are_told_with_their_lines(tmp_path: Path, line: str, says: str) -> None:
    path = tmp_path / "wrong.yaml"
    path.write_text(f"model: popp\nparams: {{F: 0.0}}\n{line}\n", encoding="utf-8")
    with pytest.raises(cf.StudyError, match=says) as error:
        cf.run_study(path, out=tmp_path / "out")
    assert "wrong.yaml:3" in str(error.value)


def test_equilibria_are_drawn_into_a_diagram_of_the_same_parameter(tmp_path: Path) -> None:
    path = tmp_path / "both.yaml"
    path.write_text(
        """
model: belt
params: {vb: 0.5}
explore: {parameter: vb, range: [0.3, 1.0]}
equilibria: {parameter: vb, range: [0.3, 1.0]}
want: [extrema]
figures: [{kind: diagram, rows: [x_max]}]
""",
        encoding="utf-8",
    )
    result = cf.run_study(path, out=tmp_path / "out")
    assert result.diagram is not None and result.equilibria is not None
    assert (tmp_path / "out" / "diagram.png").stat().st_size > 10_000
    assert result.info["equilibria"]["branches"][0]["modes"] == ["rise"]
