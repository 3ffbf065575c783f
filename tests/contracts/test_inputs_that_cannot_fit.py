"""Inputs that no computation could be made of: one line, at once, and nothing is computed or written."""

from __future__ import annotations

import os
import stat
import time
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.errors import (
    ContfricError,
    ParameterError,
    ResultFileError,
    checked_range,
    real_number,
    shown,
    whole_number,
)
from contfric.models.reading.files import read_model
from contfric.results import load, save
from contfric.study.read import read_study

START = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
HUGE = 10**400
GRID = {"Omega": [0.4, 0.5], "S": [0.1, 0.2]}


@pytest.fixture(scope="module")
def orbit() -> cf.Orbit:
    return cf.find_orbit("coulomb", START)


def refused(call: Callable[[], object], kind: type[ContfricError] = ParameterError) -> str:
    """Return the one line that a call is refused with, within a second."""
    began = time.monotonic()
    with pytest.raises(kind) as caught:
        call()
    assert time.monotonic() - began < 1.0
    text = str(caught.value)
    assert "\n" not in text and len(text) < 400
    return text


NONE = [HUGE, -HUGE, 10**5000, np.inf, -np.inf, np.nan, True, "0.5", 1j, None, [0.5]]


@pytest.mark.parametrize("value", NONE, ids=shown)
def test_numbers_that_are_none(value: Any, orbit: cf.Orbit) -> None:
    calls: list[Callable[[], object]] = [
        lambda: cf.find_orbit("coulomb", {**START, "Omega": value}),
        lambda: cf.simulate("coulomb", {**START, "S0": value}),
        lambda: cf.simulate("coulomb", START, periods=value),
        lambda: cf.simulate("coulomb", START, time=value),
        lambda: cf.find_orbit("coulomb", START, time=value),
        lambda: cf.simulate("coulomb", START, state=[value, 0.0] if value != [0.5] else [[0.5], 0]),
        lambda: cf.continue_orbit(orbit, "Omega", (0.3, value)),
        lambda: cf.explore(orbit, "Omega", (value, 0.7)),
        lambda: cf.explore_plane(orbit, ("Omega", "S"), {"Omega": (0.3, value), "S": (0.1, 0.4)}),
        lambda: cf.lyapunov_exponent("coulomb", START, tolerance=value),
        lambda: cf.lyapunov_exponent("coulomb", START, time=value),
        lambda: cf.lyapunov_map("coulomb", {**GRID, "S": [0.1, value]}, {"S0": 0.4}),
        lambda: cf.lyapunov_map("coulomb", GRID, {"S0": value}),
    ]
    if value is not None:  # the model's own step
        calls.append(lambda: cf.continue_orbit(orbit, "Omega", (0.3, 0.7), max_step=value))
    for call in calls:
        if isinstance(value, (bool, str)) and call is calls[5]:
            continue  # arrays of numpy take them for numbers
        if isinstance(value, (bool, str)) and call is calls[11]:
            continue
        refused(call)


@pytest.mark.parametrize("value", [HUGE, -1, 2.0, np.nan, True, "3"], ids=shown)
def test_counts_that_are_none(value: Any, orbit: cf.Orbit) -> None:
    bounds = (0.49, 0.5)
    for call in (
        lambda: cf.continue_orbit(orbit, "Omega", bounds, max_points=value),
        lambda: cf.explore(orbit, "Omega", bounds, max_periods=value),
        lambda: cf.explore(orbit, "Omega", bounds, max_branches=value),
        lambda: cf.find_orbit("coulomb", START, longest=value),
        lambda: cf.find_orbit("coulomb", START, value),
        lambda: cf.simulate("coulomb", START, events=value),
        lambda: cf.census("coulomb", START, periods=value),
        lambda: cf.lyapunov_exponent("coulomb", START, periods=value),
        lambda: cf.lyapunov_map("coulomb", GRID, START, starts=value),
        lambda: cf.lyapunov_map("coulomb", GRID, START, tile=value),
    ):
        refused(call)


@pytest.mark.parametrize(
    "bounds",
    [
        (1e-300, 1e300),
        (0.1, 1e12),
        (-1e308, 1e308),
        (0.5 - 1e-13, 0.5 + 1e-13),
        (0.7, 0.3),
        (0.3,),
        (0.3, 0.5, 0.7),
        "ab",
        0.5,
        None,
        (0.3, HUGE),
        (False, True),
        {0.3, 0.7},
        {0.3: 0, 0.7: 1},
        map(float, (0.3, 0.7)),
    ],
    ids=lambda given: type(given).__name__ if hasattr(given, "__next__") else shown(given),
)
def test_ranges_that_are_none(bounds: Any, orbit: cf.Orbit) -> None:
    refused(lambda: cf.continue_orbit(orbit, "Omega", bounds))
    refused(lambda: cf.explore(orbit, "Omega", bounds))


WIDE = [(1e-300, 1e300), (-1e308, 1e308), (0.5, 0.5 + 1e-13), (0, HUGE)]


@pytest.mark.parametrize("bounds", WIDE, ids=shown)
def test_ranges_of_a_plane_that_are_none(bounds: Any, orbit: cf.Orbit) -> None:
    ranges = {"Omega": bounds, "S": (0.1, 0.4)}
    refused(lambda: cf.explore_plane(orbit, ("Omega", "S"), ranges))


def test_a_range_that_is_too_narrow_is_shown_with_all_digits(orbit: cf.Orbit) -> None:
    text = refused(lambda: cf.explore(orbit, "Omega", (0.5, 0.5 + 1e-13)))
    assert "(0.5, 0.5000000000001)" in text and "narrower" in text


@pytest.mark.parametrize("params", [{"Omega": 1e308}, {"S0": 1e308, "h": 1e308}], ids=shown)
def test_starts_at_which_surfaces_have_no_finite_distance(params: dict[str, float]) -> None:
    refused(lambda: cf.find_orbit("coulomb", {**START, **params}), ContfricError)


def test_numbers_of_numpy_are_numbers(orbit: cf.Orbit) -> None:
    assert real_number("a", np.float32(0.5)) == 0.5 and real_number("a", Fraction(1, 4)) == 0.25
    assert whole_number("n", np.int64(7), least=0) == 7
    assert checked_range("a", np.array([0.25, 3])) == (0.25, 3.0)
    settings = {"max_points": np.int32(50), "max_step": np.float64(0.01)}
    branch = cf.continue_orbit(orbit, "Omega", (np.float64(0.499), np.float64(0.501)), **settings)
    assert len(branch) > 3
    assert len(cf.simulate("coulomb", START, periods=np.int64(3), events=np.int64(5))) == 5


def test_what_is_shown_of_a_value_is_one_short_line() -> None:
    for value in (HUGE, 10**5000, [10**5000], "x" * 5000, np.zeros((50, 50)), {"a": "\n"}):
        assert len(shown(value)) <= 80 and "\n" not in shown(value)


@pytest.mark.parametrize("points", [(200_000, 200_000), (2, 10**5)])
def test_maps_that_do_not_fit(points: tuple[int, int]) -> None:
    axes = dict(zip(("Omega", "S"), (np.linspace(0.1, 0.3, n) for n in points), strict=True))
    starts = 1 if min(points) > 2 else 10**8
    assert "GB" in refused(lambda: cf.lyapunov_map("coulomb", axes, {"S0": 0.4}, starts=starts))


def write(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


BOMBS = {
    "items": "a: [" + "1," * 2_000_000 + "1]",
    "fewer items": "a: [" + "1," * 60_000 + "1]",
    "laughs": "a0: &a0 [1]\n"
    + "".join(f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 12)),
    "merges": "a0: &a0 {x: 1}\n"
    + "".join(f"a{k}: &a{k} {{<<: [*a{k - 1}, *a{k - 1}]}}\n" for k in range(1, 40)),
    "itself": "a: &a {b: *a}",
    "deep": "a: " + "[" * 5_000,
    "deep mappings": "a: " + "{a: " * 5_000,
    "deep in lines": "a: " + "[\n" * 5_000,
    "deep lists": "a: \n " + "- " * 5_000,
    "deep keys": "? " * 5_000,
    "digits": "params: {Omega: 1" + "0" * 5_000 + "}",
    "hexadecimal": "model: coulomb\nparams: {Omega: 0x1" + "0" * 5_000 + "}",
}


@pytest.mark.parametrize("bomb", BOMBS)
def test_files_that_are_no_text_of_a_few_pages(bomb: str, tmp_path: Path) -> None:
    path = write(tmp_path / "bomb.yaml", BOMBS[bomb])
    for read in (read_study, read_model, lambda path: cf.load_signature(path, "coulomb")):
        began = time.monotonic()
        with pytest.raises(ContfricError) as caught:
            read(path)
        assert time.monotonic() - began < 5.0
        assert len(str(caught.value)) < 600


def test_aliases_that_repeat_little_are_read(tmp_path: Path) -> None:
    text = (
        "model: coulomb\nparams: {Omega: 0.5, S: 0.32, S0: 0.4}\nstart: simulate\nplane: {parameters: "
        "[Omega, S], range: {Omega: &r [0.3, 0.7], S: [0.1, 0.4]}, sections: {Omega: *r}}\nwant: "
        "[stability]\nfigures: [{kind: plane}]\n"
    )
    study = read_study(write(tmp_path / "a.yaml", text))
    assert study.content.plane is not None and study.content.plane.sections == {"Omega": [0.3, 0.7]}


def test_grids_of_a_study_that_do_not_fit(tmp_path: Path) -> None:
    text = (
        "model: coulomb\nparams: {S0: 0.4}\nstart: simulate\nlyapunov: {grid: {Omega: [0.1, 0.7, 1.0e+12], "
        "S: [0.0, 0.4, 1.0e+12]}}\nwant: [stability]\nfigures: [{kind: lyapunov}]\n"
    )
    path = write(tmp_path / "a.yaml", text)
    assert "GB" in refused(lambda: read_study(path), cf.StudyError)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no such files here")
def test_files_that_are_no_files(orbit: cf.Orbit, tmp_path: Path) -> None:
    fifo = tmp_path / "fifo.npz"
    os.mkfifo(fifo)
    for path in (fifo, Path("/dev/zero"), tmp_path):
        refused(lambda path=path: load(path), ResultFileError)
    for path in (fifo, tmp_path):
        refused(lambda path=path: save(orbit, path), ResultFileError)
    assert stat.S_ISFIFO(fifo.stat().st_mode), "what was there is there still"
    os.mkfifo(tmp_path / "fifo.yaml")
    for read in (read_study, read_model, lambda path: cf.load_signature(path, "coulomb")):
        refused(lambda read=read: read(tmp_path / "fifo.yaml"), ContfricError)
    tiles = tmp_path / "tiles"
    tiles.mkdir()
    os.mkfifo(tiles / "parts")
    refused(lambda: cf.lyapunov_map("coulomb", GRID, {"S0": 0.4}, folder=tiles), ResultFileError)


@pytest.mark.parametrize("folder", [3, "", ["a"], b"\0"], ids=repr)
def test_folders_of_tiles_that_are_no_paths(folder: Any) -> None:
    starts = {"x": [0.0, 1.0], "v": [0.0, 1.0]}
    box = {"S": (0.3, 0.34)}
    calls: list[Callable[[], object]] = [
        lambda: cf.sweep("coulomb", "Omega", [0.5], {"S": 0.32}, folder=folder),
        lambda: cf.lyapunov_map("coulomb", GRID, folder=folder),
        lambda: cf.ensemble("coulomb", "Omega", (0.4, 0.6), box, samples=1, folder=folder),
        lambda: cf.basins("coulomb", starts, START, folder=folder),
    ]
    for call in calls:
        with pytest.raises(ResultFileError, match="the folder of finished parts is a path"):
            call()
