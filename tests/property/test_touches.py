"""A touch of a surface across which nothing changes is a tangency: no end, whichever joints an orbit has."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from math import cos, pi
from pathlib import Path

import numpy as np
import pytest
from by_scipy import after
from scipy.optimize import fsolve
from typed import typed

import contfric as cf
from contfric.orbit.canonical.section_crossings import every_crossing
from contfric.orbit.solve import refine

MODELS = Path(__file__).parents[1] / "models"
WALLS = MODELS / "walls.yaml"
#: Where nothing is hit, and what is hit; in both v touches 0 as the second harmonic grows.
SMOOTH = {"w": 0.5, "F": 1.0, "zeta": 0.1, "k3": 0.3, "d": 50.0}
IMPACTS = {"w": 2.0}


def acceleration(p: dict[str, float], t: float, y: np.ndarray) -> float:
    force = p["F"] * cos(p["w"] * t) + p["a"] * cos(3 * p["w"] * t + p["phase"])
    return float(force - 2 * p["zeta"] * y[1] - y[0] - p["k3"] * y[0] ** 3)


def touch_of(orbit: cf.Orbit) -> float:
    """Return the smallest speed at which the velocity is stationary, from a dense sample."""
    times = orbit.cycle[0, 0] + np.linspace(0.0, orbit.period, 20_001)
    states = np.array([orbit.state(t) for t in times])
    rates = np.array([acceleration(orbit.params, t, y) for t, y in zip(times, states, strict=True)])
    turns = np.flatnonzero(rates[:-1] * rates[1:] <= 0.0)
    return float(np.min(np.abs(states[turns, 1])))


def reversals(orbit: cf.Orbit) -> int:
    """Return how often the velocity changes its sign in a period, from a dense sample."""
    times = orbit.cycle[0, 0] + np.linspace(0.0, orbit.period, 4_001)
    return int(np.sum(np.diff(np.sign([orbit.state(t)[1] for t in times[:-1]])) != 0.0))


@cache
def branch(kind: str) -> cf.Branch:
    if kind == "smooth":
        return cf.continue_orbit(cf.find_orbit(WALLS, {**SMOOTH, "a": 2.5}), "a", (-3.0, 3.0))
    return cf.continue_orbit(cf.find_orbit(WALLS, IMPACTS), "w", (1.7, 2.4))


@pytest.mark.parametrize("kind", ["smooth", "impacts"])
def test_a_touch_of_a_section_ends_no_branch(kind: str) -> None:
    found = branch(kind)
    touches = [b for b in found.bifurcations if b.kind is cf.Kind.T]
    assert touches
    for end in found.ends:
        event = end.bifurcation
        assert event is None or all(test.surface != "s" for test in event.tests)
    for touch in touches:
        assert touch_of(touch.orbit) < 1e-6
        k = int(np.searchsorted(found.arc, touch.position))
        assert reversals(found[k - 2]) != reversals(found[k + 2])
    for k in range(0, len(found), 29):
        orbit = found[k]
        assert orbit.admissible, orbit.violations()
        times = np.linspace(0.0, orbit.period, 4_001)
        top = max(orbit.state(t)[0] for t in times)
        assert -1e-9 < orbit.x_max - top < 1e-3  # an impact lies between two samples


def test_the_touch_of_two_walls_by_the_flow_beside_it() -> None:
    """Two impacts a period, on both sides of the touch: a simulation stays on the orbits."""
    (touch,) = (b for b in branch("impacts").bifurcations if b.kind is cf.Kind.T)
    assert touch.params["w"] == pytest.approx(2.11164434994, abs=1e-9)
    for side in (-1e-3, 1e-3):
        found = branch("impacts")
        k = int(np.argmin(np.abs(found.values - touch.params["w"] - side)))
        orbit = found[k]
        time = 0.5 * float(orbit.cycle[0, 0] + orbit.ends[0, 0])
        run = cf.simulate(WALLS, orbit.params, state=orbit.state(time), time=time, periods=1.0)
        assert np.abs(run.last[2] - orbit.state(time)).max() < 1e-8


def motion(start: list[float], until: float, params: dict[str, float]) -> np.ndarray:
    def field(t: float, y: np.ndarray) -> tuple[float, float]:
        return y[1], acceleration(params, t, y)

    return after(field, start, (0.0, until))


def test_the_places_of_touches_by_another_integrator() -> None:
    found = branch("smooth")
    for touch in (b for b in found.bifurcations if b.kind is cf.Kind.T):
        p, orbit = dict(touch.params), touch.orbit
        period = 2 * pi / p["w"]

        times = np.linspace(0.0, period, 20_001)
        near = [t for t in times if abs(orbit.state(t)[1]) < 1e-3]
        at = min(near, key=lambda t: abs(acceleration(p, t, orbit.state(t))))

        def conditions(u: np.ndarray, q: dict[str, float] = p, span: float = period) -> list[float]:
            x, v, time, a = u
            here = motion([x, v], time, {**q, "a": a})
            gap = motion([x, v], span, {**q, "a": a}) - [x, v]
            return [*gap, here[1], acceleration({**q, "a": a}, time, here)]

        solved = fsolve(conditions, [*orbit.state(0.0), at, p["a"] + 1e-6], xtol=1e-13)
        assert p["a"] == pytest.approx(solved[3], abs=1e-9)


def test_joints_of_a_smooth_cycle_are_of_no_importance() -> None:
    """Whichever crossings a cycle is found by: the same events, and joints move before they vanish."""
    orbit = cf.find_orbit(WALLS, {**SMOOTH, "a": 2.5}).as_whole()
    expected = [(b.kind, b.params["a"]) for b in branch("smooth").bifurcations]
    itinerary, joints = every_crossing(orbit)
    assert len(itinerary) == 6 and len(orbit.itinerary) == 2
    for down in (i for i in range(6) if orbit.model.section_sides[itinerary[i]] > 0):
        own = joints[[(down + 1) % 6, (down + 2) % 6]].copy()
        if orbit.model.section_pair(*itinerary[(down + 1) % 6]) != orbit.itinerary[0]:
            own = own[::-1].copy()
        own[1, 0] += orbit.period * (own[1, 0] <= own[0, 0])
        other = refine(replace(orbit, joints=own))
        assert other.converged and np.abs(other.state(1.0) - orbit.state(1.0)).max() < 1e-9
        found = cf.continue_orbit(other, "a", (-3.0, 3.0))
        events = [(b.kind, b.params["a"]) for b in found.bifurcations]
        assert [kind for kind, _ in events] == [kind for kind, _ in expected]
        assert np.allclose([a for _, a in events], [a for _, a in expected], atol=1e-8)
        assert [end.reason for end in found.ends] == [end.reason for end in branch("smooth").ends]


@pytest.mark.parametrize("seed", range(4))
def test_random_cycles_end_at_no_touch(seed: int) -> None:
    draw = np.random.default_rng(seed)
    params = {
        "w": draw.uniform(0.4, 2.2),
        "F": draw.uniform(1.0, 2.0),
        "a": draw.uniform(0.5, 2.0),
        "phase": draw.uniform(0.0, 6.0),
        "zeta": draw.uniform(0.1, 0.3),
        "k3": draw.uniform(0.0, 0.5),
        "d": draw.choice([0.6, 50.0]),
    }
    try:
        start = cf.find_orbit(WALLS, params, longest=2000)
    except cf.AperiodicError:
        start = cf.find_orbit(WALLS, {**params, "d": 50.0})
    found = cf.continue_orbit(start, "a", (-2.0, 3.0))
    for end in found.ends:
        assert end.bifurcation is None or all(t.surface != "s" for t in end.bifurcation.tests)
    for event in found.bifurcations:
        if event.kind is cf.Kind.T:
            assert touch_of(event.orbit) < 1e-5
        else:
            assert not any(test.surface == "s" for test in event.tests)
    again = cf.continue_orbit(found[len(found) // 3], "a", (-2.0, 3.0))
    ours, theirs = ([(b.kind, b.params["a"]) for b in f.bifurcations] for f in (found, again))
    assert [kind for kind, _ in ours] == [kind for kind, _ in theirs]
    assert np.allclose([a for _, a in ours], [a for _, a in theirs], atol=1e-7)


# --------------------------------------------------------------------------------- models

JOINED = {
    "popp": {("rise", "fall")},
    "impact": {("up", "down")},
    "belt": {("rise", "fall")},
    "lugre": {("first", "second")},
    str(MODELS / "bilinear.yaml"): {("pressed+", "pressed-"), ("free+", "free-")},
    "coulomb-yaml": set(),
    "impact-friction": set(),
    "stribeck": set(),
}


@pytest.mark.parametrize("name", JOINED)
def test_modes_of_one_field_are_recognised(name: str) -> None:
    """Not those whose friction turns with the velocity."""
    model = cf.load_model(name)
    groups: dict[str, list[str]] = {}
    for part, whole in model.joined.items():
        groups.setdefault(whole, []).append(part)
    assert {tuple(parts) for parts in groups.values()} == JOINED[name]


def variant(tmp_path: Path, field: str, more: str = "") -> cf.Model:
    text = (
        "name: variant\nstates: [x, v]\nparameters: {w: 1.0, c: 0.0}\nperiod: 2*pi/w\n"
        f"surfaces:\n  s: {{observable: v, level: 0}}\n  g: {{observable: x, level: 1}}\n{field}\n"
        f"modes:\n  up: {{in: {{s: +}}}}\n  down: {{in: {{s: -}}{more}}}\nspread: {{x: 1, v: 1}}\n"
    )
    return typed(tmp_path, text)


def test_what_differs_in_a_derivative_or_at_other_parameters_is_not_one_field(
    tmp_path: Path,
) -> None:
    def is_one(rate: str, more: str = "") -> bool:
        return bool(variant(tmp_path, f'field: {{x: v, v: "{rate} + cos(w*t)"}}', more).joined)

    assert is_one("-x - 0.1*v")
    assert is_one("-x - 0.1*v*abs(x - 1)")  # a kink elsewhere
    assert not is_one("-x - 0.1*v*abs(v)")  # continuous with its first derivative
    assert not is_one("-x - 0.3*sign(v)")
    other = ', field: {x: v, v: "-x - 0.1*v - c*v**2 + cos(w*t)"}'
    assert not is_one("-x - 0.1*v", other)  # the same at the default c = 0 only
    same = ', field: {x: v, v: "-(x + v/10) + cos(w*t)"}'
    assert is_one("-x - 0.1*v", same)
