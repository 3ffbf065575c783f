"""Proofs of a mass with dry friction that a wall stops: grazing impacts, and a wall that is moved."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from by_scipy import met
from flint import arb
from scipy.optimize import brentq
from typed import typed

import contfric as cf
from contfric.certify.equations.chain import Chain, segments_of
from contfric.certify.tubes.circle import has_real_pair
from contfric.models.balls.build import ball_model
from contfric.models.balls.numbers import working

MODEL = """
name: friction-and-wall
states: [x, v]
parameters: {Omega: 0.8, S: 0.1, zeta: 0.05, d: 1.0, e: 0.7}
period: 2*pi/Omega
observables: {gap: x - d, v: v, load: x - cos(Omega*t)}
surfaces:
  wall: {observable: gap, level: 0}
  v: {observable: v, level: 0}
  F+: {observable: load, level: S}
  F-: {observable: load, level: -S}
field: {x: v, v: cos(Omega*t) - x - 2*zeta*v - S*sign(v)}
modes:
  slide+: {in: {v: +, wall: -}}
  slide-: {in: {v: -, wall: -}}
  stick: {in: {v: 0, F+: -, F-: +, wall: -}, field: {x: 0, v: 0}}
resets:
  wall: {v: -e*v}
"""


@cache
def model(folder: Path) -> cf.Model:
    return typed(folder, MODEL)


def scene(seed: int, place: float = 0.0) -> dict[str, float]:
    """Return random parameters; with a wall at some place those of a mass that sticks twice a period."""
    rng = np.random.default_rng(seed)
    limits = {"Omega": (0.4, 1.8), "S": (0.02, 0.4), "zeta": (0.01, 0.2), "d": (0.5, 1.5)}
    if place:
        limits = {"Omega": (0.5, 0.6), "S": (0.5, 0.6), "zeta": (0.02, 0.04), "d": (place, place)}
    return {name: float(rng.uniform(*span)) for name, span in (limits | {"e": (0.2, 0.5)}).items()}


def furthest(p: dict[str, float], periods: float) -> float:
    """Return how far the mass goes without a wall, by stepping from stop to stop."""
    w, s, zeta = p["Omega"], p["S"], p["zeta"]
    t, x, sign, end = 0.0, 0.0, 1, 2 * math.pi * periods / w
    best = -math.inf

    def load(time: float) -> float:
        return math.cos(w * time) - x

    while t < end:
        if abs(load(t)) < s * (1 - 1e-9):  # it rests until the load passes the limit
            times = np.linspace(t, t + 2 * math.pi / w, 400)
            over = next(k for k, time in enumerate(times) if abs(load(time)) > s)
            t = brentq(lambda time: abs(load(time)) - s, times[over - 1], times[over], xtol=1e-14)
            rate = -w * math.sin(w * t)
            sign = 1 if rate > 0 else -1
        else:
            sign = 1 if load(t) > 0 else -1

        def rates(time: float, y: np.ndarray, sign: int = sign) -> list[float]:
            force = math.cos(w * time) - y[0] - 2 * zeta * y[1] - s * sign
            return [y[1], force]

        def stops(time: float, y: np.ndarray, sign: int = sign, begins: float = t) -> float:
            return sign * y[1] if time > begins + 1e-6 else 1.0

        t, (x, _) = met(rates, [x, 0.0], stops, span=(t, t + 4 * math.pi / w))
        if t > 0.8 * end:
            best = max(best, x)
    return best


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("walls")


def followed(own: dict[str, float], parameter: str, low: float, high: float, at: Path) -> cf.Branch:
    orbit = cf.find_orbit(model(at), own, longest=800)
    return cf.continue_orbit(orbit, parameter, (low * own[parameter], high * own[parameter]))


@pytest.mark.parametrize(
    ("seed", "place"), [(3, 0.0), (7, 0.0), (8, 0.0), (0, 2.0), (1, 2.0), (0, 0.8), (1, 0.8)]
)
def test_grazing_impacts_are_proved_from_both_sides(seed: int, place: float, folder: Path) -> None:
    """With the impact or without, and where the mass rests at the wall: it would turn there anyway."""
    own = scene(seed, place)
    events = followed(own, "d", 0.4, 2.0, folder).bifurcations
    found = [e for e in events if e.kind == "GS" and any(t.surface == "wall" for t in e.tests)]
    assert found
    for event in found:
        proof = event.certify()
        assert proof.proved, proof.why
        assert proof.value is not None
        assert abs(float(proof.value.mid()) - furthest(own, 60)) < 1e-9


@pytest.mark.parametrize("parameter", ["d", "S"])
@pytest.mark.parametrize("seed", range(3))
def test_events_and_branches_with_impacts_are_proved(
    seed: int, parameter: str, folder: Path
) -> None:
    """Along a wall that is moved, and along the friction, which is the limit of rest, too."""
    own = scene(seed, 0.8)
    branch = followed(own, parameter, 0.97, 1.03, folder)
    assert any(exit_ == "wall" for _, exit_ in branch[0].itinerary)
    proof = branch.certify()
    assert proof.covered > 0.999, proof.gaps
    for own_proof in proof.proofs:
        assert own_proof.proved, own_proof


def test_a_branch_ends_where_the_wall_is_just_touched(folder: Path) -> None:
    own = scene(0, 2.0)
    place = furthest(own, 60)
    branch = followed(own | {"d": 1.02 * place}, "d", 0.9, 1.05, folder)
    assert branch.ends[0].reason.name == "GS"
    assert branch.certify().complete


@pytest.mark.parametrize("seed", [3, 7, 12])
def test_a_branch_with_an_impact_is_proved_up_to_its_graze(seed: int, folder: Path) -> None:
    """The impact, the velocity after it and the way back from the wall vanish together.

    One of these branches hits the wall in every second period: it ends on an orbit of one period.
    """
    own = scene(seed)
    place = furthest(own, 60)
    branch = followed(own | {"d": 0.99 * place}, "d", 0.98, 1.1, folder)
    assert branch.ends[1].reason.name == "GS"
    assert any(exit_ == "wall" for _, exit_ in branch[0].itinerary)
    proof = branch.certify()
    assert proof.complete, proof.gaps + proof.open
    assert branch.values[-1] == pytest.approx(place, abs=1e-9)
    assert {"exit", "entry", "rate at the start"} <= {name.what for name in proof.pieces[-1].ends}


@pytest.mark.parametrize("seed", range(4))
def test_a_branch_without_impacts_is_proved_up_to_the_wall(seed: int) -> None:
    """The amplitude of a linear oscillator is known; its first segment starts at the wall."""
    rng = np.random.default_rng(seed)
    w, c = rng.uniform(0.4, 1.6), rng.uniform(0.05, 0.4)
    moved = 1 / complex(1 - w * w, c * w)
    place, state = abs(moved), [moved.real, (1j * w * moved).real]
    orbit = cf.find_orbit("impact", {"w": w, "c": c, "d": 1.1 * place}, state=state)
    proof = cf.continue_orbit(orbit, "d", (0.8 * place, 1.2 * place)).certify()
    assert proof.branch.values.min() == pytest.approx(place, rel=1e-12)
    assert proof.covered == 1.0, proof.gaps
    assert all(piece.linked for piece in proof.pieces[1:])


@pytest.mark.parametrize("seed", range(4))
def test_a_pair_on_the_circle_is_seen_in_the_chain(seed: int) -> None:
    """Without damping and impacts the multipliers are on the circle; with damping their product is not 1."""
    rng = np.random.default_rng(seed)
    w = rng.uniform(0.4, 0.9) + 0.7 * (seed % 2)
    orbit = cf.find_orbit("impact", {"w": w, "c": 0.3, "d": 50.0})
    segments, size = segments_of(orbit.system), 1 / abs(1 - w * w)
    start = math.pi / w if w < 1 else 0.0  # the least place
    joints = [start, -size, 0, start + math.pi / w, size, 0]
    assert segments.modes == ("up", "down")

    def denied(damping: float, spread: float = 0.0) -> bool:
        balls = ball_model(orbit.model, orbit.params | {"c": damping})
        fields = {name: field + arb(0, spread) * field for name, field in balls.fields.items()}
        chain = Chain(segments, replace(balls, fields=fields, slopes=None))
        with working(80):
            return has_real_pair(chain, [arb(x) for x in joints])

    assert not denied(0.0)
    assert not denied(0.0, 1e-6) and not denied(1e-4, 1e-2)
    assert denied(1e-4) and denied(-1e-4)


@pytest.mark.parametrize("seed", range(5))
def test_where_a_velocity_is_stationary_is_known_in_the_parameters(seed: int, folder: Path) -> None:
    """On ``v = 0`` the acceleration is a load less its limit: damping has no part in it."""
    own = scene(seed)
    system = model(folder)
    balls = ball_model(system, own, "S", arb(own["S"], 1e-3))
    assert balls.alike is not None
    limits = {"slide+": "F-", "slide-": "F+"}
    for mode, limit in limits.items():
        assert balls.alike("v", mode) == limit
        # the same in numbers, where S is one
        exact = ball_model(system, own)
        rate = exact.surfaces["v"] * exact.fields[mode]
        known = [exact.surfaces[limit], exact.surfaces["v"]]
        rows = np.array([[float(x.mid()) for x in r.entries()] for r in (rate, *known)])
        assert np.linalg.matrix_rank(rows, 1e-12) == 2
    assert balls.alike("v", "stick") is None
    assert balls.alike("wall", "slide+") == "v"
