"""Quantities by name: where they can stand, and what is said where they cannot."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib
from typed import typed

matplotlib.use("Agg")

import numpy as np
import pytest

import contfric as cf
from contfric.errors import ConvergenceError, ModelError, ParameterError
from contfric.models.language.quantity_texts import BUNDLED, LIST
from contfric.quantities.registry import NAMED, quantity_of

FIG5 = {"Omega": 0.5, "S": 0.32, "S0": 0.4}


def test_the_list_of_names_is_one() -> None:
    assert tuple(NAMED) == BUNDLED
    assert [name for name, entry in NAMED.items() if entry.several] == [LIST]
    assert cf.quantity_names("coulomb") == [*BUNDLED, "energy", "power"]
    assert cf.quantity_names("popp") == [*BUNDLED]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("xmax", "has no quantity 'xmax'; did you mean 'x_max'"),
        ("x", "'x' varies along an orbit: write one of integral(x), max(x)"),
        ("max(y)", "in max(y): model 'coulomb' has no 'y'"),
        ("mean(x", "cannot read 'mean(x'"),
        ("rms(mean(x))", "a functional cannot stand inside of another one"),
        ("amplitude(x)", "amplitude() is such as amplitude(x, 3)"),
        ("amplitude(x, 0)", "the harmonic is a positive number"),
        ("amplitude(x, 1/2)", "an orbit of 1 period has the harmonics 1/1"),
        ("stops + 1", "'stops' is a list of numbers"),
        ("x_max.real", "a dot can only stand in a number"),
        ("mean(1/(x - x))", "has no finite value in segment 1"),
        (3, "a quantity is a name, an expression such as"),
        ("max(x) > 1", "in 'max(x) > 1': a condition can only stand"),
        ("2*mena(v)", "unknown function 'mena'; did you mean 'mean'?"),
        ("floor(max(x))", "every jump needs a surface"),
    ],
)
def test_a_mistake_is_said(orbit: cf.Orbit, name: Any, words: str) -> None:
    with pytest.raises(cf.ContfricError) as caught:
        orbit.quantity(name)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_functions_count_and_must_return_numbers(orbit: cf.Orbit, branch: cf.Branch) -> None:
    assert orbit.quantity(lambda o: o.x_max - o.x_min) == orbit.quantity("x_max - x_min")
    assert branch.quantity(lambda o: o.period).shape == branch.values.shape
    with pytest.raises(ParameterError, match="must return a number, got 'large'"):
        orbit.quantity(lambda _: "large")
    for wrong, words in ((lambda _: "large", "must return a number"), (lambda _: np.nan, "nan")):
        for ask in (
            orbit.gradient,
            branch.extrema,
            lambda f: cf.continue_orbit(orbit, "Omega", (0.48, 0.53), stop_at={f: 1.4}),
            lambda f: cf.continue_quantity(
                orbit, f, 1.4, ("Omega", "S"), {"Omega": (0.48, 0.53), "S": (0.3, 0.35)}
            ),
        ):
            with pytest.raises(ParameterError, match=words):
                ask(wrong)


def width_of(orbit: cf.Orbit) -> float:
    return orbit.x_max - orbit.x_min


#: The same function by itself, by the name of its module, and one that no other process can import.
WIDTHS = {
    "function": width_of,
    "text": f"{__name__}:width_of",
    "lambda": lambda o: o.x_max - o.x_min,
}


@pytest.fixture(scope="module")
def peaked() -> cf.Orbit:
    return cf.find_orbit("coulomb", {"Omega": 0.9, "S": 0.2, "S0": 0.25, "zeta": 0.1})


@pytest.mark.parametrize("width", WIDTHS.values(), ids=WIDTHS)
def test_a_function_of_an_orbit_is_used_as_its_expression_is(
    peaked: cf.Orbit, width: Any, tmp_path: Path
) -> None:
    """In diagrams, curves of extrema, fits and ensembles, and after they were saved."""
    text, bounds = "x_max - x_min", (0.8, 1.1)
    stopped = [cf.explore(peaked, "Omega", bounds, stop_at={q: 6.5}) for q in (width, text)]
    ends = [sorted(float(v) for b in d.branches for v in b.values[[0, -1]]) for d in stopped]
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)
    assert any(0.81 < end < 1.09 for end in ends[0])

    ranges = {"Omega": bounds, "S": (0.18, 0.22)}
    peaks, expected = (
        cf.continue_extremum(peaked, q, ("Omega", "S"), ranges, max_points=6) for q in (width, text)
    )
    at = np.interp(peaks.params["S"], *_by_s(expected, expected.params["Omega"]))
    assert np.max(np.abs(peaks.params["Omega"] - at)) < 1e-4  # between points of the other curve
    assert max(abs(orbit.gradient(text)["Omega"]) for orbit in peaks) < 1e-7

    datum = [cf.Measured(width, peaked.quantity(text), 0.01)]
    fitted = cf.fit("coulomb", datum, {**peaked.params, "S": 0.21}, ["S"])
    assert fitted.params["S"] == pytest.approx(0.2, abs=1e-9)

    box = {"S": (0.19, 0.21)}
    fixed = {n: v for n, v in peaked.params.items() if n != "S"}
    drawn, same = (
        cf.ensemble("coulomb", "Omega", bounds, box, fixed, samples=2, row=q) for q in (width, text)
    )
    assert np.allclose(drawn.rows.orbit_row, same.rows.orbit_row, rtol=0, atol=1e-12)

    for k, result in enumerate((stopped[0], peaks, fitted, drawn)):
        path = tmp_path / f"{k}.npz"
        cf.save(result, path)
        again = cf.load(path)
        again.plot()
        assert again.to_dataframe().equals(result.to_dataframe())
    assert np.array_equal(cf.load(tmp_path / "1.npz").extrema, peaks.extrema)


def _by_s(curve: cf.ExtremumCurve, column: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    order = np.argsort(curve.params["S"])
    return curve.params["S"][order], column[order]


def test_infinite_multipliers_stop_nothing_and_stand_in_no_band(orbit: cf.Orbit) -> None:
    found = cf.explore(orbit, "Omega", (0.48, 0.55), stop_at={"multiplier": 0.9})
    assert any(end.reason.name == "STOP" for b in found.branches for end in b.ends)
    assert any(b.bridge for b in found.branches)
    fixed = {"Omega": 0.5, "S0": 0.4}
    drawn = cf.ensemble(
        "coulomb", "Omega", (0.48, 0.55), {"S": (0.31, 0.33)}, fixed, samples=2, row="multiplier"
    )
    assert not np.any(np.isinf(drawn.rows.orbit_row))
    assert any(np.isfinite(band.quantiles).any() for band in drawn.bands())


def test_a_branch_has_the_values_of_its_orbits(branch: cf.Branch) -> None:
    for name in ("x_max", "psi", "energy", "rms(v)", "multiplier", "period"):
        values = branch.quantity(name)
        assert values.shape == branch.values.shape
        for k in (0, len(branch) // 2, -1):
            assert values[k] == pytest.approx(branch[k].quantity(name), rel=1e-6)
    assert branch.quantity("stops").shape == branch.stops.shape


def test_tables_have_the_columns_asked_for_and_no_others(branch: cf.Branch) -> None:
    table = branch.to_dataframe(["energy", "max(v)"])
    assert np.array_equal(table["energy"], branch.quantity("energy"))
    assert "max(v)" in table and "energy" not in branch.to_dataframe()


def test_rows_show_any_quantity(branch: cf.Branch) -> None:
    assert branch.plot(row="energy").get_ylabel() == "energy"
    assert branch.plot(row="sticking").get_ylabel() == "sticking share"
    line = branch.plot(row=lambda o: 2.0 * o.x_max).lines[0]
    assert np.nanmax(np.asarray(line.get_ydata(), dtype=float)) > 2.0
    with pytest.raises(ParameterError, match="'x' varies along an orbit"):
        branch.plot(row="x")


def test_what_is_not_finite_is_not_drawn(orbit: cf.Orbit) -> None:
    """Orbits with holds have infinite multipliers, and their bridge has no line in that row."""
    diagram = cf.explore(orbit, "Omega", (0.48, 0.55))
    bridge = next(b for b in diagram.branches if b.bridge)
    assert np.all(np.isinf(bridge.quantity("multiplier")))
    lines = {line.get_gid(): line for line in diagram.plot(row="multiplier").lines}
    inner = np.asarray(lines[bridge.name].get_ydata(), dtype=float)[
        1:-1
    ]  # its ends are other orbits
    assert len(inner) and np.all(np.isnan(inner))
    assert np.any(np.isfinite(np.asarray(lines["1a"].get_ydata(), dtype=float)))
    assert np.all(np.isfinite(bridge.quantity("energy")))


def test_gradients_say_where_they_are_one_sided(orbit: cf.Orbit) -> None:
    smooth = orbit.gradient("x_max")
    assert not smooth.one_sided and smooth.ahead == smooth.behind
    assert set(smooth) == set(orbit.params)
    twin = cf.solve_orbit("coulomb", "2s", {**FIG5, "S": 0.36})
    assert not twin.gradient("max(abs(x))").one_sided  # reached twice, and both move alike
    with pytest.raises(ParameterError, match="'stops' is a list"):
        orbit.gradient("stops")


def test_equal_extrema_that_part_have_two_derivatives() -> None:
    """Of |x - a| at the mean a both sides are equal; a moves them apart, by +1 and -1."""
    orbit = cf.find_orbit("coulomb", {"Omega": 0.7, "S": 0.0, "S0": 0.0, "zeta": 0.1})
    gradient = orbit.gradient("max(abs(x - h))")  # h is 0, and moves the level with the solution
    assert gradient.one_sided
    assert "is reached at several times at once" in gradient.notes[0]
    assert gradient.ahead["h"] > gradient.behind["h"]
    one_side = cf.find_orbit("coulomb", {"Omega": 0.7, "S": 0.0, "S0": 0.0, "zeta": 0.1, "h": 1e-6})
    beyond = one_side.gradient("max(abs(x - h))")
    assert not beyond.one_sided
    assert beyond["h"] == pytest.approx(gradient.ahead["h"], rel=1e-4)


def test_at_an_event_a_gradient_is_that_of_one_side(branch: cf.Branch) -> None:
    event = next(b for b in branch.bifurcations if b.kind.value in ("SS", "CS"))
    assert any("is at an event" in note for note in event.orbit.gradient("x_max").notes)
    fold = next(b for b in branch.bifurcations if b.kind.value == "SN")
    with pytest.raises(ConvergenceError, match="at a fold or branch point"):
        fold.orbit.gradient("x_max")


MODEL = """\
name: damped
states: [x, v]
parameters: {w: 0.7, c: 0.2}
period: 2*pi/w
surfaces:
  stop: {observable: v, level: 0}
field: {x: v, v: cos(w*t) - x - c*v}
modes:
  up: {in: {stop: +}}
  down: {in: {stop: -}}
spread: {x: 3, v: 3}
quantities:
"""


def test_a_file_declares_quantities(tmp_path: Path) -> None:
    path = tmp_path / "damped.yaml"
    path.write_text(
        f"{MODEL}  energy: integral(c*v**2)\n  power: energy/period\n", encoding="utf-8"
    )
    orbit = cf.find_orbit(path)
    size = np.hypot(1 - 0.49, 0.2 * 0.7)
    assert orbit.quantity("power") == pytest.approx(0.2 * (0.7 / size) ** 2 / 2, rel=1e-12)
    cf.save(orbit, tmp_path / "orbit.npz")
    assert cf.load(tmp_path / "orbit.npz").quantity("power") == orbit.quantity("power")
    tied = cf.find_orbit(path, {"c": {"tie": "0.2*w"}})
    assert tied.quantity("energy") == pytest.approx(
        tied.quantity("integral(0.2*w*v**2)"), rel=1e-14
    )


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("x_max: max(x)", "13: the quantity 'x_max' has the name of a bundled quantity"),
        ("w: max(x)", "13: the quantity 'w' has the name of a parameter"),
        ("size: max(y)", "13: unknown name 'y'"),
        ("size: x", "13: 'x' varies along an orbit"),
        ("size: power", "13: unknown name 'power'"),
        ("size: [1]", "13: 'size' must be an expression"),
        ("size: rms(x, 2)", "13: rms() is such as rms(x)"),
    ],
)
def test_a_mistake_in_a_file_has_its_line(tmp_path: Path, entry: str, words: str) -> None:
    with pytest.raises(ModelError) as caught:
        typed(tmp_path, f"{MODEL}  {entry}\n")
    assert words in str(caught.value)


# ----------------------------------------------------------------------------- where branches end


@pytest.mark.parametrize(("name", "value"), [("x_max", 1.43), ("energy", 1.75), ("rms(v)", 0.54)])
def test_a_branch_ends_where_a_quantity_has_its_value(
    orbit: cf.Orbit, branch: cf.Branch, name: str, value: float
) -> None:
    found = cf.continue_orbit(orbit, "Omega", (0.4, 0.6), stop_at={name: value})
    end = found.ends[1]
    assert end.reason is cf.EndReason.STOP
    assert str(end).endswith(f"{name} = {value:g}")
    assert found[-1].quantity(name) == pytest.approx(value, abs=1e-13)
    assert found[-1].converged and found[-1].admissible
    # the same place on the branch that goes on: between its points, at the parameter of the end
    again = cf.solve_orbit("coulomb", "1a", {**FIG5, "Omega": float(found.values[-1])})
    assert again.quantity(name) == pytest.approx(value, abs=1e-10)
    assert np.all((found.quantity(name)[:-1] - value) * (found.quantity(name)[0] - value) > 0.0)
    assert len(found) < len(branch)


def test_a_value_between_two_points_and_back_is_not_missed(orbit: cf.Orbit) -> None:
    """The energy has a maximum along the branch; points of steps lie below it."""
    fine = cf.continue_orbit(orbit, "Omega", (0.4, 0.6), max_step=0.002).quantity("energy")
    missed = 0
    for step in (0.05, 0.02):
        coarse = cf.continue_orbit(orbit, "Omega", (0.4, 0.6), max_step=step).quantity("energy")
        if coarse.max() >= fine.max():
            continue
        value = 0.5 * (coarse.max() + fine.max())
        missed += 1
        found = cf.continue_orbit(
            orbit, "Omega", (0.4, 0.6), max_step=step, stop_at={"energy": value}
        )
        assert found.ends[1].reason is cf.EndReason.STOP
        assert found[-1].quantity("energy") == pytest.approx(value, abs=1e-13)
    assert missed


def test_an_event_before_the_value_is_kept_and_one_behind_it_not(orbit: cf.Orbit) -> None:
    branch = cf.continue_orbit(orbit, "Omega", (0.4, 0.6))
    fold = next(b for b in branch.bifurcations if b.kind.value == "SN")
    values = branch.quantity("x_max")
    behind = values[int(np.searchsorted(branch.arc, fold.position)) + 2]
    found = cf.continue_orbit(orbit, "Omega", (0.4, 0.6), stop_at={"x_max": float(behind)})
    kinds = [b.kind.value for b in found.bifurcations]
    assert found.ends[1].reason is cf.EndReason.STOP
    assert ("SN" in kinds) == (found.arc[-1] > fold.position)
    assert not any(end.bifurcation for end in found.ends[1:])


def test_a_diagram_keeps_what_it_was_asked_to_stop_at(orbit: cf.Orbit, tmp_path: Path) -> None:
    diagram = cf.explore(orbit, "Omega", (0.4, 0.6), stop_at={"x_max": 1.43})
    assert diagram.loose_ends == ()
    stopped = [b for b in diagram.branches if b.ends[1].reason is cf.EndReason.STOP]
    assert stopped and all(
        b.quantity("x_max").max() <= 1.43 + 1e-12 for b in diagram.branches if not b.mirrored
    )
    cf.save(diagram, tmp_path / "diagram.npz")
    assert cf.load(tmp_path / "diagram.npz").settings == diagram.settings
    assert diagram.verify(restarts=2).passed


@pytest.mark.parametrize("value", [1.405, 1.415, 1.43, 1.3])
def test_a_diagram_stops_at_the_same_orbits_for_either_mirror_image(
    orbit: cf.Orbit, value: float
) -> None:
    def ends(start: cf.Orbit) -> list[tuple[str, float, float]]:
        diagram = cf.explore(start, "Omega", (0.4, 0.6), stop_at={"x_max": value})
        own = [b for b in diagram.branches if not b.mirrored]
        return sorted((b.name, *sorted(map(float, b.values[[0, -1]]))) for b in own)

    one, other = ends(orbit), ends(orbit.mirror())
    assert [name for name, *_ in one] == [name for name, *_ in other]
    np.testing.assert_allclose([e[1:] for e in one], [e[1:] for e in other], rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("stop_at", "words"),
    [
        ({"xmax": 1.4}, "has no quantity 'xmax'"),
        ({"x_max": "high"}, "stop_at['x_max'] is a finite number"),
        ("x_max", "stop_at is a mapping, such as {'x_max': 1.4}"),
        ({3: 1.4}, "stop_at takes a quantity: a name, an expression such as"),
        ({"nowhere:width": 1.4}, "the function cannot be imported (ModuleNotFoundError"),
        ({"math:pi": 1.4}, "quantity 'math:pi' is no function, but 3.14"),
        ({len: 1.4}, "the function builtins:len of an orbit raised TypeError"),
        ({"stops": 1.4}, "takes a quantity that is one number"),
    ],
)
def test_what_cannot_be_stopped_at_is_said(orbit: cf.Orbit, stop_at: Any, words: str) -> None:
    with pytest.raises(ParameterError) as caught:
        cf.continue_orbit(orbit, "Omega", (0.4, 0.6), stop_at=stop_at)
    assert words in str(caught.value)


STUDY = """\
title: a study with quantities
model: coulomb
params: {Omega: 0.5, S: 0.32, S0: 0.4}
start: {signature: 1a}
continue: {parameter: Omega, range: [0.4, 0.6], stop_at: {x_max: 1.43}}
want: [stability, energy, "rms(v)"]
figures: [{kind: diagram, rows: [energy, "max(u)"]}]
"""


def test_a_study_asks_for_quantities(tmp_path: Path) -> None:
    path = tmp_path / "study.yaml"
    path.write_text(STUDY, encoding="utf-8")
    result = cf.run_study(path, out=tmp_path / "out")
    header, *rows = (tmp_path / "out" / "points.csv").read_text(encoding="utf-8").splitlines()
    assert header.split(",")[-3:] == ["energy", "rms(v)", "stable"]
    assert result.branch is not None and len(rows) == len(result.branch)
    last = dict(zip(header.split(","), rows[-1].split(","), strict=True))
    assert float(last["energy"]) == result.branch[-1].quantity("energy")
    assert result.branch.ends[1].reason is cf.EndReason.STOP
    assert (tmp_path / "out" / "diagram.png").exists()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("energy, ", "energie, ", "6: 'want' has no 'energie'; did you mean 'energy'"),
        ('"rms(v)"', '"rms(w)"', "6: in rms(w): model 'coulomb' has no 'w'"),
        ("rows: [energy", "rows: [power, y_max", "7: 'rows' has no 'y_max'; did you mean 'x_max'"),
        ("x_max: 1.43", "xmax: 1.43", "5: 'stop_at' has no 'xmax'"),
        ("x_max: 1.43", "x_max: big", "5: 'stop_at' must be a mapping of quantities"),
    ],
)
def test_a_mistake_in_a_study_has_its_line(tmp_path: Path, old: str, new: str, words: str) -> None:
    path = tmp_path / "study.yaml"
    path.write_text(STUDY.replace(old, new), encoding="utf-8")
    with pytest.raises(cf.StudyError) as caught:
        cf.run_study(path, out=tmp_path / "out")
    assert words in str(caught.value)


def test_an_event_from_a_file_knows_its_parameter(branch: cf.Branch, tmp_path: Path) -> None:
    cf.save(branch, tmp_path / "branch.npz")
    loaded = cf.load(tmp_path / "branch.npz").bifurcations
    for event, again in zip(branch.bifurcations, loaded, strict=True):
        assert again.gradient() == again.gradient("Omega") == event.gradient()
        with pytest.raises(ParameterError, match="does not know along which parameter"):
            replace(again, parameter="").gradient()
    with pytest.raises(ParameterError, match="no parameter 'omega'"):
        branch.bifurcations[0].gradient("omega")


def test_a_curve_of_a_quantity_is_a_table_and_a_figure(orbit: cf.Orbit) -> None:
    ranges = {"Omega": (0.48, 0.52), "S": (0.3, 0.34)}
    curve = cf.continue_quantity(orbit, "x_max", orbit.x_max, ("Omega", "S"), ranges)
    table = curve.to_dataframe()
    assert len(table) == len(curve) and set(table) == {*orbit.params, "x_max", "stable"}
    assert (curve.plot().get_xlabel(), curve.plot().get_ylabel()) == (r"$\Omega$", "$S$")
    assert "x_max" in repr(curve)
    few = cf.continue_quantity(
        orbit, "x_max", orbit.x_max, ("Omega", "S"), ranges, max_points=5, max_step=0.01
    )
    assert len(few) == 9 and {end.reason.name for end in few.ends} == {"POINTS"}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"value": 9.0}, "no orbit of this signature with x_max = 9 was found: it is from"),
        ({"value": "high"}, "value is a finite number"),
        ({"quantity": "stops"}, "takes a quantity that is one number"),
        ({"parameters": ("Omega",)}, "a curve needs a pair of parameters"),
        ({"ranges": {"Omega": (0.48, 0.52)}}, "the range of 'S' is missing"),
        ({"ranges": {"Omega": (0.6, 0.7), "S": (0.3, 0.34)}}, "outside of the ranges"),
        ({"orbit": 3}, "continuation starts from an Orbit, got int"),
        ({"quantity": "S0", "value": 0.4}, "it may not depend on Omega and S, or be extreme there"),
    ],
)
def test_a_curve_that_cannot_be_says_why(orbit: cf.Orbit, change: Any, words: str) -> None:
    asked = {"orbit": orbit, "quantity": "x_max", "value": 1.41, "parameters": ("Omega", "S")}
    asked["ranges"] = {"Omega": (0.48, 0.52), "S": (0.3, 0.34)}
    with pytest.raises(cf.ContfricError) as caught:
        cf.continue_quantity(**{**asked, **change})
    assert words in str(caught.value)


def test_curves_of_quantities_are_saved(orbit: cf.Orbit, tmp_path: Path) -> None:
    ranges = {"Omega": (0.49, 0.51), "S": (0.31, 0.33)}
    held = cf.continue_quantity(orbit, "x_max", orbit.x_max, ("Omega", "S"), ranges)
    start = cf.find_orbit("jenkins", {"muN": 1.4, "W": 1.3})
    peaks = cf.continue_extremum(
        start, "x_max", ("W", "muN"), {"W": (1.2, 1.6), "muN": (1.35, 1.45)}
    )
    for curve in (held, peaks):
        cf.save(curve, tmp_path / "curve.npz")
        again = cf.load(tmp_path / "curve.npz")
        assert type(again) is type(curve) and again.parameters == curve.parameters
        assert [str(end) for end in again.ends] == [str(end) for end in curve.ends]
        np.testing.assert_array_equal(again.joints, curve.joints)
        np.testing.assert_array_equal(again.to_dataframe(), curve.to_dataframe())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"parameters": ("Omega",)}, "a curve of extrema needs two parameters or more"),
        (
            {"parameters": ("Omega", "Omega")},
            "a curve needs different parameters, got 'Omega' twice",
        ),
        ({"start": 3}, "starts from an Orbit or an Extremum, got int"),
        (
            {"ranges": {"Omega": (0.495, 0.505), "S": (0.3, 0.34)}},
            "x_max has no extremum along Omega",
        ),
    ],
)
def test_a_curve_of_extrema_that_cannot_be_says_why(
    orbit: cf.Orbit, change: Any, words: str
) -> None:
    asked = {"start": orbit, "quantity": "x_max", "parameters": ("Omega", "S")}
    asked["ranges"] = {"Omega": (0.48, 0.52), "S": (0.3, 0.34)}
    with pytest.raises(cf.ContfricError) as caught:
        cf.continue_extremum(**{**asked, **change})
    assert words in str(caught.value)


@pytest.mark.parametrize(
    "text",
    ["1/(x_max-x_max)", "x_max/0", "log(-x_max**2)", "sqrt(-1-rms(v)**2)", "1/(rms(v)-rms(v))"],
)
def test_what_is_never_finite_is_refused(text: str) -> None:
    """It was infinite or nan at every point, without a word."""
    with pytest.raises(
        cf.ParameterError, match="has no finite value, whatever the values of its parts"
    ):
        quantity_of(text, cf.load_model("coulomb"))


@pytest.mark.parametrize(
    "text",
    ["1/(x_max-x_min)", "log(x_max-500)", "acos(500*x_max)", "sqrt(x_min)", "x_max/sticking", "2"],
)
def test_what_is_finite_somewhere_is_not(text: str) -> None:
    assert quantity_of(text, cf.load_model("coulomb")).name == text


def test_a_study_names_a_function_of_a_module(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "measures_of_mine.py").write_text("def width(o):\n    return o.x_max - o.x_min\n")
    path = tmp_path / "study.yaml"
    path.write_text(
        STUDY.replace("x_max: 1.43", "'measures_of_mine:width': 2.77").replace(
            "energy", "'measures_of_mine:width'"
        )
    )
    with pytest.raises(cf.ContfricError, match=r"study.yaml:6: .*cannot be imported"):
        cf.run_study(path, out=tmp_path / "run")  # what only lies beside a study brings no code
    monkeypatch.syspath_prepend(tmp_path)
    cf.run_study(path, out=tmp_path / "run")
    branch = cf.load(tmp_path / "run" / "branch.npz")
    assert branch.quantity("measures_of_mine:width")[-1] == pytest.approx(2.77, abs=1e-9)
    assert "measures_of_mine:width" in (tmp_path / "run" / "points.csv").read_text()
