"""Multipliers where a surface is only touched: those of the orbit that touches nothing, or their limit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typed import typed

import contfric as cf

VAN_DER_POL = """
name: van-der-pol-with-a-spring
states: [x, v]
parameters: {mu: 0.7, d: 1.9, ks: 3.0}
autonomous: true
constraints: [ks > 0]
surfaces: {stop: {observable: x, level: d}, v: {observable: v}}
modes:
  free: {in: {stop: -, v: +}, field: {x: v, v: mu*(1 - x**2)*v - x}}
  back: {in: {stop: -, v: -}, field: {x: v, v: mu*(1 - x**2)*v - x}}
  pressed: {in: {stop: +}, field: {x: v, v: mu*(1 - x**2)*v - x - ks*(x - d)}}
spread: {x: 2, v: 2}
"""


def random_mass_on_a_stop(seed: int, size: int) -> tuple[cf.Model, float]:
    """Return masses of which the last meets a spring, and the amplitude of its solution without."""
    draw = np.random.default_rng([seed, size])
    mass = np.diag(draw.uniform(0.5, 2.0, size))
    roots = draw.normal(size=(size, size))
    stiffness = roots @ roots.T + np.eye(size)
    damping = 0.1 * stiffness + 0.05 * mass
    w = float(draw.uniform(0.5, 1.8))
    wave = np.linalg.solve(stiffness - w**2 * mass + 1j * w * damping, np.eye(size)[0])
    model = cf.Mechanism(
        mass,
        damping,
        stiffness,
        contacts={
            "stop": {"kind": "spring", "gap": f"d - q{size}", "stiffness": draw.uniform(0.5, 9.0)}
        },
        force={"q1": "cos(W*t)"},
        parameters={"W": w, "d": 1.1 * abs(wave[-1])},
        period="2*pi/W",
        name=f"stop-{seed}-{size}",
    )
    return model, float(abs(wave[-1]))


def random_beam_at_a_stop(seed: int, size: int) -> tuple[cf.Model, float]:
    """Return lightly damped modes whose tip just does not meet a spring, and its amplitude."""
    draw = np.random.default_rng([seed, size, 7])
    frequencies = np.cumsum(2.0 * draw.uniform(0.7, 1.3, size) * np.arange(1, size + 1))
    frequencies /= frequencies[0]
    shape = draw.uniform(0.8, 2.0, size) * (-1.0) ** np.arange(size)
    damping = 2.0 * draw.uniform(0.005, 0.03) * np.diag(frequencies)
    stiffness = np.diag(frequencies**2)
    w = float(draw.uniform(0.96, 1.04) * frequencies[1])
    wave = np.linalg.solve(stiffness - w**2 * np.eye(size) + 1j * w * damping, 0.6 * shape)
    amplitude = float(abs(shape @ wave))
    modes = [(f"q{i + 1}", repr(share)) for i, share in enumerate(shape.tolist())]
    tip = " + ".join(f"({share})*{name}" for name, share in modes)
    stop = {"kind": "spring", "gap": f"d - ({tip})", "stiffness": "ks"}
    model = cf.Mechanism(
        np.eye(size),
        damping,
        stiffness,
        contacts={"stop": stop},
        force={name: f"0.6*({share})*cos(W*t)" for name, share in modes},
        parameters={"W": w, "d": 1.02 * amplitude, "ks": float(draw.uniform(2.0, 40.0))},
        period="2*pi/W",
        name=f"beam-{seed}-{size}",
    )
    return model, amplitude


def at_grazing(found: cf.Diagram, name: str, value: float) -> list[cf.Orbit]:
    """Return the ends of branches where a parameter has a value."""
    tips = [branch[k] for branch in found.branches for k in (0, -1)]
    return [orbit for orbit in tips if abs(orbit.params[name] - value) < 1e-6]


def assert_same_set(mine: np.ndarray, other: np.ndarray, tolerance: float) -> None:
    left = list(other)
    for value in mine:
        nearest = min(left, key=lambda o: abs(o - value))
        assert abs(nearest - value) < tolerance
        left.remove(nearest)


@pytest.mark.parametrize(
    ("size", "seed"),
    [
        pytest.param(size, seed, marks=[] if seed == 0 and size < 3 else pytest.mark.slow)
        for size in (1, 2, 3)
        for seed in range(4)
    ],
)
def test_a_spring_that_is_only_touched_changes_no_multiplier(size: int, seed: int) -> None:
    model, amplitude = random_mass_on_a_stop(seed, size)
    start = cf.find_orbit(model, {})
    found = cf.explore(start, "d", (0.97 * amplitude, 1.1 * amplitude), max_periods=1)
    event = next(b for b in found.bifurcations if b.kind is cf.Kind.GS)
    assert event.params["d"] == pytest.approx(amplitude, rel=1e-9)
    ends = at_grazing(found, "d", event.params["d"])
    assert any("c" in mode for orbit in ends for mode, _ in orbit.system.itinerary)
    for orbit in ends:
        assert_same_set(orbit.multipliers, start.multipliers, 1e-9)


@pytest.mark.parametrize(
    ("size", "seed"),  # other seeds do not settle, or touch nothing within the range
    [
        *((3, seed) for seed in (3, 4, 7, 9)),
        *(pytest.param(6, seed, marks=pytest.mark.slow) for seed in (0, 3, 5, 8, 9)),
        *(pytest.param(12, seed, marks=pytest.mark.slow) for seed in (1, 5, 7)),
    ],
)
def test_no_event_of_multipliers_is_told_where_a_spring_is_only_touched(
    size: int, seed: int
) -> None:
    """The slope vanishes with the time of the touch: its sign there is rounding, as no multiplier is 1."""
    model, amplitude = random_beam_at_a_stop(seed, size)
    start = cf.find_orbit(model, {})  # linear: its multipliers stay, up to the touch
    assert np.abs(np.abs(start.multipliers) - 1.0).min() > 1e-3
    found = cf.explore(
        start, "d", (0.99 * amplitude, 1.02 * amplitude), max_periods=1, bridges=False
    )
    (touch,) = (b for b in found.bifurcations if b.kind is cf.Kind.GS)
    assert touch.params["d"] == pytest.approx(amplitude, rel=1e-9)
    others = [b for b in found.bifurcations if b.kind is not cf.Kind.GS]
    assert all(b.located for b in others)
    assert all(abs(b.params["d"] / amplitude - 1.0) > 1e-5 for b in others)


def random_row_that_rubs(seed: int, size: int) -> cf.Model:
    """Return masses in a row with friction and a Jenkins element, under a force with two harmonics."""
    draw = np.random.default_rng([seed, size, 3])
    stiffness = np.diag(draw.uniform(0.5, 2.0, size))
    for i in range(size - 1):
        spring = draw.uniform(0.3, 1.5)
        stiffness[i : i + 2, i : i + 2] += spring * np.array([[1.0, -1.0], [-1.0, 1.0]])
    damping = draw.uniform(0.02, 0.1) * stiffness
    rubs = {"kind": "friction", "velocity": "v1", "kinetic": "S", "static": "S"}
    contacts = {"a": rubs}
    if size > 2:
        contacts["b"] = rubs | {"velocity": "v3", "kinetic": "0.7*S", "static": "0.7*S"}
    contacts["j"] = {"kind": "jenkins", "displacement": "q2", "stiffness": "0.8", "limit": "0.3"}
    second = float(draw.uniform(0.0, 0.5))
    w, friction = float(draw.uniform(0.4, 0.9)), float(draw.uniform(0.1, 0.5))
    return cf.Mechanism(
        np.eye(size),
        damping,
        stiffness,
        contacts=contacts,
        force={f"q{size}": f"F*cos(W*t) + {second!r}*cos(2*W*t + 0.4)"},
        parameters={"W": w, "F": 1.0, "S": friction},
        period="2*pi/W",
        name=f"row-{seed}-{size}",
    )


@pytest.mark.parametrize(
    ("size", "seed"),  # with (2, 3) nothing happens within the range
    [
        *((2, seed) for seed in (2, 4)),
        (3, 8),
        *(pytest.param(2, seed, marks=pytest.mark.slow) for seed in (0, 1, 5, 6, 7)),
        *(pytest.param(3, seed, marks=pytest.mark.slow) for seed in range(6)),
    ],
)
def test_a_fold_has_a_multiplier_of_one_next_to_a_slide_that_grazes(size: int, seed: int) -> None:
    model = random_row_that_rubs(seed, size)
    found = cf.explore(
        cf.find_orbit(model, {}), "F", (0.8, 1.3), max_periods=1, bridges=False, max_branches=20
    )
    assert any(b.tests for b in found.bifurcations)
    for event in found.bifurcations:
        assert event.located
        if event.kind in (cf.Kind.SN, cf.Kind.BP):
            assert np.abs(event.orbit.multipliers - 1.0).min() < 1e-3


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 3))]
)
def test_a_slider_that_only_touches_its_limit_has_the_limit_of_those_that_slip(seed: int) -> None:
    draw = np.random.default_rng(seed)
    model = cf.Mechanism(
        [[1.0]],
        [[float(draw.uniform(0.05, 0.3))]],
        [[float(draw.uniform(0.7, 1.5))]],
        contacts={"z": {"kind": "jenkins", "displacement": "q1", "stiffness": "kt", "limit": "N"}},
        force={"q1": "F*cos(W*t)"},
        parameters={"W": 0.9, "F": 1.5, "kt": float(draw.uniform(1.0, 3.0)), "N": 0.8},
        period="2*pi/W",
        name=f"slider-{seed}",
    )
    found = cf.explore(cf.find_orbit(model, {}), "F", (0.2, 1.6), max_periods=1)
    event = next(b for b in found.bifurcations if b.kind in (cf.Kind.GS, cf.Kind.CS))
    slips = next(b for b in found.branches if any(m in "pn" for m, _ in b[0].system.itinerary))
    first = event.params["F"]
    distances = (1e-4, 1e-5)
    found_at = []
    for distance in distances:
        k = int(np.argmin(np.abs(slips.params["F"] - first - 10.0 * distance)))
        branch = cf.continue_orbit(
            slips[k], "F", (first + distance, slips.params["F"][k] + distance)
        )
        low = int(np.argmin(branch.params["F"]))
        assert branch.params["F"][low] == pytest.approx(first + distance, abs=1e-10)
        found_at.append(np.sort_complex(branch[low].multipliers))
    far, near = found_at
    ends = [
        o for o in at_grazing(found, "F", first) if any(m in "pn" for m, _ in o.system.itinerary)
    ]
    assert ends
    for orbit in ends:  # with the root of the distance
        limit = near + (near - far) / (np.sqrt(distances[0] / distances[1]) - 1.0)
        assert_same_set(orbit.multipliers, limit, 1e-3)


def test_a_cycle_that_only_touches_a_spring_has_the_multiplier_of_the_free_one(
    tmp_path: Path,
) -> None:
    start = cf.find_orbit(typed(tmp_path, VAN_DER_POL), {"d": 2.1})
    found = cf.explore(start, "d", (1.95, 2.1), max_periods=1)
    event = next(b for b in found.bifurcations if b.kind is cf.Kind.GS)
    ends = at_grazing(found, "d", event.params["d"])
    assert len({orbit.system.itinerary for orbit in ends}) >= 2
    for orbit in ends:
        assert orbit.multipliers == pytest.approx(start.multipliers, abs=1e-9)
