"""Units of states and time: another scale of the same model has the same orbits and events."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import contfric as cf
from contfric.base.resources import bundled_dir
from contfric.models.definition import Model
from contfric.models.files import from_data, loaded

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
