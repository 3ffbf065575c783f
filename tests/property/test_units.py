"""Units of states and time: another scale of the same model has the same orbits and events."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import contfric as cf
from contfric.base.resources import bundled_dir
from contfric.models.definition import Model
from contfric.models.reading.describe import describe
from contfric.models.reading.files import from_data, loaded
from tests.rescaled import rescaled

FRICTION = """
name: block
states: [x, v]
parameters: {m: %r, k: %r, F: %r, w: %r, R: %r, R0: %r}
period: 2*pi/w
define: {pull: F*cos(w*t) - k*x}
observables: {load: pull}
surfaces:
  F+: {observable: load, level: R0}
  F-: {observable: load, level: -R0}
  v: {observable: v, level: 0}
field: {x: v, v: (pull - R*sign(v))/m}
modes:
  forward: {in: {v: +}}
  backward: {in: {v: -}}
  stick: {in: {v: 0, F+: -, F-: +}, field: {x: 0, v: 0}}
symmetry: x -> -x, v -> -v, t -> t + T/2
spread: {x: %r, v: %r}
quantities: {energy: integral(R*abs(v))}
"""
#: Models with a reset, a clock, an angle, sliding that is derived, memory, contacts, quantities.
MODELS = ("impact", "thermostat")
OTHERS = (
    *("relay-sliding", "jenkins", "blade-damper"),
    *(
        "integrate-and-fire",
        "rimless-wheel",
        "buck",
        "pendulum",
        "coulomb-yaml",
        "pounding",
        "iwan",
    ),
)


def model_of(data: dict[str, Any], folder: Path) -> Model:
    return from_data(loaded(data, folder))


def proposed(model: Model) -> dict[str, float]:
    """Return the units that the check of a model asks for."""
    texts = [str(f) for f in cf.check_model(model).findings if "Write units: " in str(f)]
    return yaml.safe_load(texts[0].partition("Write units: ")[2]) if texts else {}


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 4))]
)
def test_a_block_in_si_units_has_the_diagram_of_the_paper(seed: int) -> None:
    rng = np.random.default_rng([91, seed])
    natural, length, m = (
        float(10.0 ** (rng.choice([-1, 1]) * rng.uniform(2, 4))) for _ in range(3)
    )
    k, force = m * natural**2, m * natural**2 * length
    sizes = (2.0 * length, length * natural)
    values = (m, k, force, 0.5 * natural, 0.32 * force, 0.4 * force, *sizes)
    data = yaml.safe_load(FRICTION % values)
    units = proposed(model_of(data, Path()))
    assert units
    model = model_of(data | {"units": units}, Path())
    assert not proposed(model)
    found = cf.explore(cf.find_orbit(model), "w", (0.4 * natural, 0.6 * natural))
    start = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    wanted = cf.explore(start, "Omega", (0.4, 0.6))
    assert not found.loose_ends
    assert sorted(b.name for b in found.branches) == sorted(b.name for b in wanted.branches)
    for one, other in zip(found.events, wanted.events, strict=True):
        a, b = one.bifurcation, other.bifurcation
        assert a.label == b.label
        assert a.params["w"] / natural == pytest.approx(b.params["Omega"], abs=2e-10)
        energy = a.orbit.quantity("energy") / (force * length)
        assert energy == pytest.approx(b.orbit.quantity("energy"), rel=1e-8)


@pytest.mark.parametrize(
    "seed",
    [12, 15, *(pytest.param(s, marks=pytest.mark.slow) for s in (1, 2, 3, 4, 9, 16, 17, 23))],
)
def test_a_block_without_units_has_the_same_events(seed: int) -> None:
    """Lengths, masses and times of other sizes: what is small is so against the orbit's own numbers."""
    rng = np.random.default_rng([92, seed])
    natural, length, m = (float(10.0 ** rng.uniform(-w, w)) for w in (2, 3, 3))
    k, force = m * natural**2, m * natural**2 * length
    sizes = (2.0 * length, length * natural)
    values = (m, k, force, 0.5 * natural, 0.32 * force, 0.4 * force, *sizes)
    model = model_of(yaml.safe_load(FRICTION % values), Path())
    found = cf.explore(cf.find_orbit(model), "w", (0.4 * natural, 0.6 * natural))
    start = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    wanted = cf.explore(start, "Omega", (0.4, 0.6))
    assert not found.loose_ends and len(found.branches) == len(wanted.branches)
    assert all(balance.holds for balance in found.verify(0).balances)
    for one, other in zip(found.events, wanted.events, strict=True):
        a, b = one.bifurcation, other.bifurcation
        assert a.label == b.label
        assert a.params["w"] / natural == pytest.approx(b.params["Omega"], abs=1e-8)


@pytest.mark.parametrize(
    "name", [*MODELS, *(pytest.param(name, marks=pytest.mark.slow) for name in OTHERS)]
)
def test_units_change_numbers_only(name: str) -> None:
    folder = bundled_dir("models")
    data = yaml.safe_load((folder / f"{name}.yaml").read_text(encoding="utf-8"))
    data.pop("units", None)
    plain = model_of(data, folder)
    rng = np.random.default_rng(len(name))
    given = data["states"] if "states" in data else data["coordinates"]
    names = [s for s in given if s not in data.get("angles", ())]
    units = {s: float(rng.uniform(0.3, 3.0)) for s in [*names, "t"]}
    states = [s for s in plain.states if s != "clock"]
    data["spread"] = {**dict.fromkeys(states, 1), **data.get("spread", {})}  # the same start
    model = model_of(data | {"units": units}, folder)
    assert model.closed_form == plain.closed_form
    whole = dict(model.units)
    scale = np.array([whole["t"], *(whole.get(s, 1.0) for s in model.states)])
    one, other = cf.find_orbit(plain), cf.find_orbit(model)
    assert other.signature == one.signature
    assert other.period * whole["t"] == pytest.approx(one.period, rel=1e-9)
    size = 1.0 + np.max(np.abs(one.joints))
    a, b = (np.sort(np.abs(joints[:, 1:]), axis=0) for joints in (other.joints * scale, one.joints))
    assert np.max(np.abs(a - b)) < 1e-7 * size  # from any joint on, and up to mirror
    assert np.sort_complex(other.multipliers) == pytest.approx(
        np.sort_complex(one.multipliers), abs=1e-6
    )
    for quantity, _ in plain.quantities:
        assert other.quantity(quantity) == pytest.approx(one.quantity(quantity), rel=1e-7)


def test_units_that_are_far_off_are_proposed_anew() -> None:
    """What is given is in the line as well: it is to be replaced, whatever its size."""
    pad = {"kind": "friction", "velocity": "v1", "kinetic": "R"}
    model = cf.Mechanism(
        [2.0],
        [0.5],
        [8.0],
        contacts={"pad": pad},
        force={"q1": "F*cos(w*t)"},
        parameters={"w": 2.1, "F": 2.0, "R": 0.1},
        period="2*pi/w",
        units={"q1": 1e-3, "t": 1.0},
    )
    assert 0.1 < proposed(model)["q1"] < 10.0


#: Models in closed form, the parameter that varies, and its range.
EXPLORED = {
    "coulomb-yaml": ("Omega", 0.4, 0.6, {"Omega": 0.5, "S": 0.32, "S0": 0.4}),
    "impact": ("w", 0.7, 1.1, {"w": 0.9}),
    "walls": ("w", 1.7, 2.6, {"w": 2.2}),
    "soft_stops": ("omega", 0.6, 0.95, {}),
    "bilinear": ("omega", 0.66, 0.95, {}),
    "jenkins": ("W", 0.6, 1.1, {}),
    "pounding": ("w", 0.75, 0.85, {}),
    "two-blocks": ("vb", 0.25, 0.5, {}),
    "belt": ("vb", 0.05, 1.5, {}),
    "popp": ("omega", 0.6, 1.2, {}),
    "relay": ("zeta", 0.1, 0.5, {}),
    "storeys": ("W", 0.58, 0.62, {}),
    "blade-damper": ("W", 0.5, 0.9, {}),
    "iwan": ("W", 0.8, 1.2, {}),
}
QUICK = ("bilinear", "impact", "two-blocks")


def explored(model: Model, name: str, units: dict[str, float]) -> Any:
    vary, low, high, params = EXPLORED[name]
    given = {n: v / units.get(n, 1.0) for n, v in params.items()}
    unit = units.get(vary, 1.0)
    return cf.explore(cf.find_orbit(model, given), vary, (low / unit, high / unit))


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in EXPLORED],
)
def test_a_model_in_any_units_has_the_same_diagram(name: str, seed: int) -> None:
    """States, time and parameters in random units between 1e-6 and 1e6, with units that are chosen."""
    rng = np.random.default_rng([93, seed, len(name)])
    folder = bundled_dir("models")
    if not (folder / f"{name}.yaml").is_file():
        folder = Path(__file__).parents[1] / "models"
    data = yaml.safe_load((folder / f"{name}.yaml").read_text(encoding="utf-8"))
    plain = describe(loaded(data, folder))
    written = json.loads(plain.text)
    units = {n: float(10.0 ** rng.uniform(-6.0, 6.0)) for n in [*written["states"], "t"]}
    # exact, so that a limit of equal parameters (S0 >= S) holds
    units |= {n: float(2.0 ** rng.integers(-20, 20)) for n in written["parameters"]}
    other = from_data(rescaled(written, units) | {"units": "auto"})
    wanted, found = (
        explored(from_data(loaded(data, folder)), name, {}),
        explored(other, name, units),
    )
    vary = EXPLORED[name][0]
    assert labels(found) == labels(wanted)
    assert len(found.loose_ends) == len(wanted.loose_ends)
    for a, b in zip(sorted_events(found, vary), sorted_events(wanted, vary), strict=True):
        assert a.label == b.label
        assert a.params[vary] * units[vary] == pytest.approx(b.params[vary], rel=1e-8)
        one, two = (np.sort_complex(e.orbit.multipliers) for e in (a, b))
        if np.abs(two).max() < 1e3:  # at a grazing they are infinite
            assert one == pytest.approx(two, rel=1e-4, abs=1e-4)


def labels(diagram: Any) -> list[list[str]]:
    """Return the labels of the events of each branch, in an order of their own."""
    return sorted(sorted(b.label for b in branch.bifurcations) for branch in diagram.branches)


def sorted_events(diagram: Any, vary: str) -> list[Any]:
    events = [event.bifurcation for event in diagram.events]
    return sorted(events, key=lambda event: (event.params[vary], event.label))


def test_units_are_chosen_for_structures_and_classes_alike() -> None:
    """Coordinates have one unit, that of the largest; a pad of 1e-3 with a spring of 1e9 is of order 1."""
    pad = {"kind": "friction", "velocity": "v1", "kinetic": "R"}
    data = {"w": 2.1e4, "F": 2.0e6, "R": 0.1e6, "k": 1e9}
    force = {"q1": "F*cos(w*t)"}
    model = cf.Mechanism(
        [2.0, 1.0],
        [0.5, 0.5],
        [["2*k", "-k"], ["-k", "k"]],
        contacts={"pad": pad},
        force=force,
        parameters=data,
        period="2*pi/w",
        units="auto",
    )
    units = dict(model.units)
    assert units["q1"] == units["q2"] and units["v1"] == units["v2"]
    assert units["t"] == pytest.approx(1.0 / 2.1e4, rel=0.01)
    orbit = cf.find_orbit(model)
    assert 0.01 < np.abs(orbit.ends[:, 1:]).max() < 100.0


def test_units_that_nothing_tells_are_an_error() -> None:
    free = {"x": "v", "v": "-z", "z": "0*x"}
    data = {"name": "free", "states": [*free], "parameters": {}, "autonomous": True, "field": free}
    data["units"] = "auto"
    with pytest.raises(cf.ModelError, match="nothing tells the size of x"):
        model_of(data, Path())


def test_an_orbit_far_from_1_is_warned_of(caplog: pytest.LogCaptureFixture) -> None:
    sizes = (1.5e-6, 1.5e-6)
    data = yaml.safe_load(FRICTION % (1.0, 1.0, 1.5e-6, 0.5, 4.8e-7, 6.2e-7, *sizes))
    cf.find_orbit(model_of(data, Path()))
    assert "units: auto" in caplog.text
    caplog.clear()
    cf.find_orbit(model_of(data | {"units": "auto"}, Path()))
    assert not caplog.text
