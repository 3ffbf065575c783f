"""Return maps: their points against the simulation, and the release map against single releases."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contfric as cf

CHAOS = {"Omega": 0.35, "S": 0.05, "S0": 0.4}
START = {"Omega": 0.5, "S": 0.32, "S0": 0.4}


@pytest.mark.parametrize("section", ["stops", "releases", "v"])
def test_points_are_events_of_the_simulation(section: str) -> None:
    found = cf.poincare("coulomb", CHAOS, section=section, periods=40, transient=0)
    events = cf.simulate("coulomb", CHAOS, periods=40)
    chosen = [
        mode == "stick" if section == "releases" else exit_ == "v"
        for mode, exit_ in events.itinerary
    ]
    np.testing.assert_array_equal(found.states, events.states[chosen])
    np.testing.assert_array_equal(found.times, events.times[chosen])
    np.testing.assert_array_equal(found.cycles, events.cycles[chosen])


def test_strobes_are_ends_of_simulations() -> None:
    found = cf.poincare("coulomb", START, section=0.25, periods=8, transient=0)
    assert len(found) == 8
    for k in range(8):
        _, _, y, _ = cf.simulate("coulomb", START, periods=k + 0.25).last
        np.testing.assert_allclose(found.states[k], y, atol=1e-10)


def test_pairs_and_table(tmp_path: Path) -> None:
    found = cf.poincare("coulomb", CHAOS, section=0.0, periods=30)
    x, y = found.pairs("v", step=2)
    np.testing.assert_array_equal(x[2:], y[:-2])
    assert len(found.to_dataframe()) == len(found) == 30
    assert len(found.plot(coordinate="t").lines) == 2
    cf.save(found, tmp_path / "points.npz")
    again = cf.load(tmp_path / "points.npz")
    assert isinstance(again, cf.Returns) and again.outcome is found.outcome
    np.testing.assert_array_equal(again.states, found.states)
    with pytest.raises(cf.ParameterError, match="coordinate"):
        found.coordinate("w")


def test_release_map_against_single_releases() -> None:
    """Each release is simulated on its own; its image is the next release, seen by the symmetry."""
    found = cf.release_map("coulomb", CHAOS, count=120)
    period = 2.0 * np.pi / CHAOS["Omega"]
    assert len(found) > 40 and found.surface == "F+" and found.mode == "stick"
    for k in range(0, len(found), 5):
        time = float(found.phases[k])
        x = np.cos(CHAOS["Omega"] * time) + CHAOS["S0"]  # the load stands at the limit
        np.testing.assert_allclose(found.states[k], [x, 0.0], atol=1e-12)
        events = cf.simulate(
            "coulomb", CHAOS, state=[x, -1e-300], time=time, periods=30, domain="x+v-"
        )
        first = next(i for i, (mode, _) in enumerate(events.itinerary) if mode == "stick")
        at = events.times[first] + (0.5 * period if events.itinerary[first][1] == "F-" else 0.0)
        apart = abs(found.images[k] - at % period)
        assert min(apart, period - apart) < 1e-8


def test_fixed_points_are_orbits() -> None:
    found = cf.release_map("coulomb", START, count=4000)
    orbit = cf.find_orbit("coulomb", START)
    period = orbit.period
    releases = [
        (end + (0.5 * period if exit_ == "F-" else 0.0)) % period
        for (mode, exit_), end in zip(orbit.itinerary, orbit.ends[:, 0], strict=True)
        if mode == "stick"
    ]
    for release in releases:
        assert np.min(np.abs(found.fixed_points() - release)) < 1e-4


@pytest.mark.parametrize("seed", range(4))
def test_no_branch_of_a_release_map_has_a_jump(seed: int) -> None:
    """Where the map is continuous, its changes get smaller with the step; over a jump they stay."""
    rng = np.random.default_rng(seed)
    params = {"Omega": rng.uniform(0.2, 0.6), "S": rng.uniform(0.02, 0.3)}
    params["S0"] = params["S"] + rng.uniform(0.05, 0.3)
    largest = []
    for count in (300, 300 * 27):
        found = cf.release_map("coulomb", params, count=count)
        change = np.abs(np.diff(found.returns))[found.branch[1:] == found.branch[:-1]]
        largest.append(np.nanmax(change))
    # a vertical tangent of third order: a third of the change stays
    assert largest[1] < 0.4 * largest[0]


def test_a_jump_between_two_releases_with_the_same_segments_parts_branches() -> None:
    """Near a phase of 1.229 rest just reaches its limit: it ends there, or 1.4 later."""
    found = cf.release_map("coulomb", CHAOS, count=400)
    k = int(np.searchsorted(found.phases, 1.229))
    assert found.branch[k] == found.branch[k - 1] + 1
    assert found.images[k] - found.images[k - 1] == pytest.approx(1.39, abs=0.05)
    assert np.min(np.abs(found.fixed_points() - 1.229)) > 0.1


def test_branches_and_cobweb(tmp_path: Path) -> None:
    found = cf.release_map("coulomb", CHAOS, count=400)
    assert sum(len(x) for x, _ in found.branches) == np.isfinite(found.images).sum()
    web = found.cobweb(float(found.phases[10]), 5)
    assert web[1] == pytest.approx(found.images[10])
    ax = found.plot(start=float(found.phases[10]), count=5)
    assert len(ax.lines) == len(found.branches) + 2
    assert len(found.to_dataframe()) == len(found)
    cf.save(found, tmp_path / "map.npz")
    again = cf.load(tmp_path / "map.npz")
    assert isinstance(again, cf.ReleaseMap)
    np.testing.assert_array_equal(again.images, found.images)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"surface": "v"}, "surface is one that rest is left at"),
        ({"count": 1}, "count"),
        ({"periods": 0}, "> 0"),
    ],
)
def test_bad_release_map(options: dict[str, Any], message: str) -> None:
    with pytest.raises(cf.ParameterError, match=message):
        cf.release_map("coulomb", START, **options)


def test_models_without_a_release_map() -> None:
    with pytest.raises(cf.ParameterError, match="has no release map"):
        cf.release_map("belt")


def test_study(write, tmp_path: Path) -> None:
    head = "model: coulomb\nparams: {Omega: 0.35, S: 0.05, S0: 0.4}\n"
    path = write(head + "poincare: {section: 0.5, periods: 20}\nfigures: [{kind: poincare}]\n")
    result = cf.run_study(path, tmp_path / "out")
    assert result.poincare is not None and len(result.poincare) == 20
    direct = cf.poincare("coulomb", CHAOS, section=0.5, periods=20)
    np.testing.assert_array_equal(result.poincare.states, direct.states)
    assert (tmp_path / "out" / "poincare.png").is_file()
    write(head + "poincare: {section: F}\n")
    with pytest.raises(cf.StudyError, match=r"scene.yaml:3: .*no section 'F'"):
        cf.run_study(path, tmp_path / "out2")


def test_a_study_of_releases(write, tmp_path: Path) -> None:
    head = "model: coulomb\nparams: {Omega: 0.35, S: 0.05, S0: 0.4}\n"
    path = write(head + "release_map: {count: 80}\nfigures: [{kind: release_map}]\n")
    result = cf.run_study(path, tmp_path / "out")
    direct = cf.release_map("coulomb", CHAOS, count=80)
    assert result.release_map is not None
    np.testing.assert_array_equal(result.release_map.images, direct.images)
    assert {"release_map.png", "release_map.npz"} <= {
        file.name for file in (tmp_path / "out").iterdir()
    }
    write(head + "release_map: {surface: v}\n")
    with pytest.raises(cf.StudyError, match=r"scene.yaml:3: .*rest is left at"):
        cf.run_study(path, tmp_path / "out2")


def test_a_state_may_stand_behind_the_parameters() -> None:
    one = cf.poincare("coulomb", START, [0.7, 0.2], section=0.25, periods=8, transient=0)
    other = cf.poincare("coulomb", START, state=[0.7, 0.2], section=0.25, periods=8, transient=0)
    np.testing.assert_array_equal(one.states, other.states)


def test_a_release_map_has_the_same_bits_wherever_its_tiles_are_computed(tmp_path: Path) -> None:
    said: list[str] = []

    def bits(found: cf.ReleaseMap) -> bytes:
        arrays = (found.images, found.returns, found.branch, found.states)
        return b"".join(array.tobytes() for array in arrays)

    plain = bits(cf.release_map("coulomb", CHAOS, count=120))
    with ThreadPoolExecutor(2) as executor:
        spread = cf.release_map("coulomb", CHAOS, count=120, executor=executor, tile=7)
    assert bits(spread) == plain
    kept: dict[str, Any] = {"count": 120, "tile": 50, "folder": tmp_path}
    assert bits(cf.release_map("coulomb", CHAOS, **kept)) == plain
    file = tmp_path / "parts"
    file.write_bytes(file.read_bytes()[:-1])
    assert bits(cf.release_map("coulomb", CHAOS, **kept, progress=said.append)) == plain
    finished, total = int(said[0].split()[0]), int(said[0].split()[2])
    assert finished == total - 1 > 0, said[0]


def test_what_comes_to_rest_never_again_is_not_waited_for() -> None:
    """Some releases of this block lead to a solution that slides for ever, however long it is followed."""
    long, short = (cf.release_map("popp", count=24, periods=periods) for periods in (1e9, 50))
    assert np.any(np.isnan(long.images)) and np.any(np.isfinite(long.images))
    assert long.images.tobytes() == short.images.tobytes()


@pytest.mark.parametrize(
    ("model", "params", "section", "outcome"),
    [
        ("coulomb", START, "stops", cf.Outcome.PERIODIC),
        ("coulomb", START, 0.3, cf.Outcome.PERIODIC),
        ("coulomb", CHAOS, "stops", cf.Outcome.APERIODIC),
        ("coulomb", CHAOS, 0.0, cf.Outcome.APERIODIC),
        ("two-blocks", {}, "first", cf.Outcome.PERIODIC),
        ("impact", {}, 0.0, cf.Outcome.PERIODIC),
    ],
)
def test_what_repeats_itself_is_periodic(
    model: str, params: dict[str, float], section: str | float, outcome: cf.Outcome
) -> None:
    found = cf.poincare(model, params, section=section, periods=400, transient=2000)
    assert found.outcome is outcome
