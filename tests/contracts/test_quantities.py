"""Quantities by name: where they can stand, and what is said where they cannot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import numpy as np
import pytest

import contfric as cf
from contfric.errors import ConvergenceError, ModelError, ParameterError
from contfric.models.quantity_texts import BUNDLED, LIST
from contfric.quantities.registry import NAMED

FIG5 = {"Omega": 0.5, "S": 0.32, "S0": 0.4}


@pytest.fixture(scope="module")
def orbit() -> cf.Orbit:
    return cf.solve_orbit("coulomb", "1a", FIG5)


@pytest.fixture(scope="module")
def branch(orbit: cf.Orbit) -> cf.Branch:
    return cf.continue_orbit(orbit, "Omega", (0.4, 0.6))


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
        ("amplitude(x, 1/2)", "an orbit of 1 period(s) has the harmonics 1/1"),
        ("stops + 1", "'stops' is a list of numbers"),
        ("x_max.real", "a dot can only stand in a number"),
        ("mean(1/(x - x))", "has no finite value in segment 1"),
        (3, "a quantity is a name, an expression such as"),
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
    with pytest.raises(ParameterError, match="a gradient takes a quantity by name or expression"):
        orbit.gradient(lambda o: o.x_max)  # type: ignore[arg-type]


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
    with pytest.raises(ParameterError, match="no row 'x' in a diagram"):
        branch.plot(row="x")


def test_gradients_say_where_they_are_one_sided(orbit: cf.Orbit) -> None:
    smooth = orbit.gradient("x_max")
    assert not smooth.one_sided and smooth.ahead == smooth.behind
    assert set(smooth) == set(orbit.params)
    twin = cf.solve_orbit("coulomb", "2s", {**FIG5, "S": 0.36})
    assert not twin.gradient("max(abs(x))").one_sided  # reached twice, and both move alike
    with pytest.raises(ParameterError, match="'stops' is a list"):
        orbit.gradient("stops")
    with pytest.raises(ParameterError, match="derivatives of 'multiplier' are not available"):
        orbit.gradient("multiplier")


def test_equal_extrema_that_part_have_two_derivatives() -> None:
    """Of |x - a| at the mean a both sides are equal; a moves them apart, by +1 and -1."""
    orbit = cf.find_orbit("coulomb", {"Omega": 0.7, "S": 0.0, "S0": 0.0, "zeta": 0.1})
    gradient = orbit.gradient("max(abs(x - h))")  # h is 0, and moves the level with the motion
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
    path = tmp_path / "damped.yaml"
    path.write_text(f"{MODEL}  {entry}\n", encoding="utf-8")
    with pytest.raises(ModelError) as caught:
        cf.load_model(path)
    assert words in str(caught.value)
