"""Trajectories between their events: samples, tables, figures, files."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import contfric as cf
from contfric.models import model_names

PARAMS = {"Omega": 0.5, "S": 0.32, "S0": 0.4}


@pytest.mark.parametrize("time", [0.0, 1.0, 63.0, -3.0])
def test_samples_are_the_solution_of_the_equation_of_motion(time: float) -> None:
    """Against scipy, from event to event: the law of each segment is known by its direction."""
    found = cf.simulate("coulomb", PARAMS, state=[1.3, 0.5], time=time, periods=3)
    period = 4 * np.pi
    bounds = [time, *(found.cycles * period + found.times), time + 3 * period]
    itineraries = [mode for mode, _ in found.itinerary] + [found.last[3]]
    y = np.array([1.3, 0.5])
    for mode, low, high in zip(itineraries, bounds[:-1], bounds[1:], strict=True):
        sign = {"slide+": 1.0, "slide-": -1.0, "stick": 0.0}[mode]

        def field(t: float, y: np.ndarray, sign: float = sign) -> list[float]:
            return [y[1], -y[0] + np.cos(0.5 * t) - 0.32 * sign] if sign else [0.0, 0.0]

        times = np.linspace(low, high, 7)[:-1]
        known = solve_ivp(field, (low, high), y, t_eval=times, rtol=1e-11, atol=1e-12)
        np.testing.assert_allclose(found.sample(times), known.y.T, atol=1e-8)
        y = found.sample(high)[0]


@pytest.mark.parametrize(
    "name", ["belt", "bouncing-ball", "lugre", "coulomb", "rimless-wheel", "braced-chain"]
)
def test_every_model_meets_its_own_events_and_end(name: str) -> None:
    """What is sampled at an event is the state there, after its reset if it has one."""
    model = cf.load_model(name)
    found = cf.simulate(model, periods=5)
    view = model.view(model.vector(found.params))
    times = found.cycles * view.period + found.times
    for (_, surface), time, phase, state in zip(
        found.itinerary, times, found.times, found.states, strict=True
    ):
        reset = surface in model.reset_by_surface
        behind = view.reset(surface, float(phase), state) if reset else state
        np.testing.assert_allclose(found.sample(float(time))[0], behind, atol=1e-9)
    cycle, phase, state, _ = found.last
    if found.end.name == "CHATTER":  # the last impacts are too many to be events
        return
    np.testing.assert_allclose(found.sample(cycle * view.period + phase)[0], state, atol=1e-9)


def test_an_orbit_is_its_own_trajectory() -> None:
    orbit = cf.find_orbit("coulomb", PARAMS)
    begin = float(orbit.cycle[0, 0]) + 0.1
    found = cf.simulate("coulomb", PARAMS, state=orbit.state(begin), time=begin, periods=2)
    times = begin + np.linspace(0.0, 2 * orbit.period, 57)
    known = np.array([orbit.state(float(t)) for t in times])
    np.testing.assert_allclose(found.sample(times), known, atol=1e-11)


def test_a_table_has_all_events_once_and_runs_on() -> None:
    found = cf.simulate("bouncing-ball", periods=4)
    frame = found.to_dataframe(200)
    assert list(frame.columns) == ["t", *found.model.states, "mode", "event"]
    assert [name for name in frame["event"] if name] == [surface for _, surface in found.itinerary]
    assert np.all(np.diff(frame["t"]) >= 0.0)
    assert 200 <= len(frame) <= 200 + 2 * (len(found) + 1)


@pytest.mark.parametrize("name", ["coulomb", "thermostat", "braced-chain"])
def test_a_figure_has_each_mode_once(name: str) -> None:
    found = cf.simulate(name, periods=4)
    ax = found.plot()
    lines = [np.asarray(line.get_ydata()) for line in ax.lines if len(line.get_ydata())]
    steps = max(np.abs(np.diff(y)).max(initial=0.0) for y in lines)
    assert steps < 0.15 * max(map(np.ptp, lines))
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    modes = {mode for mode, _ in found.itinerary} | {found.last[3]}
    named = [label for label in labels if label in modes]
    assert len(named) == len(set(named)) == min(12, len(modes))
    left = len(modes) - len(named)
    assert labels[len(named) :] == ["start", *([f"and {left} more modes"] if left else [])]


@pytest.mark.parametrize("name", ["coulomb", "bouncing-ball", "braced-chain"])
def test_a_file_has_all_of_it(name: str, tmp_path) -> None:  # type: ignore[no-untyped-def]
    found = cf.simulate(name, periods=3)
    cf.save(found, tmp_path / "t.npz")
    again = cf.load(tmp_path / "t.npz")
    assert again.itinerary == found.itinerary
    assert (again.params, again.end) == (found.params, found.end)
    assert again.last[0] == found.last[0] and again.last[3] == found.last[3]
    times = np.linspace(found.begin[0], found.begin[0] + 1.0, 5)
    np.testing.assert_array_equal(again.sample(times), found.sample(times))


@pytest.mark.parametrize("times", [-0.5, 1e9, np.nan, "soon", [[0.0]]])
def test_times_that_are_not_known_are_said(times: object) -> None:
    found = cf.simulate("coulomb", PARAMS, periods=2)
    with pytest.raises(cf.ParameterError, match=r"known from|finite numbers"):
        found.sample(times)  # type: ignore[arg-type]


def test_an_animation_is_a_gif_that_moves(tmp_path) -> None:  # type: ignore[no-untyped-def]
    from PIL import Image

    orbit = cf.find_orbit("coulomb", PARAMS)
    path = orbit.animate(tmp_path / "orbit.gif", frames=8)
    with Image.open(path) as film:
        assert film.n_frames == 8
        frames = []
        for k in range(8):
            film.seek(k)
            frames.append(np.asarray(film.convert("L"), dtype=float))
    assert all(np.abs(a - b).max() > 50 for a, b in pairwise(frames))
    with pytest.raises(cf.ParameterError, match=r"orbit\.gif"):
        orbit.animate(tmp_path / "orbit.png")


def test_models_named_here_are_bundled() -> None:
    assert {"belt", "bouncing-ball", "lugre", "rimless-wheel", "braced-chain"} <= set(model_names())
