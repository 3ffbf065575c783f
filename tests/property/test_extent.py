"""How far orbits reach, what their samples are called, and where motion starts: whatever the model."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest
from typed import typed

import contfric as cf
from contfric.simulation.starts import displaced, start_of

MODELS = Path(__file__).parents[1] / "models"
#: Samples of a period, and what they may miss of an extremum: acceleration times the square of their spacing.
SAMPLES, MISSED = 2000, 1e-4


SWITCHED = {"A": 0.75}


@cache
def found_orbit(model: str, params: tuple[tuple[str, float], ...]) -> cf.Orbit:
    state = [-1.0, 0.0, 0.2] if model == "switched.yaml" else None
    return cf.find_orbit(MODELS / model if "." in model else model, dict(params), state=state)


def random_params(seed: int) -> dict[str, float]:
    rng = np.random.default_rng(seed)
    s = float(rng.uniform(0.05, 0.5))
    return {
        "Omega": float(rng.uniform(0.3, 0.9)),
        "S": s,
        "S0": s * float(rng.uniform(1.05, 1.5)),
        "h": float(rng.uniform(-0.2, 0.2)),
        "zeta": 0.02,
    }


@pytest.mark.parametrize(
    "model, params",
    [
        *(("coulomb", random_params(seed)) for seed in range(4)),
        ("bilinear.yaml", {"omega": 0.8}),
        pytest.param("crossing.yaml", {"mu": 0.4, "q": -1.0}, marks=pytest.mark.slow),
        pytest.param("switched.yaml", SWITCHED, marks=pytest.mark.slow),
        pytest.param("belt", {}, marks=pytest.mark.slow),
        pytest.param("impact", {}, marks=pytest.mark.slow),
    ],
)
def test_extrema_are_those_of_dense_samples(model: str, params: dict[str, float]) -> None:
    orbit = found_orbit(model, tuple(params.items()))
    x = orbit.trajectory(SAMPLES)[1][:, 0]
    assert x.max() - 1e-10 < orbit.x_max < x.max() + MISSED
    assert x.min() - MISSED < orbit.x_min < x.min() + 1e-10
    assert orbit.asymmetry == abs(orbit.x_max + orbit.x_min) / (orbit.x_max - orbit.x_min)
    name = next(n for n in orbit.params if n != "Omega")
    value = orbit.params[name]
    branch = cf.continue_orbit(orbit, name, (value - 0.01, value + 0.01), max_points=6)
    for high, low, point in zip(branch.x_max, branch.x_min, branch, strict=True):
        assert (high, low) == (point.x_max, point.x_min)


def test_a_model_that_names_no_stop_is_measured() -> None:
    orbit = found_orbit("switched.yaml", tuple(SWITCHED.items()))
    model = replace(orbit.model, stop_surface="")
    bare = replace(orbit, system=replace(orbit.system, model=model))
    assert (bare.x_max, bare.x_min) == (orbit.x_max, orbit.x_min)
    assert np.allclose(bare.stops, orbit.stops, atol=1e-10)
    assert {bare.x_max, bare.x_min} <= set(bare.stops)


def text_of(field: str, surfaces: str, modes: str) -> str:
    return (
        "name: plain\nstates: [x, v]\nparameters: {w: 0.8, g: 1.26}\nperiod: 2*pi/w\n"
        f"surfaces: {surfaces}\nfield: {field}\nmodes: {modes}\n"
    )


@pytest.mark.parametrize(
    "field, surfaces, modes, stop, displacement",
    [
        # x' is no surface; it is one that cuts; one that does not; a constant rate; another state's
        (
            "{x: v + x/9, v: -x}",
            "{s: {observable: v}}",
            "{a: {in: {s: +}}, b: {in: {s: -}}}",
            "",
            "x",
        ),
        ("{x: v, v: -x}", "{s: {observable: v}}", "{a: {in: {s: +}}, b: {in: {s: -}}}", "s", "x"),
        (
            "{x: v, v: -x - g*sign(v)}",
            "{s: {observable: v}}",
            "{a: {in: {s: +}}, b: {in: {s: -}}}",
            "s",
            "",
        ),
        (
            "{x: v, v: -x}",
            "{s: {observable: v}, c: {observable: x, level: g}}",
            "{a: {in: {c: +}}, b: {in: {c: -}}}",
            "s",
            "x",
        ),
        (
            "{x: v, v: -x}",
            "{s: {observable: v}}",
            "{a: {in: {s: +}}, b: {in: {s: -}}, c: {in: {s: 0}, field: {x: 0, v: 0}}}",
            "s",
            "",
        ),
        (
            "{x: v, v: -x}",
            "{c: {observable: v, level: g}}",
            "{a: {in: {c: +}}, b: {in: {c: -}}, d: {in: {c: 0}, field: {x: g, v: 0}}}",
            "",
            "x",
        ),
    ],
)
def test_where_extrema_can_be_is_derived(
    field: str, surfaces: str, modes: str, stop: str, displacement: str, tmp_path: Path
) -> None:
    model = typed(tmp_path, text_of(field, surfaces, modes))
    assert (model.stop_surface, model.displacement) == (stop, displacement)
    if displacement:
        assert displacement in [o.name for o in model.observables]
        assert displacement not in [s.observable for s in model.surfaces] or "c" in surfaces


@pytest.mark.parametrize("seed", range(6))
def test_every_sample_has_the_domain_of_its_segment(seed: int) -> None:
    orbit = cf.find_orbit("coulomb", random_params(seed))
    times, _, names = orbit.trajectory(4000)
    walked = [name for name, _ in groupby(names)]
    # a domain without a sample of its own is passed within less than the spacing of samples
    segments = [s for s in orbit.signature.segments if s in walked]
    assert walked == segments, (walked, orbit.signature.segments)
    table = orbit.to_dataframe(40)
    assert table["domain"][0] == orbit.signature.segments[0]
    modes = {d.name: d.mode for d in orbit.model.domains}
    starts = np.searchsorted(times, orbit.cycle[:, 0], side="right") - 1
    assert [modes[names[k]] for k in starts] == [mode for mode, _ in orbit.itinerary]


def test_the_first_sample_of_1a_is_beyond_the_limit_it_was_released_at() -> None:
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    assert orbit.trajectory()[2][0] == "x-v+" == orbit.signature.segments[0]


SOFT_STOP = """\
name: softstop
states: [x, v]
parameters: {omega: 0.8, k: 29.0, gap: 1.26, A: 1.0}
period: 2*pi/omega
surfaces:
  wall: {observable: x, level: gap}
  v: {observable: v, level: 0}
field: {x: v, v: "-x + A*cos(omega*t) - where(x > gap, k*(x - gap) + 0.2, 0)"}
modes:
  in+: {in: {wall: +, v: +}}
  in-: {in: {wall: +, v: -}}
  out+: {in: {wall: -, v: +}}
  out-: {in: {wall: -, v: -}}
"""


def test_a_start_is_found_where_the_first_one_is_in_no_domain(tmp_path: Path) -> None:
    model = typed(tmp_path, SOFT_STOP)
    vector = model.vector({})
    mode, _ = start_of(model, 0.0, np.array([1.0, 0.0]), vector, None)
    assert model.modes[mode].name == "out-"  # at rest in equilibrium, until the force falls
    mode, _ = start_of(model, 0.0, displaced(model, vector), vector, None)
    assert 0 <= mode < len(model.modes)
    # one that lies away from the axis of displacements is drawn
    apart = replace(model, spread=lambda _: np.array([0.0, 1.0]))
    y = displaced(replace(apart, domains=model.domains[3:]), vector)
    assert y[1] < 0.0
    # and where there is none, it is said what was tried
    nowhere = replace(model, domains=(), spread=lambda _: np.array([0.5, 0.5]))
    with pytest.raises(cf.ParameterError, match=r"1000 states .*-0\.5 <= x <= 0\.5.*state="):
        displaced(nowhere, vector)
