"""Fits: tables, figures, files, executors, Ctrl-C; and the study keys of fits, curves and stable sets."""

from __future__ import annotations

import csv
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import suppress
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.fitting.condition import FitCondition
from contfric.study.read import read_study

TRUE = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
HEAD = "model: coulomb\nparams: {Omega: 0.5, S: 0.31, S0: 0.42}\n"


@pytest.fixture(scope="module")
def orbit() -> cf.Orbit:
    return cf.solve_orbit("coulomb", "1a", TRUE)


@pytest.fixture(scope="module")
def data(orbit: cf.Orbit) -> list[Any]:
    times = np.linspace(0.0, 2.0 * orbit.period, 40)
    values = np.array([orbit.state(t)[0] for t in times])
    diagram = cf.explore(cf.find_orbit("coulomb", {**TRUE, "S": 0.31}), "Omega", (0.44, 0.6))
    return [
        cf.Measured("x_max", orbit.x_max, 0.005, {"Omega": 0.5}),
        cf.Series("x", times, values, 0.01, {"Omega": 0.5}),
        cf.Measured("rms(v)", float(orbit.quantity("rms(v)")), 0.002, {"Omega": 0.5}),
        cf.Jump(diagram.of_kind("SN")[0], 0.5419, 0.0005),
    ]


@pytest.fixture(scope="module")
def found(data: list[Any]) -> cf.Fit:
    return cf.fit("coulomb", data, {"S": 0.31, "S0": 0.42}, ["S", "S0"])


def same(one: cf.Fit, other: cf.Fit) -> bool:
    arrays = ("covariance", "residuals", "jacobian")
    return one.params == other.params and all(
        getattr(one, name).tobytes() == getattr(other, name).tobytes() for name in arrays
    )


def test_tables_are_what_was_measured_and_fitted(found: cf.Fit, orbit: cf.Orbit) -> None:
    table = found.to_dataframe()
    assert len(table) == 43 and table["datum"].tolist() == [1, *[2] * 40, 3, 4]
    assert table["value"][0] == orbit.x_max and np.isnan(table["t"][0])
    np.testing.assert_allclose(
        table["fitted"][0], found.orbits[0].x_max, rtol=1e-14
    )  # what the model says
    np.testing.assert_allclose((table["fitted"] - table["value"]) / table["sigma"], found.residuals)
    free = found.to_dataframe("parameters").set_index("parameter")
    assert free["value"]["S"] == found.params["S"] and free["sigma"]["S0"] == found.sigma["S0"]
    assert abs(free["correlation_S0"]["S"]) < 1.0 and free["correlation_S"]["S"] == pytest.approx(
        1.0, abs=1e-14
    )
    with pytest.raises(cf.ParameterError, match="data or parameters"):
        found.to_dataframe("events")


def test_a_figure_has_every_point(found: cf.Fit, data: list[Any]) -> None:
    ax = found.plot()
    assert sorted(len(line.get_xdata()) for line in ax.get_lines()) == [40, 40]
    few = cf.fit("coulomb", [data[0], data[2]], {"S": 0.31, "S0": 0.41}, ["S", "S0"])
    assert few.plot().get_xlabel() == "datum"


def test_saved_and_loaded(found: cf.Fit, tmp_path: Path) -> None:
    cf.save(found, tmp_path / "fit.npz")
    again = cf.load(tmp_path / "fit.npz")
    assert isinstance(again, cf.Fit) and same(again, found)
    assert again.message == found.message and again.to_dataframe().equals(found.to_dataframe())


def test_an_event_that_was_saved_has_its_gradient(data: list[Any], tmp_path: Path) -> None:
    fold = data[3].event
    diagram = cf.explore(cf.find_orbit("coulomb", {**TRUE, "S": 0.31}), "Omega", (0.44, 0.6))
    cf.save(diagram, tmp_path / "diagram.npz")
    again = cf.load(tmp_path / "diagram.npz").of_kind("SN")[0]
    assert again.parameter == fold.parameter == "Omega"
    assert again.gradient()["S0"] == pytest.approx(fold.gradient()["S0"], abs=1e-9)


class _Losing(Executor):
    """Loses what it is given."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_exception(OSError("the worker was killed"))
        return future


def test_the_same_bits_on_any_executor(data: list[Any], found: cf.Fit) -> None:
    what = "coulomb", data, {"S": 0.31, "S0": 0.42}, ["S", "S0"]
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        assert same(cf.fit(*what, executor=pool), found)
    assert same(cf.fit(*what, executor=pool), found)  # shut down: all is computed here
    assert same(cf.fit(*what, executor=_Losing()), found)


def test_data_of_one_condition_are_of_one_image(orbit: cf.Orbit) -> None:
    """A simulation finds one of two mirror images: all data of a condition decide which."""
    for image in (orbit, orbit.mirror()):
        data = [
            cf.Measured("amplitude(x, 1)", float(image.quantity("amplitude(x, 1)")), 0.01),
            cf.Measured("x_max", image.x_max, 0.01),
            cf.Measured("x_min", image.x_min, 0.01),
        ]
        found = cf.fit("coulomb", data, {**TRUE, "S": 0.319}, ["S"])
        assert found.chi_square < 1e-12
        assert len({fitted.x_max for fitted in found.orbits}) == 1


def test_interrupted_keeps_the_best_trial(data: list[Any], found: cf.Fit) -> None:
    said: list[str] = []

    def stop(text: str) -> None:
        said.append(text)
        if len(said) == 3:
            raise KeyboardInterrupt

    what = "coulomb", data, {"S": 0.31, "S0": 0.42}, ["S", "S0"]
    part = cf.fit(*what, progress=stop)
    assert not part.complete and not part.converged and part.message == "interrupted"
    assert found.chi_square <= part.chi_square < 1e4
    assert said[0].startswith("fit: trial 1, chi^2 = ")


# ------------------------------------------------------------------------------------------- studies


@pytest.mark.parametrize("calls", [2, 7, 16])
def test_a_fit_goes_on_from_its_folder(
    data: list[Any], found: cf.Fit, tmp_path: Path, monkeypatch, calls: int
) -> None:
    """Stopped at any call, it comes to the same bits, and what was finished is not solved again."""
    solved: list[Any] = []
    answer = FitCondition.answer

    def counted(self: FitCondition, params: Any, near: Any) -> Any:
        solved.append(params)
        if len(solved) == calls:
            raise KeyboardInterrupt
        return answer(self, params, near)

    def fitted() -> tuple[cf.Fit, int]:
        before = len(solved)
        result = cf.fit("coulomb", data, {"S": 0.31, "S0": 0.42}, ["S", "S0"], folder=tmp_path)
        return result, len(solved) - before

    monkeypatch.setattr(FitCondition, "answer", counted)
    with suppress(KeyboardInterrupt):  # the first trial is before the search, which keeps its best
        assert not fitted()[0].complete
    calls = 0
    again, rest = fitted()
    assert again.complete and same(again, found)
    assert fitted()[1] == 0 < rest
    monkeypatch.undo()
    assert same(fitted()[0], found)


def test_orbits_that_depend_on_the_way_are_no_fit() -> None:
    """The strongest spring of iwan never slips, and keeps the offset that earlier trials gave it."""
    orbits = {w: cf.find_orbit("iwan", {"W": w}) for w in (0.98, 1.0, 1.02)}
    data = [
        cf.Measured("rms(x)", float(orbit.quantity("rms(x)")), 0.01, {"W": w})
        for w, orbit in orbits.items()
    ]
    told: list[str] = []
    found = cf.fit("iwan", data, {"F": 0.41}, ["F"], progress=told.append)
    sums = [float(text.split("chi^2 = ")[1].split()[0]) for text in told]
    assert not found.converged and "depends on the trial before" in found.message
    assert found.chi_square == pytest.approx(min(sums), rel=1e-5)  # the best trial is kept


def test_a_folder_of_parts_that_cannot_be_used(data: list[Any], tmp_path: Path) -> None:
    (tmp_path / "parts").write_text("something else")
    asked = (data[:1], {"S": 0.31, "S0": 0.42}, ["S"])
    with pytest.raises(cf.ContfricError, match="parts of another version"):
        cf.fit("coulomb", *asked, folder=tmp_path)
    with pytest.raises(cf.ContfricError, match="is a path"):
        cf.fit("coulomb", *asked, folder=3)  # type: ignore[arg-type]
    assert (tmp_path / "parts").read_text() == "something else"


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_a_fit_in_a_study(write, found: cf.Fit, data: list[Any], tmp_path: Path) -> None:
    series = data[1]
    lines = [
        f"{t!r},{x!r}" for t, x in zip(series.times.tolist(), series.values.tolist(), strict=True)
    ]
    path = write(
        HEAD
        + "explore: {parameter: Omega, range: [0.44, 0.6]}\n"
        + "fit:\n  free: [S, S0]\n  data:\n"
        + f"  - {{quantity: x_max, value: {data[0].value!r}, sigma: 0.005, params: {{Omega: 0.5}}}}\n"
        + "  - {series: x, file: record.csv, sigma: 0.01, params: {Omega: 0.5}}\n"
        + f"  - {{quantity: rms(v), value: {data[2].value!r}, sigma: 0.002, params: {{Omega: 0.5}}}}\n"
        + "  - {jump: SN, value: 0.5419, sigma: 0.0005}\n"
        + "figures: [{kind: fit}]\n"
    )
    (path.parent / "record.csv").write_text("time,x\n" + "\n".join(lines) + "\n")
    result = cf.run_study(path, out=tmp_path / "run")
    assert result.fit is not None
    assert result.fit.params["S"] == pytest.approx(found.params["S"], abs=1e-9)
    assert result.fit.sigma["S"] == pytest.approx(found.sigma["S"], rel=1e-3)
    assert len(rows(tmp_path / "run" / "residuals.csv")) == 43
    assert [row["parameter"] for row in rows(tmp_path / "run" / "fit.csv")] == ["S", "S0"]
    assert (tmp_path / "run" / "fit.png").stat().st_size > 1000
    assert isinstance(cf.load(tmp_path / "run" / "fit.npz"), cf.Fit)


@pytest.mark.parametrize(
    ("datum", "message"),
    [
        ("{quantity: x_max, sigma: 1}", ":3: a datum is"),
        ("{quantity: x_max, series: x, value: 1, sigma: 1}", ":3: a datum is"),
        ("{quantity: x_mx, value: 1, sigma: 1}", "no quantity 'x_mx'; did you mean 'x_max'"),
        ("{quantity: x_max, value: 1, sigma: 0}", "'sigma' must be a number > 0"),
        ("{series: x, file: nothing.csv, sigma: 1}", ":3: cannot read"),
        ("{series: x, file: scene.yaml, sigma: 1}", "row 2: a row is a time and a value"),
        ("{jump: SN, value: 1, sigma: 1}", "add 'explore' or 'continue'"),
        ("{quantity: x_max, value: 1, sigma: 1, params: {S: 0.3}}", "'S' is free"),
    ],
)
def test_data_that_are_none(write, datum: str, message: str) -> None:
    path = write(HEAD + f"fit: {{free: [S], data: [{datum}]}}\n")
    with pytest.raises(cf.StudyError) as caught:
        read_study(path)
    assert message in str(caught.value) and "\n" not in str(caught.value)


def test_a_jump_of_an_event_that_is_not_there(write, tmp_path: Path) -> None:
    path = write(
        HEAD
        + "continue: {parameter: Omega, range: [0.49, 0.51]}\n"
        + "fit: {free: [S], data: [{jump: PD, value: 0.5, sigma: 1}]}\n"
    )
    with pytest.raises(cf.ParameterError, match="no event 'PD'"):
        cf.run_study(path, out=tmp_path / "run")


def test_curves_of_quantities_in_studies(write, tmp_path: Path, orbit: cf.Orbit) -> None:
    ranges = {"Omega": (0.48, 0.55), "S": (0.25, 0.35)}
    where = "parameters: [Omega, S], range: {Omega: [0.48, 0.55], S: [0.25, 0.35]}, max_step: 0.1"
    path = write(
        "model: coulomb\nparams: {Omega: 0.5, S: 0.32, S0: 0.4}\nstart: {signature: 1a}\nhold: {quantity: "
        f"x_max, value: 1.43, {where}}}\nextremum: {{quantity: x_max, {where}}}\nfigures: [{{kind: hold}}, "
        "{kind: extremum}]\n"
    )
    run = cf.run_study(path, out=tmp_path / "run")
    curve = cf.continue_quantity(orbit, "x_max", 1.43, ("Omega", "S"), ranges, max_step=0.1)
    table = rows(tmp_path / "run" / "hold.csv")
    assert [float(row["S"]) for row in table] == curve.params["S"].tolist()
    peaks = cf.load(tmp_path / "run" / "extremum.npz")
    assert isinstance(peaks, cf.ExtremumCurve)
    assert abs(peaks[2].gradient("x_max")["Omega"]) < 1e-9
    assert {"hold.png", "extremum.png"} <= {file.name for file in run.files}


def test_a_stable_set_in_a_study(write, tmp_path: Path) -> None:
    path = write(
        "model: coulomb\nparams: {Omega: 0.5, S: 0.32, S0: 0.4}\nstart: {signature: 2s}\nbasins: {grid: {x: "
        "[-2, 2, 6], v: [-1, 1, 6]}}\nstable_set: {range: {x: [-2, 2], v: [-1, 1]}, max_step: "
        "0.1}\nfigures: [{kind: stable_set}]\n"
    )
    cf.run_study(path, out=tmp_path / "run")
    saddle = cf.solve_orbit("coulomb", "2s", TRUE)
    said: list[str] = []
    edge = cf.stable_set(saddle, {"x": (-2, 2), "v": (-1, 1)}, max_step=0.01, progress=said.append)
    assert said and all("points of a half" in text for text in said)
    coarse = cf.load(tmp_path / "run" / "stable_set.npz")
    assert isinstance(coarse, cf.StableSet) and coarse.complete and len(coarse.points) > 20
    apart = [np.min(np.linalg.norm(edge.points - p, axis=1)) for p in coarse.points]
    assert np.mean(np.array(apart) < 0.01) > 0.8  # beyond a gap one of them may have ended


@pytest.mark.parametrize("seed", range(6))
def test_a_fit_that_misses_its_data_says_so(
    seed: int, orbit: cf.Orbit, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Noise as large as it is said to be is no reason; a signal that the model does not have is one."""
    from contfric.cli import main

    rng = np.random.default_rng(seed)
    times = np.sort(rng.uniform(0.0, 2.0 * orbit.period, 60))
    sigma, wrong = 10.0 ** rng.uniform(-4.0, -2.0), rng.uniform(10.0, 100.0)
    values = np.array([orbit.state(t)[0] for t in times]) + sigma * rng.standard_normal(60)
    for off in (0.0, wrong):
        series = cf.Series("x", times, values + off * sigma * np.cos(5.0 * times), sigma)
        found = cf.fit("coulomb", [series], {"Omega": 0.5, "S": 0.31, "S0": 0.41}, ["S", "S0"])
        assert found.converged and found.reduced_chi_square == found.chi_square / 58
        assert ("misses its data" in repr(found)) == bool(found.notes) == bool(off)
        np.savetxt(tmp_path / "x.csv", np.column_stack([times, series.values]), delimiter=",")
        study = tmp_path / "s.yaml"
        study.write_text(
            "model: coulomb\nparams: {Omega: 0.5, S: 0.31, S0: 0.41}\n"
            f"fit: {{free: [S, S0], data: [{{series: x, file: x.csv, sigma: {sigma!r}}}]}}\n"
        )
        assert main(["run", str(study), "--out", str(tmp_path / f"out{off}")]) == 0
        said = capsys.readouterr().out
        assert f"{found.reduced_chi_square:.4g} a degree of freedom" in said
        assert ("warning: the fit misses its data" in said) == bool(off)


def test_a_fit_at_a_limit_of_the_model_says_so() -> None:
    """Data that ask for more friction than the static one, S <= S0, and others that do not."""
    params = {"Omega": 0.5, "S": 0.3, "S0": 0.4}
    beyond = cf.fit("coulomb", [cf.Measured("rms(v)", 0.55, 0.01)], params, ["S"])
    assert beyond.params["S"] == pytest.approx(0.4, abs=1e-9)
    assert any("at a limit: the model needs S0 >= S" in note for note in beyond.notes)
    assert "at a limit" in repr(beyond)
    inside = cf.fit("coulomb", [cf.Measured("rms(v)", 0.525, 0.01)], params, ["S"])
    assert inside.params["S"] < 0.39 and inside.notes == ()


def test_what_is_no_number_is_not_fitted() -> None:
    """The second harmonic of a symmetric orbit has no phase."""
    params = {"Omega": 0.9, "S": 0.2, "S0": 0.25}
    with pytest.raises(cf.ConvergenceError, match=r"phase\(x, 2\) .* is not finite.*vanishes"):
        cf.fit("coulomb", [cf.Measured("phase(x, 2)", 0.3, 0.01)], params, ["S"])
