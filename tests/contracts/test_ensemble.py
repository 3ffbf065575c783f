"""Ensembles: against diagrams computed one by one, known answers, and all that a result has to do."""

from __future__ import annotations

import csv
import os
import signal
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields, replace
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.ensembles.rows import Rows
from contfric.ensembles.statistics import share_of, sobol_indices
from contfric.orbit.solve import refine
from contfric.study.result import RunStatus

RANGE = (0.48, 0.55)
FIXED = {"Omega": 0.5}
OPTIONS: dict[str, Any] = {"samples": 12, "seed": 3, "tile": 4, "values": 41}


@cache
def box() -> dict[str, Any]:
    from scipy import stats  # a second that only the worker of this file takes

    return {"S": (0.30, 0.34), "S0": stats.norm(0.4, 0.005)}


def compute(**options: Any) -> cf.Ensemble:
    return cf.ensemble("coulomb", "Omega", RANGE, box(), FIXED, **{**OPTIONS, **options})


def bits(found: cf.Ensemble) -> bytes:
    rows = b"".join(getattr(found.rows, field.name).tobytes() for field in fields(Rows))
    return found.samples.tobytes() + rows


@pytest.fixture(scope="module")
def found() -> cf.Ensemble:
    return compute()


def diagram_of(found: cf.Ensemble, number: int) -> cf.Diagram:
    drawn = dict(zip(found.distributions, found.samples[number].tolist(), strict=True))
    orbit = cf.find_orbit("coulomb", {**found.params, **drawn})
    return cf.explore(orbit, "Omega", RANGE)


# ----------------------------------------------------------------------------------- against diagrams


def test_events_are_those_of_the_diagrams(found: cf.Ensemble) -> None:
    for number in (0, 5, 11):
        diagram = diagram_of(found, number)
        own = found.rows.event_sample == number
        expected = sorted(b.params["Omega"] for b in diagram.bifurcations)
        assert found.rows.event_value[own].tolist() == expected
        kinds = sorted(label.split(" ")[0] for label in found.rows.event_label[own])
        assert kinds == sorted(b.kind.value for b in diagram.bifurcations)
        assert found.rows.branches[number] == len(diagram.branches)
        (fold,) = [b.params["Omega"] for b in diagram.of_kind("SN") if b.orbit.name == "1a"]
        assert found.event("SN 1a").values[number] == fold


def solved_at(branch: cf.Branch, value: float) -> list[cf.Orbit]:
    """Return the orbits of a branch at a value, solved from the points on either side of it."""
    orbits = []
    for k in range(len(branch) - 1):
        if (branch.values[k] - value) * (branch.values[k + 1] - value) < 0.0:
            near = k if abs(branch.values[k] - value) < abs(branch.values[k + 1] - value) else k + 1
            vector = branch[near].vector.copy()
            vector[branch.model.index_of("Omega")] = value
            orbit = refine(replace(branch[near], vector=vector))
            assert orbit is not None and orbit.converged
            orbits.append(orbit)
    return orbits


def test_bands_are_made_of_solved_orbits(found: cf.Ensemble) -> None:
    """Orbits at fixed values, solved there, are in the ensemble with their stability, and nothing else.

    The rows are interpolated between points of the branches: near the end of a steep branch to 2e-6.
    """
    rows, compared = found.rows, 0
    for number in (1, 7):
        diagram = diagram_of(found, number)
        for k in range(3, len(found.values), 6):
            value = found.values[k]
            orbits = [o for b in diagram.branches for o in solved_at(b, value) if not b.bridge]
            expected = sorted((int(o.stable), o.x_max) for o in orbits)
            own = (rows.orbit_sample == number) & (rows.orbit_index == k)
            own &= np.char.find(rows.orbit_name, "hold") < 0
            mine = sorted(zip(rows.orbit_stable[own].tolist(), rows.orbit_row[own], strict=True))
            assert [stable for stable, _ in mine] == [stable for stable, _ in expected]
            np.testing.assert_allclose([x for _, x in mine], [x for _, x in expected], atol=1e-5)
            compared += len(expected)
    assert compared > 30


def test_bands_are_quantiles_of_the_rows(found: cf.Ensemble) -> None:
    (band,) = [b for b in found.bands((0.0, 0.5, 1.0)) if (b.name, b.stable) == ("2s", "unstable")]
    k = int(np.argmax(band.samples))
    rows = found.rows
    own = (rows.orbit_name == "2s") & (rows.orbit_index == k) & (rows.orbit_stable == 0)
    x = rows.orbit_row[own]
    assert band.quantiles[:, k].tolist() == [x.min(), np.median(x), x.max()]
    assert (band.orbits[k], band.samples[k]) == (len(x), len(set(rows.orbit_sample[own])))
    with pytest.raises(cf.ParameterError, match="from 0 to 1"):
        found.bands((0.5, 2.0))


def test_classes_are_lists_of_events(found: cf.Ensemble) -> None:
    assert sum(len(c.samples) for c in found.classes) == found.counts()["complete"] == len(found)
    assert sum(c.share for c in found.classes) == pytest.approx(1.0, abs=1e-12)
    for c in found.classes:
        assert c.low <= c.share <= c.high
        for number in c.samples[:2]:
            own = found.rows.event_sample == number
            assert sorted(c.events) == sorted(found.rows.event_label[own].tolist())


# ----------------------------------------------------------------------------------- known answers

#: The amplitude of a linear oscillator is in proportion to its load, and so is the gap that it just touches.
BILINEAR = Path(__file__).parents[1] / "models" / "bilinear.yaml"
LOADS = {"omega": 0.8, "k": 0.5, "zeta": 0.05}


def test_indices_of_a_touch_in_proportion_to_the_load(tmp_path: Path) -> None:
    """The gap touched is (A + a + 2 b) / |1 - omega^2 + 2 i zeta omega|: a has a fifth of its variance."""
    text = BILINEAR.read_text(encoding="utf-8")
    text = text.replace("A: 1.0}", "A: 1.0, a: 0.0, b: 0.0}").replace("A*cos", "(A + a + 2*b)*cos")
    (tmp_path / "loaded.yaml").write_text(
        text.replace("name: bilinear", "name: loaded"), encoding="utf-8"
    )
    box = {"a": (-0.1, 0.1), "b": (-0.1, 0.1)}
    model = cf.load_model(tmp_path / "loaded.yaml")
    params = {**LOADS, "gap": 1.5}
    found = cf.ensemble(model, "gap", (1.0, 6.0), box, params, samples=512, values=2)
    assert found.counts() == {"complete": 512}
    rows = found.rows
    assert rows.event_sample.tolist() == list(range(512))  # one event in each
    load = 1.0 + found.samples @ np.array([1.0, 2.0])
    response = abs(1.0 - LOADS["omega"] ** 2 + 2j * LOADS["zeta"] * LOADS["omega"])
    np.testing.assert_allclose(rows.event_value, load / response, rtol=1e-9)
    got = sobol_indices(rows.event_value, ("a", "b"), 0)
    assert got is not None and (got.blocks, got.share) == (128, 1.0)
    for name, share in (("a", 0.2), ("b", 0.8)):
        for indices, intervals in (
            (got.first, got.first_interval),
            (got.total, got.total_interval),
        ):
            low, high = intervals[name]
            assert low < share < high
            assert indices[name] == pytest.approx(share, abs=0.2)


def test_sobol_indices_of_a_known_function() -> None:
    """Of 3 x + y + 2 x y, x and y uniform on (-1/2, 1/2): variances 9/12, 1/12 and 4/144 of the product."""
    shares = np.random.default_rng(1).random((4096, 2, 2)) - 0.5
    block = np.stack([shares[:, 0], shares[:, 1], shares[:, 0], shares[:, 0]], axis=1)
    block[:, 2, 0], block[:, 3, 1] = shares[:, 1, 0], shares[:, 1, 1]
    x, y = block.reshape(-1, 2).T
    got = sobol_indices(3 * x + y + 2 * x * y, ("x", "y"), 0)
    assert got is not None and (got.blocks, got.share) == (4096, 1.0)
    whole = 9 / 12 + 1 / 12 + 4 / 144
    known = {"x": (9 / 12, 9 / 12 + 4 / 144), "y": (1 / 12, 1 / 12 + 4 / 144)}
    for name, (first, total) in known.items():
        assert got.first[name] == pytest.approx(first / whole, abs=0.04)
        assert got.total[name] == pytest.approx(total / whole, abs=0.04)
        low, high = got.first_interval[name]
        assert low < got.first[name] < high and high - low < 0.2


def test_one_parameter_has_all_of_the_variance() -> None:
    one, other = np.random.default_rng(2).random((2, 1024))
    got = sobol_indices(np.stack([one, other, other], axis=1).ravel(), ("x",), 0)
    assert got is not None
    assert got.first["x"] == pytest.approx(1.0, abs=0.1)
    assert got.total["x"] == pytest.approx(1.0, abs=0.1)
    assert sobol_indices(one[:45], ("x",), 0) is None


def test_samples_depend_on_seed_and_number_only(found: cf.Ensemble) -> None:
    more = compute(samples=17).samples
    assert (more[:12] == found.samples).all()
    assert not (compute(seed=4, samples=4).samples == found.samples[:4]).any()
    blocks = more[:16].reshape(4, 4, 2)  # A, B, A with S of B, A with S0 of B
    assert (blocks[:, 2, 0] == blocks[:, 1, 0]).all() and (blocks[:, 2, 1] == blocks[:, 0, 1]).all()
    assert (blocks[:, 3, 1] == blocks[:, 1, 1]).all() and (blocks[:, 3, 0] == blocks[:, 0, 0]).all()


def test_intervals_of_shares_know_of_blocks() -> None:
    """Of blocks whose samples are all alike the interval is that of as many samples as there are blocks."""
    alone = np.arange(20) < 8
    one = share_of(alone, np.ones(20, bool), 1)
    alike = share_of(np.repeat(alone, 5), np.ones(100, bool), 5)
    assert (alike.low, alike.high) == pytest.approx((one.low, one.high), abs=1e-12)
    assert share_of(alone, np.ones(20, bool), 5).share == 0.4


# ----------------------------------------------------------------------------------- bits, folders, limits


def test_the_same_bits_for_any_number_of_workers(found: cf.Ensemble) -> None:
    assert bits(compute(tile=5)) == bits(found)
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        assert bits(compute(executor=pool)) == bits(found)


def test_a_worker_killed_costs_its_tile(found: cf.Ensemble) -> None:
    said: list[str] = []
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        worker = pool.submit(os.getpid).result()

        def kill(text: str) -> None:
            said.append(text)
            if len(said) == 1:
                os.kill(worker, signal.SIGKILL)

        assert bits(compute(executor=pool, progress=kill)) == bits(found)
    assert any("lost by the executor" in text for text in said)


def test_interrupted_and_gone_on(found: cf.Ensemble, tmp_path: Path) -> None:
    def stop(text: str) -> None:
        if "%" in text:
            raise KeyboardInterrupt

    part = compute(folder=tmp_path, progress=stop)
    assert (
        not part.complete and 4 <= part.counts()["missing"] <= 8
    )  # the second of three tiles was begun
    said: list[str] = []
    whole = compute(folder=tmp_path, progress=said.append)
    assert said[0].startswith("1 of 3 tiles are in") and "about" in said[1]
    assert bits(whole) == bits(found)
    other = compute(folder=tmp_path, seed=4, progress=stop)
    assert not other.complete and 4 <= other.counts()["missing"] <= 8


def test_an_interrupt_keeps_what_its_tile_has_finished(
    found: cf.Ensemble, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C during the sixth sample, the second one of the second tile of four."""
    from contfric.ensembles import tile

    explore, calls = tile.explore, iter(range(len(found)))

    def interrupted(*what: Any, **options: Any) -> cf.Diagram:
        if next(calls) == 5:
            signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
            time.sleep(0.5)  # the main thread has seen it by then
        return explore(*what, **options)

    monkeypatch.setattr(tile, "explore", interrupted)
    part = compute()
    finished, rows, every = len(found) - part.counts()["missing"], part.rows, found.rows
    assert 6 <= finished < 8
    assert np.array_equal(rows.branches[:finished], every.branches[:finished])
    for name in ("event_value", "orbit_row"):
        own, table = getattr(rows, name), getattr(every, name)
        assert len(own) and np.array_equal(own, table[: len(own)])
    assert np.max(rows.orbit_sample) == finished - 1


def test_samples_that_fail_and_limits_are_counted() -> None:
    """With S above S0 the model is not defined; one branch is no whole diagram."""
    box = {"S": (0.3, 0.5)}
    options: dict[str, Any] = {"samples": 9, "max_branches": 1}
    found = cf.ensemble("coulomb", "Omega", RANGE, box, {"S0": 0.4}, **options)
    outside = int(np.sum(found.samples[:, 0] > 0.4))
    assert 0 < outside < 9
    assert found.counts() == {"limited": 9 - outside, "outside": outside}
    assert found.classes == () and "S0" in found.rows.reasons[found.samples[:, 0] > 0.4][0]


def test_a_fault_costs_its_sample_only(found: cf.Ensemble, monkeypatch: pytest.MonkeyPatch) -> None:
    from contfric.ensembles import tile

    explore, calls = tile.explore, iter(range(len(found)))

    def sometimes(*what: Any, **options: Any) -> cf.Diagram:
        if next(calls) == 3:
            raise OverflowError("too large")
        return explore(*what, **options)

    monkeypatch.setattr(tile, "explore", sometimes)
    hurt = compute()
    assert hurt.counts() == {"complete": len(found) - 1, "failed": 1}
    assert hurt.rows.reasons[3].startswith("internal error, OverflowError: too large")


# ----------------------------------------------------------------------------------- results


def test_save_and_load(found: cf.Ensemble, tmp_path: Path) -> None:
    cf.save(found, tmp_path / "x.npz")
    again = cf.load(tmp_path / "x.npz")
    assert isinstance(again, cf.Ensemble)
    assert bits(again) == bits(found) and repr(again) == repr(found)
    assert again.params == found.params and again.distributions == found.distributions


def test_tables(found: cf.Ensemble) -> None:
    pytest.importorskip("pandas")
    events = found.to_dataframe()
    assert len(events) == len(found.rows.event_value)
    assert list(events) == ["sample", "S", "S0", "event", "Omega"]
    assert list(found.to_dataframe("samples")["S"]) == found.samples[:, 0].tolist()
    assert found.to_dataframe("classes")["share"].sum() == pytest.approx(1.0)
    bands = found.to_dataframe("bands")
    assert (bands["q0.05"] <= bands["q0.95"]).all() and len(bands) > 41
    with pytest.raises(cf.ParameterError, match="samples, events, bands, classes"):
        found.to_dataframe("event")  # type: ignore[arg-type]


def test_xarray(found: cf.Ensemble) -> None:
    pytest.importorskip("xarray")
    data = found.to_xarray()
    place = data["place"].sel(event="SN 1a").to_numpy()
    np.testing.assert_array_equal(place, found.event("SN 1a").values)
    assert data["quantiles"].sizes["Omega"] == 41 and data.attrs["row"] == "x_max"


def test_figure(found: cf.Ensemble) -> None:
    ax = found.plot()
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels == ["0s", "1a", "2a", "2s"]


class NotFrozen:
    """As a distribution without its shapes is."""

    def ppf(self, q: Any) -> Any:
        return q


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"distributions": {"S": (0.3,)}}, "'S' is .low, high., or a frozen distribution"),
        ({"distributions": {"S": NotFrozen}}, "quantiles of .* are no numbers"),
        ({"distributions": {}}, "names no parameter"),
        ({"distributions": {"Omega": (0.4, 0.5)}}, "along 'Omega': it has no distribution"),
        ({"distributions": {"T": (0.4, 0.5)}}, "'T'"),
        ({"params": {"S": 0.3}}, "'S' has a value in params, and a distribution"),
        ({"params": {"Omega": 0.9}}, "Omega = 0.9, which is not between 0.48 and 0.55"),
        ({"row": "stops"}, "one number"),
        ({"values": [0.1, 0.2]}, "within its range"),
        ({"samples": 0}, "samples"),
        ({"executor": 3}, "executor is a concurrent.futures.Executor"),
        ({"range": (0.5, 0.4)}, "lower first"),
    ],
)
def test_bad_input_is_one_line(change: dict[str, Any], what: str) -> None:
    given = {"model": "coulomb", "parameter": "Omega", "range": RANGE, "distributions": box()}
    with pytest.raises(cf.ParameterError, match=what) as error:
        cf.ensemble(**{**given, **change})
    assert "\n" not in str(error.value)


STUDY = """
model: coulomb
params: {Omega: 0.5, S0: 0.4}
ensemble:
  parameter: Omega
  range: [0.48, 0.55]
  distributions: {S: [0.30, 0.34], S0: {norm: [0.4, 0.005]}}
  samples: 12
  seed: 3
  values: 41
figures: [{kind: ensemble}]
"""


def test_a_study_and_a_number_of_samples(found: cf.Ensemble, tmp_path: Path) -> None:
    (tmp_path / "random.yaml").write_text(STUDY, encoding="utf-8")
    again = cf.ensemble(tmp_path / "random.yaml", 4)
    assert len(again) == 4 and again.parameter == found.parameter
    np.testing.assert_array_equal(again.samples, found.samples[:4])
    with pytest.raises(cf.StudyError, match="asks for no ensemble"):
        cf.ensemble("fig05", 10)
    with pytest.raises(cf.ParameterError, match="takes parameter, range and distributions"):
        cf.ensemble("coulomb", "Omega")


def test_a_study(found: cf.Ensemble, tmp_path: Path) -> None:
    (tmp_path / "random.yaml").write_text(STUDY, encoding="utf-8")
    result = cf.run_study(tmp_path / "random.yaml", out=tmp_path / "out")
    assert result.status is RunStatus.DONE and result.ensemble is not None
    assert bits(result.ensemble) == bits(found)
    names = {path.name for path in result.files}
    assert {"ensemble.npz", "ensemble.csv", "ensemble.png"} <= names
    with (tmp_path / "out" / "ensemble.csv").open(encoding="utf-8") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["sample", "S", "S0", "event", "Omega"]
    assert len(rows) == 1 + len(found.rows.event_value)
    assert not (tmp_path / "out" / "checkpoint").exists()
    text = str(result.info["ensemble"]["outcomes"])
    assert text == "{'complete': 12}"


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("S: [0.30, 0.34]", "S: [0.30]", "'S' is .low, high."),
        ("norm: [0.4", "normal: [0.4", "one of scipy.stats"),
        ("norm: [0.4, 0.005]", "norm: [1, 2, 3, 4]", "norm: "),
        ("parameter: Omega", "parameter: Omg", "Omg"),
        ("samples: 12", "samples: 0", "whole number >= 1"),
        ("Omega: 0.5", "Omega: 0.7", "Omega = 0.7 of 'params'"),
    ],
)
def test_errors_of_a_study_name_the_line(old: str, new: str, what: str, tmp_path: Path) -> None:
    assert old in STUDY
    (tmp_path / "x.yaml").write_text(STUDY.replace(old, new), encoding="utf-8")
    with pytest.raises(cf.StudyError, match=rf"x\.yaml:\d+: .*{what}"):
        cf.run_study(tmp_path / "x.yaml", out=tmp_path / "out")


def test_images_are_told_apart_by_the_row(found: cf.Ensemble) -> None:
    """Asymmetric orbits come in pairs; the larger maximum has the name, whichever was computed."""
    rows = found.rows
    own, image = rows.orbit_name == "1a", rows.orbit_name == "1a (image)"
    assert own.sum() == image.sum() > 0 and (rows.orbit_index[own] == rows.orbit_index[image]).all()
    assert (rows.orbit_row[own] > rows.orbit_row[image]).mean() > 0.99
    assert not np.any(rows.orbit_name == "2s (image)")
