"""Stable sets of unstable orbits: starts on either side of them go to different orbits."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contfric as cf

PARAMS = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
RANGES = {"x": (-2.0, 2.0), "v": (-1.2, 1.2)}


@pytest.fixture(scope="module")
def saddle() -> cf.Orbit:
    return cf.solve_orbit("coulomb", "2s", PARAMS)


@pytest.fixture(scope="module")
def edge(saddle: cf.Orbit) -> Any:
    return cf.stable_set(saddle, RANGES, max_step=0.08)


def attractor(start: np.ndarray) -> float:
    """Return what tells the two images of 1a: the displacement at a phase, from a simulation alone."""
    found = cf.simulate("coulomb", PARAMS, state=start, periods=300)
    return float(found.last[2][0])


def test_both_sides_of_the_set_go_to_different_orbits(edge: Any) -> None:
    """Every point of it, displaced by 1e-5 across it: by simulation, which knows nothing of the set."""
    tried = 0
    for half, breaks in zip(edge.states, edge.breaks, strict=True):
        for k in range(1, len(half) - 1):
            if k in breaks or k + 1 in breaks:
                continue
            chord = half[k + 1] - half[k - 1]
            across = 1e-5 * np.array([-chord[1], chord[0]]) / np.hypot(*chord)
            assert abs(attractor(half[k] + across) - attractor(half[k] - across)) > 0.05
            tried += 1
    assert tried > 20


def test_starts_on_the_set_come_to_the_orbit(edge: Any, saddle: cf.Orbit) -> None:
    home = saddle.state(0.0)
    for half in edge.states:
        found = cf.simulate("coulomb", PARAMS, state=half[len(half) // 2], periods=40)
        times = np.arange(1, 40) * saddle.period
        assert np.min(np.hypot(*(found.sample(times) - home).T)) < 1e-6


def test_the_phase_is_that_of_the_starts(saddle: cf.Orbit) -> None:
    """The flow takes the set of one phase to that of another one."""
    one = cf.stable_set(saddle, RANGES, phase=0.2, max_points=6)
    period = saddle.period
    for state in one.points[1:-1]:
        found = cf.simulate("coulomb", PARAMS, state=state, time=0.2 * period, periods=30.8)
        apart = found.sample(np.arange(2, 31) * period) - saddle.state(0.0)
        assert np.min(np.hypot(*apart.T)) < 1e-6


@pytest.mark.parametrize("lines", [1, 2])
def test_it_goes_on_from_its_folder(
    edge: Any, saddle: cf.Orbit, tmp_path: Path, monkeypatch, lines: int
) -> None:
    """Stopped after any stretch it has the same bits; from the folder alone nothing is followed anew."""
    told: list[str] = []

    def stop(text: str) -> None:
        told.append(text)
        if len(told) == lines:
            raise KeyboardInterrupt

    part = cf.stable_set(saddle, RANGES, max_step=0.08, folder=tmp_path, progress=stop)
    assert not part.complete and len(told) == lines
    assert told[0].startswith(f"{min(51, len(edge.states[0]))} points of a half")
    for _ in range(2):
        again = cf.stable_set(saddle, RANGES, max_step=0.08, folder=tmp_path)
        assert again.points.tobytes() == edge.points.tobytes() and again.ends == edge.ends
        assert [b.tolist() for b in again.breaks] == [b.tolist() for b in edge.breaks]
        monkeypatch.setattr("contfric.response.stable_half.Half.grow", None)  # not to be called


def test_it_is_a_table_a_figure_and_a_file(edge: Any, tmp_path: Path) -> None:
    assert len(edge.to_dataframe()) == len(edge.points)
    ax = edge.plot()
    assert ax.get_xlabel() == "$x$"
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == ["stable set", f"{edge.orbit.name}, unstable"]
    below = cf.basins(
        "coulomb", {name: np.linspace(*r, 6) for name, r in RANGES.items()}, PARAMS
    ).plot()
    known = [text.get_text() for text in below.get_legend().get_texts()]
    for _ in range(2):
        edge.plot(ax=below)
    assert [text.get_text() for text in below.get_legend().get_texts()] == [*known, *texts]
    cf.save(edge, tmp_path / "edge.npz")
    again = cf.load(tmp_path / "edge.npz")
    np.testing.assert_array_equal(again.points, edge.points)
    assert again.ends == edge.ends and repr(again) == repr(edge)


@pytest.mark.parametrize(
    ("orbit", "ranges", "words"),
    [
        ("1a", RANGES, "no stable set that separates"),
        ("2s", {"x": (-2, 2)}, "ranges are {'x': (lower, upper), 'v': (lower, upper)}"),
        ("2s", {"x": (2, -2), "v": (-1, 1)}, "ranges are {'x'"),
        (None, RANGES, "a stable set is one of an Orbit, got None"),
    ],
)
def test_what_has_none_says_why(orbit: str | None, ranges: Any, words: str) -> None:
    start: Any = None if orbit is None else cf.solve_orbit("coulomb", orbit, PARAMS)
    with pytest.raises(cf.ParameterError) as caught:
        cf.stable_set(start, ranges)
    assert words in str(caught.value)


def test_a_gap_is_crossed_whatever_the_step_is() -> None:
    """A gap is as wide as the map makes it; a short step must not end the set there."""
    saddle = cf.solve_orbit("coulomb", "2s", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    for step in (0.1, 0.02, 0.005):
        found = cf.stable_set(saddle, {"x": (-2, 2), "v": (-1, 1)}, max_step=step)
        assert [end.name for end in found.ends] == ["RANGE", "RANGE"]
        assert sum(map(len, found.breaks)) >= 1
