"""Export: what other programs read is what the results say."""

from __future__ import annotations

import csv
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat

import contfric as cf

PARAMS = {"Omega": 0.5, "S": 0.32, "S0": 0.4}


def read_csv(path: Path) -> tuple[dict[str, list[str]], dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        names, units, *rows = list(csv.reader(file))
    columns = dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))
    return columns, dict(zip(names, units, strict=True))


def read_mat(path: Path) -> dict[str, Any]:
    return loadmat(path, simplify_cells=True)


def test_points_and_events_of_a_diagram_in_csv(diagram: cf.Diagram, tmp_path: Path) -> None:
    points_file, events_file = cf.export(diagram, tmp_path / "d.csv")
    assert (points_file.name, events_file.name) == ("d.csv", "d-events.csv")
    points, units = read_csv(points_file)
    assert len(points["Omega"]) == sum(len(branch) for branch in diagram.branches)
    branch = next(b for b in diagram.branches if b.name == "2s")
    number = str(diagram.branches.index(branch) + 1)
    own = [k for k, name in enumerate(points["branch"]) if name == number]
    assert [float(points["x_max"][k]) for k in own] == branch.x_max.tolist()
    assert [float(points["period"][k]) for k in own] == branch.period.tolist()
    assert branch.multipliers is not None
    for k in range(2):
        real = [float(points[f"multiplier_{k + 1}_re"][i]) for i in own]
        imag = [float(points[f"multiplier_{k + 1}_im"][i]) for i in own]
        assert (np.array(real) + 1j * np.array(imag)).tolist() == branch.multipliers[:, k].tolist()
    assert (units["x_max"], units["signature"]) == ("1", "")
    events, _ = read_csv(events_file)
    assert [float(x) for x in events["Omega"]] == [b.params["Omega"] for b in diagram.bifurcations]
    for node, numbers, names in zip(
        diagram.events, events["branches"], events["signatures"], strict=True
    ):
        assert numbers == " ".join(str(k + 1) for k in node.branches)
        assert names == "; ".join(diagram.branches[k].name for k in node.branches)
    fold = events["kind"].index("SN")
    assert float(events["multiplier_1_re"][fold]) == pytest.approx(1.0, abs=1e-6) or float(
        events["multiplier_2_re"][fold]
    ) == pytest.approx(1.0, abs=1e-6)


def test_points_and_events_of_a_diagram_in_mat(diagram: cf.Diagram, tmp_path: Path) -> None:
    (file,) = cf.export(diagram, tmp_path / "d.mat")
    got = read_mat(file)
    values = np.concatenate([branch.values for branch in diagram.branches])
    np.testing.assert_array_equal(got["points"]["Omega"], values)
    names = [branch.name for branch in diagram.branches for _ in branch.values]
    assert got["points"]["signature"].tolist() == names
    assert got["events"]["label"].tolist() == [b.label for b in diagram.bifurcations]
    assert got["model"] == "coulomb" and got["units"]["period"] == "1"


def test_an_orbit(orbit: cf.Orbit, tmp_path: Path) -> None:
    (file,) = cf.export(orbit, tmp_path / "1a.mat")
    got = read_mat(file)
    times, states, names = orbit.trajectory()
    np.testing.assert_array_equal(got["points"]["t"], times)
    np.testing.assert_array_equal(got["points"]["v"], states[:, 1])
    assert got["points"]["domain"].tolist() == names
    assert got["params"] == orbit.params and got["signature"] == str(orbit.signature)
    np.testing.assert_array_equal(got["joints"], orbit.joints)
    np.testing.assert_array_equal(got["multipliers"], orbit.multipliers)
    assert [path.name for path in cf.export(orbit, tmp_path / "1a.csv")] == ["1a.csv"]
    columns, _ = read_csv(tmp_path / "1a.csv")
    assert [float(x) for x in columns["x"]] == states[:, 0].tolist()


def test_curves_and_branches(orbit: cf.Orbit, tmp_path: Path) -> None:
    branch = cf.continue_orbit(orbit, "Omega", (0.49, 0.55))
    (file,) = cf.export(branch, tmp_path / "b.mat")
    got = read_mat(file)
    np.testing.assert_array_equal(got["points"]["stop_1"], branch.stops[:, 0])
    fold = next(b for b in branch.bifurcations if b.kind is cf.Kind.SN)
    curve = cf.continue_bifurcation(
        fold, ("Omega", "S"), {"Omega": (0.53, 0.56), "S": (0.31, 0.33)}
    )
    (file,) = cf.export(curve, tmp_path / "c.mat")
    got = read_mat(file)
    for name in ("Omega", "S"):
        np.testing.assert_array_equal(got["points"][name], curve.params[name])
    assert set(got["points"]["kind"].tolist()) == {"SN"}


def test_units_of_the_model(tmp_path: Path) -> None:
    """A model that is measured in parts of a metre and of a second says so in the row of units."""
    text = (Path(__file__).parents[1] / "models" / "bilinear.yaml").read_text(encoding="utf-8")
    (tmp_path / "small.yaml").write_text(text + "units: {x: 0.5, v: 0.5}\n", encoding="utf-8")
    orbit = cf.find_orbit(tmp_path / "small.yaml")
    cf.export(orbit, tmp_path / "o.csv")
    _, units = read_csv(tmp_path / "o.csv")
    assert units == {"t": "1", "x": "0.5", "v": "0.5", "domain": ""}


def test_bad_input_is_one_line(orbit: cf.Orbit, tmp_path: Path) -> None:
    with pytest.raises(cf.ParameterError, match=r"end with \.mat or \.csv; got .*x\.xls"):
        cf.export(orbit, tmp_path / "x.xls")
    with pytest.raises(
        cf.ParameterError, match=r"Orbit, Branch, Diagram, Curve, Plane, .*; got int"
    ):
        cf.export(3, tmp_path / "x.mat")  # type: ignore[arg-type]
    with pytest.raises(cf.ResultFileError, match="nowhere"):
        cf.export(orbit, tmp_path / "nowhere" / "x.csv")


# ----------------------------------------------------------------------------------- xarray


def test_maps_basins_and_sweeps_as_datasets() -> None:
    pytest.importorskip("xarray")
    axes = {"Omega": [0.45, 0.5, 0.55], "S": [0.3, 0.32]}
    lmap = cf.lyapunov_map("coulomb", axes, {"S0": 0.4}, periods=100)
    data = lmap.to_xarray()
    got = data["exponents"].sel(Omega=0.5, S=0.32).to_numpy()
    np.testing.assert_array_equal(got, lmap.exponents[1, 1])
    starts = {"x": np.linspace(-1, 1, 4), "v": np.linspace(-1, 1, 3)}
    found = cf.basins("coulomb", starts, PARAMS)
    labelled = found.to_xarray()
    np.testing.assert_array_equal(labelled["orbit"].sel(v=1.0), found.labels[:, 2])
    assert str(labelled["name"][0, 0].item()) == found.names[found.labels[0, 0]]
    swept = cf.sweep("coulomb", "Omega", [0.5, 0.51], {"S": 0.32, "S0": 0.4})
    points = swept.to_xarray()
    np.testing.assert_array_equal(
        points["x"], [x for r in swept.runs.values() for x in r.states[:, 0]]
    )
    assert points["outcome"].sizes == {"direction": 2, "Omega": 2}
    assert points["period"].sel(direction="down").to_numpy().tolist() == list(
        swept.runs["down"].periods
    )


def test_a_missing_package_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    swept = cf.sweep("coulomb", "Omega", [0.5, 0.51], {"S": 0.32, "S0": 0.4})
    with pytest.raises(ImportError, match=r"contfric\[xarray\]"):
        swept.to_xarray()


def every_table() -> dict[str, Any]:
    """Return a result of each kind that is one table."""
    fixed, lower = {"S": 0.32, "S0": 0.4}, {"Omega": (0.48, 0.55), "S": (0.25, 0.35)}
    orbit = cf.solve_orbit("coulomb", "1a", PARAMS)
    starts = {"x": [-1.0, 1.0], "v": [-0.5, 0.5]}
    held = cf.continue_quantity(orbit, "x_max", 1.43, ("Omega", "S"), lower, max_step=0.2)
    return {
        "sweep": cf.sweep("coulomb", "Omega", [0.45, 0.5], fixed),
        "returns": cf.poincare("coulomb", PARAMS, periods=5),
        "releases": cf.release_map("coulomb", PARAMS, count=20),
        "basins": cf.basins("coulomb", starts, PARAMS),
        "map": cf.lyapunov_map("coulomb", {"Omega": [0.4, 0.5], "S": [0.1, 0.2]}, periods=20),
        "curve": held,
        "fit": cf.fit("coulomb", [cf.Measured("x_max", 1.42, 0.01)], {**PARAMS, "S": 0.31}, ["S"]),
        "trajectory": cf.simulate("coulomb", PARAMS, periods=3),
    }


def test_every_table_is_exported(tmp_path: Path) -> None:
    for name, x in every_table().items():
        (file,) = cf.export(x, tmp_path / f"{name}.csv")
        got, units = read_csv(file)
        (matlab,) = cf.export(x, tmp_path / f"{name}.mat")
        points = read_mat(matlab)["points"]
        for column, values in x.columns().items():
            if np.asarray(values).dtype.kind in "if":
                np.testing.assert_array_equal(np.array(got[column], dtype=float), values)
                np.testing.assert_array_equal(points[column.replace("(", "_")], values)
                assert units[column] == "1", (name, column)


def test_an_ensemble_has_samples_and_events(tmp_path: Path) -> None:
    box = {"S": (0.3, 0.34)}
    found = cf.ensemble("coulomb", "Omega", (0.48, 0.55), box, {"Omega": 0.5}, samples=4)
    samples, events = cf.export(found, tmp_path / "e.csv")
    assert len(read_csv(samples)[0]["S"]) == 4
    assert read_csv(events)[0]["Omega"] == [str(v) for v in found.rows.event_value.tolist()]


def test_units_of_columns_are_those_of_the_model(tmp_path: Path) -> None:
    """A pendulum's file in its own units, scaled: states and times have theirs."""
    model = cf.load_model("coulomb")
    scaled = replace(model, units=(("x", 0.002), ("v", 0.5), ("t", 0.004)))
    swept = cf.sweep(scaled, "Omega", [0.45, 0.5], {"S": 0.32, "S0": 0.4})
    _, units = read_csv(cf.export(swept, tmp_path / "s.csv")[0])
    assert (units["x"], units["v"], units["t"]) == ("0.002", "0.5", "0.004")
    assert (units["Omega"], units["mode"], units["period"]) == ("1", "", "1")
    releases = cf.release_map(scaled, PARAMS, count=20)
    _, units = read_csv(cf.export(releases, tmp_path / "r.csv")[0])
    assert (units["phase"], units["time"], units["branch"]) == ("0.004", "0.004", "1")


@pytest.mark.parametrize("suffix", ["csv", "mat"])
def test_equilibria_with_their_events(suffix: str, tmp_path: Path) -> None:
    found = cf.explore_equilibria("popp", "a2", (0.3, 0.8), {"F": 0.0}, values=2)
    for result in (found, found.branches[0]):
        files = cf.export(result, tmp_path / f"rest.{suffix}")
        if suffix == "csv":
            (points, _), (events, _) = map(read_csv, files)
        else:
            both = read_mat(files[0])
            points = {name: np.atleast_1d(x).tolist() for name, x in both["points"].items()}
            events = {name: np.atleast_1d(x).tolist() for name, x in both["events"].items()}
        branches = found.branches if result is found else found.branches[:1]
        values = np.concatenate([branch.values for branch in branches])
        assert [float(a2) for a2 in points["a2"]] == values.tolist()
        assert [float(e) for e in events["a2"]] == [event.value for event in result.events]
        assert events["kind"] == [event.kind.value for event in result.events] != []
