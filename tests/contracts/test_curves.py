"""Curves and planes: what they refuse, what they keep, what they draw."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import contfric as cf

PLANE = ("Omega", "S")
RANGES = {"Omega": (0.48, 0.58), "S": (0.28, 0.39)}
START = {"Omega": 0.5, "S": 0.32, "S0": 0.4}


@pytest.fixture(scope="module")
def fold(branch):
    return next(b for b in branch.bifurcations if b.kind is cf.Kind.SN)


@pytest.fixture(scope="module")
def curve(fold):
    return cf.continue_bifurcation(fold, PLANE, RANGES)


@pytest.fixture(scope="module")
def plane():
    orbit = cf.find_orbit("coulomb", START)
    return cf.explore_plane(orbit, PLANE, RANGES, max_sections=2, max_periods=1, seeds=None)


@pytest.mark.slow
def test_sections_start_from_orbits_of_few_periods() -> None:
    # at S = 0.015 attractors have 54 periods; explored up to that number, fig11 did not end
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.6, "S0": 0.8})
    box = {"Omega": (0.1, 0.9), "S": (0.01, 0.8)}
    sections = {"S": [0.015, 0.02]}
    plane = cf.explore_plane(orbit, PLANE, box, sections=sections, max_sections=2, max_periods=1)
    assert len(plane.sections) == 2
    for section in plane.sections:
        assert section.settings.max_periods == 1
        assert not any("raised" in note for note in section.notes)
        assert all(branch[0].periods == 1 for branch in section.branches)


# ------------------------------------------------------------------------------ what is refused


@pytest.mark.parametrize(
    ("parameters", "ranges", "says"),
    [
        (("Omga", "S"), RANGES, "did you mean 'Omega'"),
        (("Omega", "Omega"), RANGES, "different parameters"),
        (("Omega",), RANGES, "pair of parameters"),
        ("OS", RANGES, "pair of parameters"),
        (PLANE, {"Omega": (0.4, 0.6)}, "range of 'S' is missing"),
        (PLANE, {**RANGES, "h": (0.0, 0.1)}, "'h' is not one of the parameters that vary"),
        (PLANE, {**RANGES, "S": (0.4, 0.3)}, "lower first"),
        (PLANE, {**RANGES, "S": (0.3, np.inf)}, "finite"),
        (PLANE, {**RANGES, "S": 0.3}, "pair of numbers"),
        (PLANE, {**RANGES, "S": (0.33, 0.39)}, "outside of the ranges"),
    ],
)
def test_wrong_planes(fold, parameters, ranges, says) -> None:
    with pytest.raises(cf.ParameterError, match=says):
        cf.continue_bifurcation(fold, parameters, ranges)


def test_wrong_starts(branch, fold) -> None:
    with pytest.raises(cf.ParameterError, match="starts from a Bifurcation"):
        cf.continue_bifurcation(branch[0], PLANE, RANGES)
    with pytest.raises(cf.ParameterError, match="no PD"):
        cf.continue_bifurcation(replace(fold, kind=cf.Kind.PD), PLANE, RANGES)
    with pytest.raises(cf.ParameterError, match="breaks no symmetry"):
        cf.continue_bifurcation(replace(fold, kind=cf.Kind.BP), PLANE, RANGES)
    with pytest.raises(cf.ParameterError, match="no NS"):
        cf.continue_bifurcation(replace(fold, kind=cf.Kind.NS), PLANE, RANGES)
    with pytest.raises(cf.ParameterError, match="not located"):
        cf.continue_bifurcation(replace(fold, located=False), PLANE, RANGES)
    with pytest.raises(cf.ParameterError, match="which margin"):
        cf.continue_bifurcation(replace(fold, kind=cf.Kind.CS), PLANE, RANGES)
    sliding = next(b for b in branch.bifurcations if b.kind is cf.Kind.CS)
    moved = replace(sliding, orbit=branch[len(branch) // 2])
    with pytest.raises(cf.ParameterError, match="not zero"):
        cf.continue_bifurcation(moved, PLANE, RANGES)
    regular = replace(fold, orbit=branch[10])
    with pytest.raises(cf.ParameterError, match="is no SN"):
        cf.continue_bifurcation(regular, PLANE, RANGES)


@pytest.mark.parametrize("step", [0.0, 2.0, "small", True])
def test_wrong_steps(fold, step) -> None:
    with pytest.raises(cf.ParameterError, match="max_step"):
        cf.continue_bifurcation(fold, PLANE, RANGES, max_step=step)


def test_wrong_sections() -> None:
    orbit = cf.find_orbit("coulomb", START)
    with pytest.raises(cf.ParameterError, match="outside"):
        cf.explore_plane(orbit, PLANE, RANGES, {"S": [0.1]})
    with pytest.raises(cf.ParameterError, match="sections"):
        cf.explore_plane(orbit, PLANE, RANGES, {"h": [0.1]})
    with pytest.raises(cf.ParameterError, match="did you mean 'PD'"):
        cf.explore_plane(orbit, PLANE, RANGES, kinds=["PDD"])
    with pytest.raises(cf.ParameterError, match="from an Orbit"):
        cf.explore_plane("1a", PLANE, RANGES)


# --------------------------------------------------------------------------------- what it holds


def test_points_are_orbits(curve) -> None:
    assert curve.label == "SN_1a"
    assert curve.kind is cf.Kind.SN
    middle = curve[len(curve) // 2]
    assert middle.params["Omega"] == curve.params["Omega"][len(curve) // 2]
    assert middle.admissible
    assert np.min(np.abs(middle.multipliers - 1.0)) < 1e-7
    assert curve[-1].params["S"] == curve.params["S"][-1]
    with pytest.raises(IndexError):
        curve[len(curve)]
    assert len(list(curve)) == len(curve) == len(curve.kinds) == len(curve.stable)
    assert np.all(np.diff(curve.arc) > 0.0)


def test_every_point_is_admissible(plane) -> None:
    for curve in plane.curves:
        for part in curve.parts:
            pinned = set() if part.problem is None else set(part.problem.condition.pinned.tolist())
            for k in range(1, len(part) - 1):
                orbit = part.problem.orbit(part.joints[k], part.values[k])
                assert np.all(orbit.ends[:, 0] - orbit.cycle[:, 0] > -1e-9), curve
                worst = min(m for j, m in enumerate(orbit.margins) if j not in pinned)
                assert worst > -1e-9, (curve, k)


def test_ends_say_why(curve) -> None:
    reasons = {end.reason.name for end in curve.ends}
    assert reasons == {"MEETS", "RANGE"}
    assert all(str(end) for end in curve.ends)
    assert "SN-CS" in repr(curve)


def test_largest_number_of_points(fold) -> None:
    short = cf.continue_bifurcation(fold, PLANE, RANGES, max_points=3)
    assert {end.reason.name for end in short.ends} == {"POINTS"}


def test_tables(curve, plane) -> None:
    pytest.importorskip("pandas")
    table = curve.to_dataframe()
    assert list(table["Omega"]) == curve.params["Omega"].tolist()
    assert set(plane.to_dataframe()["label"]) == {c.label for c in plane.curves}


def test_saved_and_read(curve, plane, tmp_path) -> None:
    cf.save(curve, tmp_path / "curve.npz")
    again = cf.load(tmp_path / "curve.npz")
    assert np.array_equal(again.values, curve.values)
    assert (again.label, again.signatures) == (curve.label, curve.signatures)
    assert [repr(s) for s in again.special] == [repr(s) for s in curve.special]
    assert [str(e) for e in again.ends] == [str(e) for e in curve.ends]
    cf.save(plane, tmp_path / "plane.npz")
    back = cf.load(tmp_path / "plane.npz")
    assert repr(back) == repr(plane)
    assert [repr(r) for r in back.regions] == [repr(r) for r in plane.regions]
    assert np.array_equal(back.cells, plane.cells)
    for old, new in zip(plane.curves, back.curves, strict=True):
        assert np.array_equal(old.values, new.values)
        assert np.array_equal(old.stable, new.stable)


def test_a_curve_that_was_read_goes_on(curve, fold, tmp_path) -> None:
    """An orbit of a saved curve starts the same curve again."""
    cf.save(curve, tmp_path / "curve.npz")
    orbit = cf.load(tmp_path / "curve.npz")[5]
    found = cf.continue_bifurcation(cf.Bifurcation(fold.kind, orbit.params, orbit), PLANE, RANGES)
    for end in (0, -1):
        assert found.params["S"][end] == pytest.approx(curve.params["S"][end], abs=1e-10)


# ------------------------------------------------------------------------------------ the plane


def test_no_curve_twice(plane) -> None:
    seen = [(c.kind, c.name, round(float(c.values[len(c) // 2][0]), 6)) for c in plane.curves]
    assert len(set(seen)) == len(seen)


def test_regions(plane) -> None:
    assert sum(region.share for region in plane.regions) <= 1.0
    region = plane.region_at({"Omega": 0.57, "S": 0.3})
    assert region is not None
    assert [str(f) for f in region.families] == ["0s (stable)"]
    labels = {plane.curves[k].label for k in region.bounds}
    assert "SN_1a" in labels
    inside = plane.region_at({"Omega": 0.538, "S": 0.3})
    assert {str(f) for f in inside.families} == {"0s (stable)", "1a (stable)", "1a (unstable)"}
    assert not inside.disputed


def test_labels_and_points(plane) -> None:
    labels = {c.label for c in plane.curves}
    assert {"SN_1a", "CS_s", "BP_2s", "CS_a", "SN_2a"} <= labels
    names = {s.name for s in plane.special}
    assert {"SN-CS", "DBP"} <= names


def test_drawn(plane, curve) -> None:
    from contfric.plot import new_figure, plot_curves, plot_plane

    ax = plot_plane(plane, new_figure().add_subplot())
    drawn = {line.get_gid() for line in ax.lines}
    assert {"SN_1a", "CS_s"} <= drawn
    assert ax.get_xlim() == (0.48, 0.58)
    one = plot_curves([curve])
    assert "SN_1a" in {line.get_gid() for line in one.lines}
    assert curve.plot() is not None


# ------------------------------------------------------------------------------------ the study

STUDY = """
model: coulomb
params: {Omega: 0.5, S: 0.32, S0: 0.4}
plane:
  parameters: [Omega, S]
  range: {Omega: [0.5, 0.58], S: [0.3, 0.39]}
  sections: {S: [0.32]}
  kinds: [SN, CS]
  max_periods: 1
  max_sections: 1
figures: [{kind: plane, format: svg}]
"""


def test_study(tmp_path) -> None:
    file = tmp_path / "small.yaml"
    file.write_text(STUDY)
    result = cf.run_study(file, out=tmp_path / "out")
    assert {c.kind.value for c in result.plane.curves} <= {"SN", "CS"}
    names = {path.name for path in result.files}
    assert {"plane.npz", "curves.csv", "special.csv", "regions.csv", "plane.svg"} <= names
    assert result.info["plane"]["complete"]
    lines = (tmp_path / "out" / "curves.csv").read_text().splitlines()
    assert len(lines) == 1 + sum(len(c) for c in result.plane.curves)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("[Omega, S]", "[Omga, S]", "did you mean 'Omega'"),
        ("S: [0.3, 0.39]}", "S: [0.3]}", "two numbers"),
        ("[SN, CS]", "[PDD]", "did you mean 'PD'"),
        ("{S: [0.32]}", "{S: [0.1]}", "outside"),
        ("max_periods", "max_period", "did you mean 'max_periods'"),
    ],
)
def test_wrong_studies(tmp_path, old, new, says) -> None:
    file = tmp_path / "wrong.yaml"
    file.write_text(STUDY.replace(old, new))
    with pytest.raises(cf.StudyError, match=says):
        cf.run_study(file, out=tmp_path / "out")
