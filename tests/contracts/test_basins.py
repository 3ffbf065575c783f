"""Basins: labels against orbits that are found start by start, and all that a result has to be able to do."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.response import basin_map, targets
from contfric.response.basin_tile import BasinRows
from contfric.study.result import RunStatus

#: Two images of an asymmetric orbit, and a symmetric one, coexist.
THREE = {"Omega": 0.541, "S": 0.32, "S0": 0.4}
CHAOS = {"Omega": 0.35, "S": 0.05, "S0": 0.4}
GRID = {"x": np.linspace(-2.0, 2.0, 24), "v": np.linspace(-1.5, 1.5, 20)}


def bits(found: cf.Basins) -> bytes:
    joints = b"".join(orbit.joints.tobytes() for orbit in found.orbits)
    return found.labels.tobytes() + found.motions.tobytes() + joints


def nearest(orbit: cf.Orbit, others: Sequence[cf.Orbit]) -> int:
    """Return the number of the orbit that is the same one."""
    apart = [float(np.linalg.norm(orbit.state(0.2) - other.state(0.2))) for other in others]
    assert min(apart) < 1e-9
    return int(np.argmin(apart))


@pytest.fixture(scope="module")
def three() -> cf.Basins:
    return cf.basins("coulomb", GRID, THREE)


def test_labels_are_the_orbits_that_starts_converge_to(three: cf.Basins) -> None:
    """Random starts, simulated and solved one by one."""
    assert len(three.orbits) == 3 and all(orbit.stable for orbit in three.orbits)
    draw = np.random.default_rng(5)
    for _ in range(25):
        i, j = draw.integers(24), draw.integers(20)
        start = [GRID["x"][i], GRID["v"][j]]
        found = cf.find_orbit("coulomb", THREE, state=start)
        times = np.linspace(0.0, found.period, 7)
        mine = np.array([found.state(t) for t in times])
        theirs = np.array([three.orbits[three.labels[i, j]].state(t) for t in times])
        np.testing.assert_allclose(mine, theirs, atol=1e-9)


def test_a_phase_moves_the_starts() -> None:
    found = cf.basins("coulomb", GRID, THREE, {"phase": 0.3})
    period = 2.0 * np.pi / THREE["Omega"]
    draw = np.random.default_rng(6)
    for _ in range(8):
        i, j = draw.integers(24), draw.integers(20)
        start = [GRID["x"][i], GRID["v"][j]]
        orbit = cf.find_orbit("coulomb", THREE, state=start, time=0.3 * period)
        label = found.orbits[found.labels[i, j]]
        np.testing.assert_allclose(orbit.state(1.0), label.state(1.0), atol=1e-9)


def test_the_symmetry_of_the_model_is_that_of_the_basins() -> None:
    """The image of a start is half a period later: its basin is that of the image of the orbit."""
    one = cf.basins("coulomb", GRID, THREE)
    other = cf.basins("coulomb", GRID, THREE, {"phase": 0.5})
    image = {k: nearest(orbit.mirror(), other.orbits) for k, orbit in enumerate(one.orbits)}
    mirrored = np.vectorize(image.get)(one.labels)[::-1, ::-1]
    np.testing.assert_array_equal(mirrored, other.labels)


def test_a_wide_radius_takes_no_start_of_another_basin(
    three: cf.Basins, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(targets, "NEAR", 1e-8)
    np.testing.assert_array_equal(cf.basins("coulomb", GRID, THREE).labels, three.labels)


def test_given_orbits_and_a_diagram(three: cf.Basins) -> None:
    given = cf.basins("coulomb", GRID, THREE, orbits=three.orbits[::-1])
    order = [nearest(orbit, given.orbits) for orbit in three.orbits]
    np.testing.assert_array_equal(np.array(order)[three.labels], given.labels)
    diagram = cf.explore(three.orbits[0], "Omega", (0.535, 0.545), max_periods=2)
    known = cf.basins("coulomb", GRID, THREE, orbits=diagram)
    counts = sorted(share.count for share in known.shares)
    assert counts == sorted(share.count for share in three.shares)
    with pytest.raises(cf.ParameterError, match="other parameters"):
        cf.basins("coulomb", GRID, {**THREE, "S": 0.3}, orbits=diagram)
    with pytest.raises(cf.ParameterError, match="another model, or of other"):
        cf.basins("coulomb", GRID, {**THREE, "S": 0.3}, orbits=[three.orbits[0]])
    with pytest.raises(cf.ParameterError, match="a diagram or a list"):
        cf.basins("coulomb", GRID, THREE, orbits=3)


def test_chaos_is_named_and_shares_have_intervals() -> None:
    small = {"x": [-1.0, 0.0, 1.0], "v": [0.0, 0.5]}
    found = cf.basins("coulomb", small, CHAOS, periods=150)
    (share,) = found.shares
    assert (share.name, share.orbit, share.count, share.share) == ("chaotic", -1, 6, 1.0)
    assert 0.5 < share.low < 1.0 and share.high == 1.0
    assert found.where(cf.Motion.CHAOTIC).all()


def test_no_start_is_followed_before_an_orbit_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """What nothing catches is followed to the end, and for its exponent: minutes of a stiff model."""
    known, said = [], []
    computed = basin_map.compute_basin_tile

    def counted(task: Any, *rest: Any) -> Any:
        known.append(len(task.targets.key))
        return computed(task, *rest)

    monkeypatch.setattr(basin_map, "compute_basin_tile", counted)
    cf.basins("coulomb", GRID, THREE, progress=said.append)
    assert known and min(known) > 0
    assert any(
        re.search(r"\d+ starts took .*, all \d+ take about .* of one processor", t) for t in said
    )


def test_starts_with_orbits_of_their_own_are_not_followed_again_for_each(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """On a continuum a new orbit catches its own start only: passes grow with the logarithm of the starts."""
    orbits: list[int] = [-1]
    followed: list[int] = []

    def search(state: int, time: float) -> bool:
        orbits.append(state)
        return orbits.count(state) == 1

    def caught(left: Any) -> Any:
        followed.append(len(left))
        labels = np.array([0 if start in orbits else -1 for start in left], dtype=np.int32)
        return BasinRows(labels, np.full(len(left), cf.Motion.PERIODIC.code, dtype=np.uint8))

    job: Any = SimpleNamespace(
        states=range(500), time=0.0, tile=lambda _, left: left, foretell=lambda *_: None
    )
    monkeypatch.setattr(basin_map, "compute_basin_tile", caught)
    basin_map._find_by_seeds(job, SimpleNamespace(orbits=orbits, search=search))  # type: ignore[arg-type]
    assert len(orbits) == 65 == len(set(orbits))  # each of the 64 seeds was looked for once
    assert followed == [64, 64, 63, 61, 57, 49, 33, 1]


def test_escaping_starts_are_named() -> None:
    """Negative damping: what is large grows."""
    grid = {"x": [0.0, 4.0], "v": [0.0, 1.0]}
    found = cf.basins("coulomb", grid, {"Omega": 0.5, "S": 0.0, "S0": 0.0, "zeta": -0.1})
    assert [share.name for share in found.shares] == ["unbounded"]


@pytest.mark.parametrize("model", ["impact", "bang-bang", "rocking-block"])
def test_orbits_whose_segments_cross_a_section(model: str) -> None:
    """A simulation tells both sides of a section apart where an orbit has one segment across it."""
    known = cf.find_orbit(model)
    first, second = known.model.states[:2]
    at = known.state(0.0)
    shifts = 0.01 * np.ptp(known.trajectory()[1], axis=0)[:2]
    grid = {first: at[0] + shifts[0] * np.arange(2), second: at[1] + shifts[1] * np.arange(2)}
    rest = {name: float(at[k]) for k, name in enumerate(known.model.states) if k > 1}
    found = cf.basins(model, grid, None, rest)
    label = found.labels[0, 0]
    assert label >= 0
    np.testing.assert_allclose(found.orbits[label].state(0.0), at, atol=1e-9)


def test_impacts_that_chatter_are_told_by_the_model_that_rests_at_its_wall() -> None:
    """A reset without `chatter: true`: `find_orbit` finds the orbit with chatter, and basins take it.

    Basins ended with the error that 'table_lift' is not in a list, or had starts that end as chatter.
    """
    values = {"a": 1.2, "e": 0.5}
    grid = {"x": [1.0, 2.0, 5.0], "v": [0.0, 2.0]}
    found = cf.basins("bouncing-ball", grid, values)
    for i, x in enumerate(grid["x"]):
        for j, v in enumerate(grid["v"]):
            own = cf.find_orbit("bouncing-ball", values, state=[x, v])
            label = found.orbits[found.labels[i, j]]
            np.testing.assert_allclose(label.state(0.0), own.state(0.0), atol=1e-9)
    [rest] = [orbit for orbit in found.orbits if "chatter" in str(orbit.signature)]
    flight = cf.find_orbit("bouncing-ball", values, state=[5.0, 2.0])  # which chatters nowhere
    assert found.model.chatters == rest.model.chatters != flight.model.chatters == ()
    for known in ([flight], [rest]):
        given = cf.basins("bouncing-ball", grid, values, orbits=known)
        assert np.all(np.unique(given.labels) == [0, 1])


def test_without_excitation() -> None:
    belt = cf.load_model("belt")
    first, second = belt.states[:2]
    width = belt.spread(belt.defaults)
    grid = {first: width[0] * np.linspace(0.4, 1, 3), second: width[1] * np.linspace(0.1, 0.9, 3)}
    found = cf.basins(belt, grid, None)
    for i, j in ((0, 0), (2, 1)):
        label = found.labels[i, j]
        start = [float(grid[first][i]), float(grid[second][j])]
        if label < 0:
            assert found.motions[i, j] != cf.Motion.PERIODIC.code
            continue
        orbit = cf.find_orbit(belt, state=start)
        assert orbit.period == pytest.approx(found.orbits[label].period, abs=1e-9)
    with pytest.raises(cf.ParameterError, match="no phase"):
        cf.basins(belt, grid, None, {"phase": 0.2})
    ax = found.plot()  # orbits are closed lines: each point of them is a state of the orbit
    for line, orbit in zip(ax.lines, found.orbits, strict=True):
        x, y = (np.asarray(line.get_data()[k], dtype=float) for k in (0, 1))
        assert len(x) > 100 and np.hypot(x[-1] - x[0], y[-1] - y[0]) < 1e-9
        assert x.max() == pytest.approx(orbit.x_max, abs=1e-3 * np.ptp(x))
    assert ax.get_legend().get_texts()[-1].get_text() == "the orbits"


def test_the_same_bits_for_any_tiles_and_without_workers(three: cf.Basins) -> None:
    """With workers: test_workers.py."""
    for tile in (7, 100):
        assert bits(cf.basins("coulomb", GRID, THREE, tile=tile)) == bits(three)
    with ThreadPoolExecutor(1) as pool:
        pool.shutdown()  # takes nothing: all is computed here
        assert bits(cf.basins("coulomb", GRID, THREE, tile=100, executor=pool)) == bits(three)


def test_interrupted_and_gone_on(three: cf.Basins, tmp_path: Path) -> None:
    def stop(text: str) -> None:
        if "%" in text:
            raise KeyboardInterrupt

    options: dict[str, Any] = {"tile": 100, "folder": tmp_path}
    part = cf.basins("coulomb", GRID, THREE, progress=stop, **options)
    assert not part.complete and np.any(part.labels >= 0)
    assert sum(share.count for share in part.shares) == part.labels.size - part.missing
    left = part.missing
    assert left > 0 and f"{left} not computed" in repr(part) and "not computed" not in repr(three)
    entries = [text.get_text() for text in part.plot().get_legend().get_texts()]
    assert f"{left} starts not computed" in entries
    whole = cf.basins("coulomb", GRID, THREE, **options)
    assert whole.complete and bits(whole) == bits(three)
    small = GRID | {"x": GRID["x"][::8]}
    other = cf.basins("coulomb", small, THREE, **options)
    assert bits(other) == bits(cf.basins("coulomb", small, THREE))


def test_saved_table_and_drawn(three: cf.Basins, tmp_path: Path) -> None:
    cf.save(three, tmp_path / "basins.npz")
    again = cf.load(tmp_path / "basins.npz")
    assert isinstance(again, cf.Basins) and bits(again) == bits(three)
    assert again.shares == three.shares and again.at == three.at
    table = three.to_dataframe()
    assert len(table) == three.labels.size
    assert (table["orbit"].to_numpy().reshape(three.shape) == three.labels).all()
    assert list(table["x"][:2]) == [-2.0, -2.0] and table["v"][1] == GRID["v"][1]
    ax = three.plot()
    named = [text.get_text() for text in ax.get_legend().get_texts()]
    assert len(named) == 4 and named[3] == "the orbits, once a period" and len(ax.lines) == 3


@pytest.mark.parametrize(
    ("grid", "at", "options", "message"),
    [
        ({"x": [0.0, 1.0]}, {}, {}, "two of the states"),
        ({"x": [0.0, 1.0], "w": [0.0]}, {}, {}, "'w' is no state"),
        ({"x": [1.0, 0.0], "v": [0.0]}, {}, {}, "ascending"),
        (GRID, {"x": 1.0}, {}, "at has values of phase"),
        (GRID, {"phase": float("inf")}, {}, "finite"),
        (GRID, {}, {"periods": 0}, "periods"),
        (GRID, {}, {"tile": 0}, "tile"),
        (GRID, {}, {"executor": 2}, "Executor"),
        ({"x": np.arange(1e6), "v": np.arange(1e6)}, {}, {}, "GB"),
        (None, {}, {}, "two of the states"),
    ],
)
def test_bad_input(grid: Any, at: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(cf.ParameterError, match=message) as caught:
        cf.basins("coulomb", grid, THREE, at, **options)
    assert "\n" not in str(caught.value)


HEAD = "model: coulomb\nparams: {Omega: 0.541, S: 0.32, S0: 0.4}\n"
BASINS = "basins: {grid: {x: [-2, 2, 24], v: [-1.5, 1.5, 20]}}\n"


def test_study(three: cf.Basins, write, tmp_path: Path) -> None:
    path = write(HEAD + BASINS + "figures: [{kind: basins}]\n")
    result = cf.run_study(path, tmp_path / "out")
    assert result.status is RunStatus.DONE
    assert {f.name for f in result.files} == {"basins.csv", "basins.npz", "basins.png", "run.json"}
    assert result.basins is not None and bits(result.basins) == bits(three)
    with (tmp_path / "out" / "basins.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["orbit"]) for row in rows] == three.labels.ravel().tolist()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("basins: {grid: {x: [-2, 2, 5], w: [0, 1, 2]}}\n", "scene.yaml:3: .*no state"),
        ("basins: {grid: {x: [2, -2, 5], v: [0, 1, 2]}}\n", "scene.yaml:3: .*low < high"),
        ("basins: {grid: {x: [-2, 2, 5], v: [0, 1, 2]}, at: {y: 1}}\n", "scene.yaml:3: .*phase"),
        ("figures: [{kind: basins}]\n", "scene.yaml:3: .*needs 'basins'"),
    ],
)
def test_bad_study(write, tmp_path: Path, text: str, message: str) -> None:
    path = write(HEAD + text)
    with pytest.raises(cf.StudyError, match=message):
        cf.run_study(path, tmp_path / "out")


def test_shares_of_the_orbits_are_those_of_the_table(three: cf.Basins) -> None:
    known = [share.share for share in three.shares if share.orbit >= 0]
    np.testing.assert_array_equal(three.share[three.share > 0], known)
    assert len(three.share) == len(three.orbits)


def test_parameters_before_the_grid_are_understood_and_warned_of() -> None:
    small = {name: values[::8] for name, values in GRID.items()}
    with pytest.warns(DeprecationWarning, match="grid stands before the parameters"):
        old = cf.basins("coulomb", THREE, small)
    np.testing.assert_array_equal(old.labels, cf.basins("coulomb", small, THREE).labels)


def test_the_legend_is_inside_the_figure_of_a_study(write, tmp_path: Path) -> None:
    from matplotlib.image import imread

    path = write(
        "model: coulomb\nparams: {Omega: 0.541, S: 0.32, S0: 0.4}\n"
        "basins: {grid: {x: [-2, 2, 5], v: [-1, 1, 5]}}\nfigures: [{kind: basins}]\n"
    )
    cf.run_study(path, out=tmp_path / "run")
    pixels = imread(tmp_path / "run" / "basins.png")[..., :3]
    assert (pixels[:, -4:] == 1.0).all()  # what is cut reaches the edge


@pytest.mark.parametrize("seed", range(3))
def test_colours_of_cells_are_those_of_the_legend(three: cf.Basins, seed: int) -> None:
    """Any starts, of any kinds, some of them not computed."""
    rng = np.random.default_rng(seed)
    motions = rng.choice(np.array([*cf.Motion], dtype=object), size=three.labels.shape)
    labels = rng.integers(-1, 3, three.labels.shape).astype(np.int32)
    labels[motions == cf.Motion.MISSING] = -1
    codes = np.vectorize(lambda motion: motion.code)(motions).astype(np.uint8)
    found = replace(three, labels=labels, motions=codes)
    ax = found.plot()
    legend = ax.get_legend()
    colours = {
        text.get_text().partition(":")[0]: patch.get_facecolor()
        for text, patch in zip(legend.get_texts(), legend.get_patches(), strict=False)
    }
    mesh = ax.collections[0]
    cells = mesh.to_rgba(mesh.get_array()).reshape(*labels.T.shape, 4)
    shown = {"no_solution": "no solution starts there"}
    for i, k in np.ndindex(labels.shape):
        name = found.names[labels[i, k]] if labels[i, k] >= 0 else motions[i, k].name.lower()
        if name == "missing":
            assert cells[k, i][3] == 0.0
        else:
            assert tuple(cells[k, i]) == pytest.approx(colours[shown.get(name, name)])
