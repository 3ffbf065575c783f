"""Lyapunov maps: shapes, starts, tables, files, errors, memory; what is drawn."""

from __future__ import annotations

import pickle
import re
import subprocess
import sys
import tracemalloc
from dataclasses import fields
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest

mpl.use("Agg")

import contfric as cf
from contfric import Motion
from contfric.chaos.tiles import Tile, TileRows, compute_tile

GRID = {"Omega": np.linspace(0.3, 0.55, 6), "S": np.linspace(0.02, 0.45, 5)}
FIXED = {"S0": 0.4}


@pytest.fixture(scope="module")
def lmap() -> cf.LyapunovMap:
    return cf.lyapunov_map("coulomb", GRID, FIXED, periods=100)


def same_bits(one: TileRows, other: TileRows) -> bool:
    return all(
        getattr(one, f.name).tobytes() == getattr(other, f.name).tobytes() for f in fields(one)
    )


# ----------------------------------------------------------------------------------- values


def test_shapes(lmap: cf.LyapunovMap) -> None:
    assert lmap.shape == lmap.values.shape == (6, 5)
    assert lmap.exponents.shape == (6, 5, 1, 2)
    assert lmap.uncertainty.shape == lmap.second.shape == lmap.dimension.shape == (6, 5)
    assert list(lmap.axes) == ["Omega", "S"]
    assert lmap.params == {"S0": 0.4, "h": 0.0, "zeta": 0.0}
    assert lmap.complete


def test_each_cell_is_the_single_motion(lmap: cf.LyapunovMap) -> None:
    for i, omega in enumerate(GRID["Omega"]):
        for j, s in enumerate(GRID["S"][:4]):
            found = cf.lyapunov_exponent(
                "coulomb",
                {"Omega": omega, "S": s, "S0": 0.4},
                periods=100,
                transient=100,
                tolerance=0.01,
            )
            assert found.exponents.tobytes() == lmap.exponents[i, j, 0].tobytes()
            assert found.motion.code == lmap.motions[i, j, 0]
            assert (found.periods, found.followed) == (
                lmap.periods[i, j, 0],
                lmap.followed[i, j, 0],
            )


def test_points_outside_of_the_model_say_so(lmap: cf.LyapunovMap) -> None:
    outside = lmap.motions[:, 4, 0]  # S = 0.45 > S0
    assert np.all(outside == Motion.OUTSIDE.code)
    assert np.isnan(lmap.values[:, 4]).all()
    assert np.isfinite(lmap.values[:, :4]).all()
    assert lmap.counts()[Motion.OUTSIDE] == 6


def test_order_of_axes_is_that_of_the_mapping(lmap: cf.LyapunovMap) -> None:
    turned = {"S": GRID["S"], "Omega": GRID["Omega"]}
    other = cf.lyapunov_map("coulomb", turned, FIXED, periods=100)
    assert other.values.T.tobytes() == np.ascontiguousarray(lmap.values).tobytes()


@pytest.mark.parametrize("side", [1, 2, 4, 100])
def test_tiles_do_not_matter(lmap: cf.LyapunovMap, side: int) -> None:
    other = cf.lyapunov_map("coulomb", GRID, FIXED, periods=100, tile=side)
    assert same_bits(lmap.rows, other.rows)


def test_codes_of_the_kernel_are_those_of_the_enumeration() -> None:
    from contfric.chaos import endings, tangent

    numbers = {
        Motion.PERIODIC: endings.PERIODIC,
        Motion.TRANSIENT: endings.TRANSIENT,
        Motion.CHAOTIC: endings.CHAOTIC,
        Motion.SETTLING: endings.SETTLING,
        Motion.UNDECIDED: endings.UNDECIDED,
        Motion.HELD: endings.AT_REST,
        Motion.UNBOUNDED: endings.UNBOUNDED,
        Motion.NO_SOLUTION: endings.NO_MOTION,
        Motion.BROKEN: endings.BROKEN,
        Motion.CHATTER: endings.CHATTERS,
        Motion.UNCUT: endings.UNCUT,
    }
    assert all(motion.code == number for motion, number in numbers.items())
    assert set(Motion) - set(numbers) == {Motion.OUTSIDE, Motion.MISSING}  # not of the kernel
    assert tangent.BROKEN == endings.BROKEN


# ----------------------------------------------------------------------------------- starts


def test_a_state_may_depend_on_the_parameters() -> None:
    """The start of the reference, (1 + 0.9 S0, 0)."""
    by_function = cf.lyapunov_map(
        "coulomb", GRID, FIXED, periods=50, state=lambda p: (1.0 + 0.9 * p["S0"], 0.0)
    )
    by_hand = cf.lyapunov_map("coulomb", GRID, FIXED, periods=50, state=[1.36, 0.0])
    assert same_bits(by_function.rows, by_hand.rows)


def test_several_starts_find_coexisting_attractors() -> None:
    """At S = 0.32, S0 = 0.4, between 0.53529 (CS_s) and 0.54191 (SN) 0s and 1a are both stable."""
    grid = {"Omega": [0.5, 0.54], "S": [0.32]}
    found = cf.lyapunov_map("coulomb", grid, FIXED, starts=60)
    assert found.starts == 60
    assert found.coexisting.tolist() == [[False], [True]]
    rates = set(found.exponents[1, 0, :, 0].round(7).tolist())
    params = {"Omega": 0.54, "S": 0.32, "S0": 0.4}
    orbits = [cf.solve_orbit("coulomb", name, params) for name in ("0s", "1a")]
    assert rates == {round(float(np.log(abs(o.multipliers[0])) / o.period), 7) for o in orbits}
    assert found.values[1, 0] == found.exponents[1, 0, :, 0].max()


def test_given_starts_are_those_that_are_followed() -> None:
    states = [[1.3, 0.0], [0.2, -0.4]]
    grid = {"Omega": [0.54], "S": [0.32]}
    found = cf.lyapunov_map("coulomb", grid, FIXED, state=states)
    params = {"Omega": 0.54, "S": 0.32, "S0": 0.4}
    for k, state in enumerate(states):
        single = cf.lyapunov_exponent("coulomb", params, state=state, transient=100, periods=600)
        assert single.exponents.tobytes() == found.exponents[0, 0, k].tobytes()


def test_chaotic_transients_are_told_from_chaos() -> None:
    """A solution that looks chaotic for hundreds of periods, from most of 50 starts, and never stays so."""
    grid, fixed = {"Omega": [0.17142857], "S": [0.03025210]}, {"S0": 0.3}
    call: dict[str, Any] = {"periods": 60, "transient": 10, "starts": 50}
    short = cf.lyapunov_map("coulomb", grid, fixed, **call)
    told = cf.lyapunov_map("coulomb", grid, fixed, **call, confirm=50_000)
    assert short.counts()[Motion.CHAOTIC] > 20
    assert Motion.CHAOTIC not in told.counts()
    assert told.counts()[Motion.TRANSIENT] > 20
    assert short.chaotic.all()
    assert not told.chaotic.any()
    settled = np.isin(told.motions, [Motion.PERIODIC.code, Motion.TRANSIENT.code])
    assert settled.all()
    np.testing.assert_allclose(told.exponents[..., 0], told.values[0, 0], rtol=0.0, atol=1e-8)
    assert told.values[0, 0] < 0.0
    chaos = cf.lyapunov_map(
        "coulomb", {"Omega": [0.35], "S": [0.05]}, FIXED, periods=60, starts=3, confirm=20_000
    )
    assert chaos.counts()[Motion.CHAOTIC] == 3


# ----------------------------------------------------------------------------------- tables, files


def test_table(lmap: cf.LyapunovMap) -> None:
    table = lmap.to_dataframe()
    assert len(table) == 30
    row = table.iloc[7]
    assert row["Omega"] == GRID["Omega"][1]
    assert row["S"] == GRID["S"][2]
    assert row["exponent_1"] == lmap.values[1, 2]
    assert set(table["motion"]) <= {motion.name.lower() for motion in Motion}


def test_save_and_load(lmap: cf.LyapunovMap, tmp_path: Path) -> None:
    cf.save(lmap, tmp_path / "map.npz")
    loaded = cf.load(tmp_path / "map.npz")
    assert isinstance(loaded, cf.LyapunovMap)
    assert same_bits(lmap.rows, loaded.rows)
    assert {k: v.tolist() for k, v in loaded.axes.items()} == {
        k: v.tolist() for k, v in lmap.axes.items()
    }
    assert loaded.vector.tobytes() == lmap.vector.tobytes()
    assert loaded.model is lmap.model
    assert repr(loaded) == repr(lmap)


def test_file_of_another_shape_is_damaged(lmap: cf.LyapunovMap, tmp_path: Path) -> None:
    file = tmp_path / "map.npz"
    cf.save(lmap, file)
    with np.load(file) as archive:
        arrays = dict(archive)
    name = max(arrays, key=lambda name: arrays[name].size)
    arrays[name] = arrays[name][:-1]
    np.savez(file, **arrays)
    with pytest.raises(cf.ResultFileError, match="damaged"):
        cf.load(file)


# ----------------------------------------------------------------------------------- figures


def test_plot_shades_what_is_positive(lmap: cf.LyapunovMap) -> None:
    ax = lmap.plot()
    assert ax.get_xlabel() == r"$\Omega$"
    assert ax.get_ylabel() == "$S$"
    mesh = next(c for c in ax.collections if c.get_array().shape == (5, 6) and c.colorbar)
    shown = mesh.get_array()
    drawn = ~np.ma.getmaskarray(shown).T
    assert drawn.any()
    assert drawn.tolist() == lmap.chaotic.tolist()
    assert np.all(shown.compressed() > 0.0)
    assert r"\lambda" in mesh.colorbar.ax.get_ylabel()
    legend = ax.get_legend()
    assert legend is not None  # S = 0.45 is outside of the model
    assert [text.get_text() for text in legend.get_texts()] == [
        "no positive exponent",
        "no exponent",
    ]


def test_plot_on_axes_of_the_caller(lmap: cf.LyapunovMap) -> None:
    from matplotlib.figure import Figure

    ax = Figure().add_subplot()
    assert lmap.plot(ax) is ax


def test_plot_without_chaos_and_of_one_row() -> None:
    regular = cf.lyapunov_map("coulomb", {"Omega": [0.5], "S": [0.3, 0.32]}, FIXED, periods=50)
    ax = regular.plot()
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == ["no positive exponent"]  # what white means


# ----------------------------------------------------------------------------------- errors


def test_errors() -> None:
    def refused(match: str, axes: Any = GRID, params: Any = None, **options: Any) -> None:
        with pytest.raises(cf.ParameterError, match=match):
            cf.lyapunov_map("coulomb", axes, params or FIXED, **options)

    refused("did you mean 'Omega'", {"Omga": [0.5], "S": [0.3]})
    refused("did you mean 'zeta'", params={"zet": 0.1})
    refused("mapping of two parameters", {"Omega": [0.5]})
    refused("mapping of two parameters", [0.5])
    refused("ascending", {"Omega": [0.5, 0.4], "S": [0.3]})
    refused("ascending", {"Omega": [0.5, np.nan], "S": [0.3]})
    refused("ascending", {"Omega": [], "S": [0.3]})
    refused("ascending", {"Omega": 0.5, "S": [0.3]})
    refused("must be a number", params={"S0": "0.4"})
    refused("S0 >= S", {"Omega": [0.5], "S": [0.5]})
    refused("starts is a whole number", starts=0)
    refused("leave out state", starts=2, state=[1.0, 0.0])
    refused("is 2 finite numbers", state=[1.0])
    refused("is 2 finite numbers", state="far")
    refused("is 2 finite numbers", state=lambda p: [np.inf, 0.0])
    refused("states at one point", state=lambda p: [[1.0, 0.0]] * (1 + (p["Omega"] > 0.4)))
    refused("periods is a whole number", periods=0)
    refused("transient is a whole number", transient=-1)
    refused("tolerance is a number", tolerance=-0.1)
    refused("tolerance is a number", tolerance=True)
    refused("tile is a whole number", tile=0)
    refused("time is a finite number", time=np.inf)
    refused("client.get_executor", executor=object())
    with pytest.raises(cf.ParameterError, match="one state is followed"):
        cf.lyapunov_exponent("coulomb", state=[[1.0, 0.0], [1.1, 0.0]])
    with pytest.raises(cf.ParameterError, match="did you mean 'coulomb'"):
        cf.lyapunov_map("coulom", GRID)


# ----------------------------------------------------------------------------------- the house


def test_a_task_carries_the_name_of_a_known_model() -> None:
    tile = _tile(cf.load_model("coulomb"))
    packed = pickle.dumps(tile)
    assert len(packed) < 1000
    again = pickle.loads(packed)
    assert again.model is tile.model
    assert same_bits(compute_tile(again), compute_tile(tile))


def test_a_task_carries_a_model_that_is_not_known_by_name() -> None:
    import dataclasses

    own = dataclasses.replace(cf.load_model("coulomb"), name="my own")
    assert own.flow is own.flow  # compiled code, which must not travel
    tile = _tile(own)
    first, second = (pickle.loads(pickle.dumps(tile)) for _ in range(2))
    assert first.model.name == "my own"
    assert first.model is second.model  # so that its tables are made once
    assert "flow" not in vars(first.model)
    assert same_bits(compute_tile(first), compute_tile(tile))


def _tile(model: cf.Model) -> Tile:
    from contfric.chaos.rows import FollowingLimits

    vector = model.vector({"S0": 0.4})
    values = (np.array([0.35, 0.5]), np.array([0.05, 0.3]))
    return Tile(model, FollowingLimits(20, 50, 0.01), vector, (0, 1), values, 1, None, 0.0)


def test_memory_is_that_of_the_results() -> None:
    """Beyond its results a map takes the memory of a few tiles, however large it is."""
    side = 160
    grid = {"Omega": np.linspace(0.3, 0.6, side), "S": np.linspace(0.1, 0.4, side)}
    cf.lyapunov_map(
        "coulomb", GRID, FIXED, periods=1, transient=0
    )  # what is compiled and imported once
    tracemalloc.start()
    try:
        found = cf.lyapunov_map("coulomb", grid, FIXED, periods=1, transient=0)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    results = sum(getattr(found.rows, f.name).nbytes for f in fields(TileRows))
    assert results == side * side * (2 * 8 + 8 + 1 + 4 + 4)
    assert peak < 1.5 * results + 1_000_000


def test_nothing_heavy_is_loaded_before_it_is_used() -> None:
    code = (
        "import sys, contfric as cf; cf.lyapunov_map, cf.lyapunov_exponent, cf.LyapunovMap, cf.Motion; "
        "print(*[m for m in ('numba', 'matplotlib', 'pandas', 'distributed', 'multiprocessing.pool') "
        "if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_progress_says_how_long_it_takes() -> None:
    said: list[str] = []
    cf.lyapunov_map("coulomb", GRID, FIXED, periods=20, tile=2, progress=said.append)
    assert said[-1] == "Lyapunov map: 9 of 9 tiles"
    assert re.fullmatch(r"Lyapunov map: 1 of 9 tiles, 11%, about \d+ s left", said[0])
    assert len(said) == 9
