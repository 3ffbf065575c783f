"""Sweeps: their points against solved orbits and simulations, and all that a result has to be able to do."""

from __future__ import annotations

import csv
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.chaos.compute import ascending
from contfric.study.result import RunStatus

GRID = np.linspace(0.3, 0.6, 150)


def bits(sweep: cf.Sweep) -> bytes:
    arrays = (a for run in sweep.runs.values() for a in vars(run).values())
    return b"".join(a.tobytes() for a in arrays)


@pytest.mark.parametrize("seed", range(3))
def test_points_are_those_of_solved_orbits(seed: int) -> None:
    """On a stable branch: stops, strobes at a random phase, releases, a surface; up and down."""
    draw = np.random.default_rng(seed)
    values, fixed = np.sort(draw.uniform(0.3, 0.46, 5)), {"S": 0.32, "S0": 0.4}
    orbits = [cf.find_orbit("coulomb", {"Omega": omega, **fixed}) for omega in values]
    for section in ("stops", float(draw.uniform(0.0, 1.0)), "releases", "F+"):
        sweep = cf.sweep("coulomb", "Omega", values, fixed, section=section)
        for run in sweep.runs.values():
            for i, orbit in enumerate(orbits):
                assert run.periods[i] == orbit.periods
                found = np.sort(run.states[run.index == i], axis=0)
                np.testing.assert_allclose(found, _on(orbit, section), rtol=0.0, atol=1e-10)


def _on(orbit: cf.Orbit, section: str | float) -> np.ndarray[Any, Any]:
    """The points of a solved orbit, from its joints."""
    if isinstance(section, float):
        return orbit.state(section * orbit.period)[None]
    chosen = [
        (section == "stops" and exit_ == "v")
        or (section == "releases" and mode == "stick")
        or (section == "F+" and exit_ == "F+")
        for mode, exit_ in orbit.itinerary
    ]
    found = list(orbit.ends[np.array(chosen), 1:])
    if section == "F+":  # motion is not cut there while it slides
        found += _crossings(orbit)
    return np.sort(np.array(found), axis=0)


def _crossings(orbit: cf.Orbit) -> list[np.ndarray[Any, Any]]:
    """States at which the load takes the static limit while the mass slides, by bisection."""

    def load(t: float) -> float:
        force = np.cos(orbit.params["Omega"] * t)
        return float(orbit.state(t)[0] - force - orbit.params["S0"])

    found = []
    for i, (mode, _) in enumerate(orbit.itinerary):
        if mode == "stick":
            continue
        # inside of the segment: at its ends the load may stand at the limit to rounding
        start, end = orbit.cycle[i, 0] + 1e-6, orbit.ends[i, 0] - 1e-6
        times = np.linspace(start, end, 400)
        values = np.array([load(t) for t in times])
        for k in np.flatnonzero(values[:-1] * values[1:] < 0.0):
            low, high = times[k], times[k + 1]
            for _ in range(60):  # to the last digit
                t = 0.5 * (low + high)
                low, high = (t, high) if load(t) * values[k] > 0.0 else (low, t)
            found.append(orbit.state(0.5 * (low + high)))
    return found


def test_points_are_those_of_a_simulation() -> None:
    """One chaotic value: every stop after the transient, to the last bit."""
    params = {"Omega": 0.35, "S": 0.05, "S0": 0.4}
    sweep = cf.sweep("coulomb", "Omega", [0.35], params, direction="up", periods=20, transient=10)
    found = cf.simulate("coulomb", params, periods=30)
    assert sweep.counts() == {cf.Outcome.APERIODIC: 1}
    v = [s.name for s in found.model.surfaces].index("v")
    behind = np.flatnonzero(found.cycles >= 10)[0]  # the event that ends the transient
    stop = (found.exits == v) & (np.arange(len(found)) > behind)
    np.testing.assert_array_equal(sweep.up.states, found.states[stop])
    np.testing.assert_array_equal(sweep.up.times, found.times[stop])


def test_the_state_is_carried_over() -> None:
    """Between a fold and an event both branches are stable: which is met depends on the direction."""
    sweep = cf.sweep("coulomb", "Omega", np.linspace(0.3, 0.7, 201), {"S": 0.32, "S0": 0.4})
    low, high = (
        r.states[r.index == np.argmin(np.abs(sweep.values - 0.541)), 0] for r in sweep.runs.values()
    )
    assert len(sweep.up) and len(sweep.down)
    assert sorted(np.abs(low)) != pytest.approx(sorted(np.abs(high)), abs=1e-3)


def test_models_without_excitation_and_with_impacts() -> None:
    belt = cf.load_model("belt")
    name = belt.parameter_names[0]
    around = belt.defaults[name] * np.linspace(1.0, 1.01, 3)
    sweep = cf.sweep(belt, name, around, section="stops", periods=300, transient=300)
    orbit = cf.find_orbit(belt, {name: float(around[1])})
    found = np.sort(sweep.up.states[sweep.up.index == 1, 0])
    np.testing.assert_allclose(found, np.sort(orbit.stops), atol=1e-9)
    with pytest.raises(cf.ParameterError, match="no period of excitation"):
        cf.sweep(belt, name, around, section=0.5)


def test_impacts() -> None:
    model = cf.load_model("impact")
    orbit = cf.find_orbit(model)
    name = model.parameter_names[0]
    at = [model.defaults[name]]
    (wall,) = model.reset_by_surface
    sweep = cf.sweep(model, name, at, section=wall, transient=500.0)
    hits = [k for k, (_, exit_) in enumerate(orbit.itinerary) if exit_ == wall]
    np.testing.assert_allclose(
        np.sort(sweep.up.states, axis=0), np.sort(orbit.ends[hits, 1:], axis=0), atol=1e-9
    )


def test_a_sense_halves_the_crossings() -> None:
    options: Any = {"direction": "up", "section": "F+"}
    both, up, down = (
        cf.sweep("coulomb", "Omega", [0.4], sense=s, **options).up.states[:, 0].tolist()
        for s in ("either", "rising", "falling")
    )
    assert up and down and sorted(both) == sorted([*up, *down])


def test_the_same_bits_in_threads_and_without_workers() -> None:
    """In processes: test_workers.py."""
    expected = bits(cf.sweep("coulomb", "Omega", GRID))
    with ThreadPoolExecutor(1) as pool:
        assert bits(cf.sweep("coulomb", "Omega", GRID, executor=pool)) == expected
    with ThreadPoolExecutor(1) as pool:
        pool.shutdown()  # takes nothing: all is computed here
        assert bits(cf.sweep("coulomb", "Omega", GRID, executor=pool)) == expected


def test_interrupted_and_gone_on(tmp_path: Path) -> None:
    def stop(text: str) -> None:
        if "%" in text:
            raise KeyboardInterrupt

    part = cf.sweep("coulomb", "Omega", GRID, folder=tmp_path, progress=stop)
    assert not part.complete and part.counts()[cf.Outcome.PERIODIC] > 0
    said: list[str] = []
    whole = cf.sweep("coulomb", "Omega", GRID, folder=tmp_path, progress=said.append)
    assert whole.complete and bits(whole) == bits(cf.sweep("coulomb", "Omega", GRID))
    assert len([text for text in said if "of 6 tiles" in text]) < 6
    other = cf.sweep("coulomb", "Omega", GRID, folder=tmp_path, section=0.5)
    assert bits(other) == bits(cf.sweep("coulomb", "Omega", GRID, section=0.5))


def test_saved_table_and_drawn(tmp_path: Path) -> None:
    sweep = cf.sweep("coulomb", "Omega", np.linspace(0.4, 0.6, 21))
    cf.save(sweep, tmp_path / "sweep.npz")
    again = cf.load(tmp_path / "sweep.npz")
    assert isinstance(again, cf.Sweep) and bits(again) == bits(sweep)
    assert (again.section, again.parameter, again.params) == ("stops", "Omega", sweep.params)
    table = sweep.to_dataframe()
    assert len(table) == len(sweep.up) + len(sweep.down)
    assert set(table["direction"]) == {"up", "down"}
    ax = sweep.plot(state="v")
    assert len(ax.lines) == 2 and len(ax.lines[0].get_xdata()) == len(sweep.up)


@pytest.mark.parametrize(
    "values", [[0.4, 0.6], (0.4, 0.5, 0.6), (1, 2, 3), [1, 10, 100], [0.4, 1.5, 2.0]]
)
def test_few_values_are_values(values: Any) -> None:
    assert ascending("Omega", values).tolist() == list(values)


def test_overlay() -> None:
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    diagram = cf.explore(orbit, "Omega", (0.45, 0.55))
    sweep = cf.sweep("coulomb", "Omega", np.linspace(0.45, 0.55, 11), orbit.params)
    bare = diagram.plot(row="x_max")
    ax = diagram.plot(row="x_max", overlay=sweep)
    assert len(ax.lines) == len(bare.lines) + 2
    names = [[text.get_text() for text in a.get_legend().get_texts()] for a in (ax, bare)]
    assert set(names[0]) - set(names[1]) == {"simulated (sweep)"}
    x, y = (np.asarray(d) for d in ax.lines[1].get_data())
    assert (x.min(), x.max()) == pytest.approx((0.45, 0.55))
    solved = cf.find_orbit("coulomb", {**orbit.params, "Omega": float(x[0])})
    assert y[0] == pytest.approx(solved.x_max, abs=1e-10)
    other = cf.sweep("coulomb", "S", [0.1, 0.2])
    with pytest.raises(cf.ParameterError, match="along 'S'"):
        diagram.plot(overlay=other)
    strobed = cf.sweep("coulomb", "Omega", [0.45, 0.5], section=0.0)
    for row in ("psi", "stops"):  # where the velocity vanishes: a phase is anywhere else
        with pytest.raises(cf.ParameterError, match=r"section 0\.0: sweep.*section='stops'"):
            diagram.plot(row=row, overlay=strobed)
    released = cf.sweep("coulomb", "Omega", [0.45, 0.5], orbit.params, section="releases")
    diagram.plot(row="stops", overlay=released)
    with pytest.raises(cf.ParameterError, match="draw row='stops'"):
        diagram.plot(row="psi", overlay=released)
    loaded = cf.sweep("coulomb", "Omega", [0.45, 0.5], orbit.params, section="F+")
    with pytest.raises(cf.ParameterError, match=r"section 'F\+': sweep.*section='stops'"):
        diagram.plot(row="stops", overlay=loaded)


@pytest.mark.parametrize(
    ("model", "section", "drawn"), [("impact", "wall", 2), ("relay", "high", 0)]
)
def test_points_of_an_overlay_are_stops_or_impacts(model: str, section: str, drawn: int) -> None:
    """A relay switches where its solution does not turn."""
    name = {"impact": "w", "relay": "h"}[model]
    orbit = cf.find_orbit(model)
    at = orbit.params[name]
    diagram = cf.explore(orbit, name, (0.98 * at, 1.02 * at), max_branches=1)
    sweep = cf.sweep(model, name, [0.99 * at, 1.01 * at], section=section)
    count = len(diagram.plot(row="stops").lines)
    if drawn:
        assert len(diagram.plot(row="stops", overlay=sweep).lines) == count + drawn
    else:
        with pytest.raises(cf.ParameterError, match="draw the sweep by itself"):
            diagram.plot(row="stops", overlay=sweep)


@pytest.mark.parametrize(
    ("model", "section"),
    [("buck", "tick"), ("thermostat", "hot"), ("integrate-and-fire", 0.0), ("impact", "stops")],
)
def test_every_model_has_a_section_where_none_is_named(model: str, section: str | float) -> None:
    """A converter whose clock is a state has no phase and no stops: it was refused."""
    name, value = next(iter(cf.load_model(model).defaults.items()))
    swept = cf.sweep(model, name, [value, 1.001 * value], both=False)
    named = cf.sweep(model, name, [value, 1.001 * value], section=section, both=False)
    assert swept.section == section
    assert len(swept.up) > 0
    np.testing.assert_array_equal(swept.up.states, named.up.states)
    if section != "stops":
        with pytest.raises(cf.ParameterError, match="names no surface v = 0"):
            list(swept.quantity("x_max"))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"parameter": "Omga"}, "did you mean 'Omega'"),
        ({"values": [0.5, 0.4]}, "ascending"),
        ({"values": []}, "ascending"),
        ({"values": (0.4, 0.6)}, r"looks like a range: write numpy.linspace\(0.4, 0.6, 200\)"),
        ({"values": (0.4, 0.6, 2000)}, r"numpy.linspace\(0.4, 0.6, 2000\)"),
        ({"values": [0.4, 0.6, 30]}, "looks like a range"),
        ({"direction": "sideways"}, "direction is one of"),
        ({"section": "F"}, "no section 'F'.* Valid: stops, releases, F[+], F-, v, or a phase"),
        ({"section": 1.0}, "0 <= phase < 1"),
        ({"section": True}, "a section is"),
        ({"sense": "rising"}, "needs a surface"),
        ({"periods": 0}, "> 0"),
        ({"periods": float("nan")}, "finite"),
        ({"state": [1.0]}, "2 finite numbers"),
        ({"executor": 3}, "Executor"),
        ({"values": [-2.0, -1.0]}, "Omega > 0"),
    ],
)
def test_bad_input(options: dict[str, Any], message: str) -> None:
    arguments = {"parameter": "Omega", "values": [0.4, 0.5], **options}
    with pytest.raises(cf.ParameterError, match=message) as caught:
        cf.sweep("coulomb", arguments.pop("parameter"), arguments.pop("values"), **arguments)
    assert "\n" not in str(caught.value)


def test_values_outside_of_the_model_are_named() -> None:
    sweep = cf.sweep("coulomb", "S", [0.2, 0.3, 0.5], {"S0": 0.4})
    assert sweep.up.outcomes[2] == cf.Outcome.OUTSIDE.code and sweep.complete


HEAD = "model: coulomb\nparams: {S: 0.32, S0: 0.4}\n"
SWEEP = "sweep: {parameter: Omega, values: [0.3, 0.6, 150]}\n"


def test_study(write, tmp_path: Path) -> None:
    path = write(HEAD + SWEEP + "figures: [{kind: sweep}]\n")
    result = cf.run_study(path, tmp_path / "out")
    assert {f.name for f in result.files} == {"sweep.csv", "sweep.npz", "sweep.png", "run.json"}
    direct = cf.sweep("coulomb", "Omega", GRID, {"S": 0.32, "S0": 0.4})
    assert result.sweep is not None and bits(result.sweep) == bits(direct)
    with (tmp_path / "out" / "sweep.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(direct.up) + len(direct.down)
    assert float(rows[3]["x"]) == direct.up.states[3, 0]
    assert result.info["sweep"]["outcomes"]["periodic"] > 0


def test_study_interrupted_goes_on(write, tmp_path: Path) -> None:
    path = write(HEAD + SWEEP)

    def stop(text: str) -> None:
        if "%" in text:
            raise KeyboardInterrupt

    first = cf.run_study(path, tmp_path / "out", progress=stop)
    assert first.status is RunStatus.INTERRUPTED and first.goes_on
    second = cf.run_study(path, tmp_path / "out")
    assert second.status is RunStatus.DONE and second.sweep is not None
    assert not (tmp_path / "out" / "checkpoint").exists()
    assert bits(second.sweep) == bits(cf.sweep("coulomb", "Omega", GRID, {"S": 0.32, "S0": 0.4}))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sweep: {parameter: Omga, values: [0.3, 0.6, 5]}\n", "scene.yaml:3: .*Omega"),
        ("sweep: {parameter: Omega, values: [0.6, 0.3, 5]}\n", "scene.yaml:3: .*low < high"),
        (SWEEP.replace("}", ", section: F}"), "scene.yaml:3: .*no section 'F'"),
        (SWEEP.replace("}", ", state: [1]}"), "scene.yaml:3: .*2 numbers"),
        ("figures: [{kind: sweep}]\n", "scene.yaml:3: .*needs 'sweep'"),
    ],
)
def test_bad_study(write, tmp_path: Path, text: str, message: str) -> None:
    path = write(HEAD + text)
    with pytest.raises(cf.StudyError, match=message):
        cf.run_study(path, tmp_path / "out")


@pytest.mark.parametrize("both", ["yes", 1, 0.0])
def test_both_is_true_or_false(both: Any) -> None:
    with pytest.raises(cf.ParameterError, match="both is True or False, got"):
        cf.sweep("coulomb", "Omega", [0.4, 0.5], both=both)


def test_both_is_direction_in_one_word() -> None:
    values, fixed = GRID[:6], {"S": 0.32, "S0": 0.4}
    for both, direction in ((True, "both"), (False, "up")):
        one = cf.sweep("coulomb", "Omega", values, fixed, both=both)
        assert bits(one) == bits(cf.sweep("coulomb", "Omega", values, fixed, direction=direction))


SPIRAL = """
name: spiral
states: [x, v]
parameters: {d: 0.01, w: 1.5, F: 1.0}
period: 2*pi
surfaces: {turn: {observable: v}}
field: {x: v, v: "F*cos(t) - 2*d*v - (w**2 + d**2)*x"}
modes: {up: {in: {turn: +}}, down: {in: {turn: -}}}
"""
NEURON = """
name: neuron
states: [V]
parameters: {I: 1.2, A: 0.3, W: 2.4}
period: 2*pi/W
surfaces: {threshold: {observable: V, level: 1}}
modes: {rest: {in: {threshold: -}, field: {V: -V + I + A*cos(W*t)}}}
resets: {threshold: {V: 0}}
"""


@pytest.mark.parametrize("section", ["stops", 0.37])
@pytest.mark.parametrize("w", [1.5, 2.5, 0.5])
def test_the_fewest_periods_are_found(section: str | float, w: float, tmp_path: Path) -> None:
    """Where solutions come from two sides in turn, they are near to their state of two periods ago first.

    The solution of a linear oscillator has one period; its multipliers are exp(2 pi (-d +- i w)).
    """
    path = tmp_path / "spiral.yaml"
    path.write_text(SPIRAL)
    values = np.sort(np.random.default_rng(4).uniform(0.005, 0.05, 25))
    found = cf.sweep(path, "d", values, {"w": w}, section=section, periods=1900, both=False).up
    assert set(found.periods.tolist()) == {1}
    per_period = 2 if section == "stops" else 1
    assert np.bincount(found.index).tolist() == [per_period] * len(values)
    if section != "stops":
        t = 0.37 * 2 * np.pi
        exact = ((w**2 + values**2 - 1) * np.cos(t) + 2 * values * np.sin(t)) / (
            (w**2 + values**2 - 1) ** 2 + 4 * values**2
        )
        np.testing.assert_allclose(found.states[:, 0], exact, atol=1e-9)


@pytest.mark.parametrize("section", ["threshold", 0.2])
def test_solutions_of_several_periods_keep_them(section: str | float, tmp_path: Path) -> None:
    """At the threshold all states are the same; the times between them are not."""
    path = tmp_path / "neuron.yaml"
    path.write_text(NEURON)
    values = np.linspace(2.0, 3.0, 21)
    found = cf.sweep(path, "W", values, section=section, periods=600, both=False).up
    checked = 0
    for value, periods in zip(values, found.periods, strict=True):
        if periods > 1:
            orbit = cf.find_orbit(path, {"W": value})
            assert orbit.periods == periods
            checked += 1
    assert checked > 2
