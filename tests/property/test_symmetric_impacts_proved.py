"""Symmetric orbits with impacts are proved on their half, if the resets are images of each other."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typed import typed

import contfric as cf
from contfric.bvp.system import build_system
from contfric.certify.equations.chain import segments_of
from contfric.certify.equations.closing import is_symmetry, keeps
from contfric.models.balls.build import ball_model
from contfric.models.balls.numbers import working

FREE = """
name: {name}
states: [x, v]
parameters: {{w: 1.5, d: 0.6, r: 0.8, q: 0.8, zeta: 0.05, S: 0.1}}
period: 2*pi/w
surfaces:
  right: {{observable: x, level: d}}
  left: {{observable: x, level: -d}}
modes:
  free: {{in: {{right: -, left: +}}, field: {{x: v, v: "-x - 2*zeta*v + cos(w*t)"}}}}
resets: {{right: {{v: {right}}}, left: {{v: {left}}}}}
symmetry: x -> -x, v -> -v, t -> t + T/2
"""
RUBBING = """
name: {name}
states: [x, v]
parameters: {{w: 1.5, d: 0.6, r: 0.8, q: 0.8, zeta: 0.05, S: 0.1}}
period: 2*pi/w
observables: {{load: "cos(w*t) - x"}}
surfaces:
  right: {{observable: x, level: d}}
  left: {{observable: x, level: -d}}
  v: {{observable: v, level: 0}}
  F+: {{observable: load, level: S}}
  F-: {{observable: load, level: -S}}
field: {{x: v, v: "-x - 2*zeta*v + cos(w*t) - S*sign(v)"}}
modes:
  slide+: {{in: {{v: +, right: -, left: +}}}}
  slide-: {{in: {{v: -, right: -, left: +}}}}
  stick: {{in: {{v: 0, F+: -, F-: +, right: -, left: +}}, field: {{x: 0, v: 0}}}}
resets: {{right: {{v: {right}}}, left: {{v: {left}}}}}
symmetry: x -> -x, v -> -v, t -> t + T/2
"""
MODELS = {"free": FREE, "rubbing": RUBBING}


def loaded(folder: Path, name: str, right: str = "-r*v", left: str = "-r*v") -> cf.Model:
    """Return a mass between two walls, with these velocities after the impacts."""
    return typed(folder, MODELS[name].format(name=name, right=right, left=left))


def half_orbit(model: cf.Model, seed: int) -> cf.Orbit:
    """Return a symmetric orbit with impacts of random parameters, on its half."""
    rng = np.random.default_rng([seed, len(model.surfaces)])
    while True:
        names, low, high = (
            ("w", "d", "r", "zeta", "S"),
            (0.4, 0.4, 0.5, 0.02, 0.05),
            (1.6, 0.9, 0.9, 0.2, 0.3),
        )
        params = dict(zip(names, rng.uniform(low, high), strict=True))
        params["q"] = params["r"]
        try:
            orbit = cf.find_orbit(model, params, state=(0.1, 0.3), longest=300).as_half()
        except cf.ContfricError:
            continue
        if orbit.system.half and "imp" in orbit.name:
            return orbit


def shown_symmetric(orbit: cf.Orbit, q: float) -> bool:
    with working(128):
        balls = ball_model(orbit.model, {**orbit.params, "q": q}, "w")
        return is_symmetry(orbit, segments_of(orbit.system), balls)


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("seed", range(6))
def test_a_half_is_proved_as_the_whole_is(tmp_path: Path, name: str, seed: int) -> None:
    """The proof on the whole cycle knows nothing of a symmetry: joints and multipliers are the same."""
    orbit = half_orbit(loaded(tmp_path, name), seed)
    half, whole = orbit.certify(), orbit.as_whole().certify()
    assert half.orbit.system.half and not whole.orbit.system.half
    assert half.proved and whole.proved, (half.why, whole.why)
    m = 1 + len(orbit.model.states)
    for k, (a, b) in enumerate(zip(half.enclosure, whole.enclosure, strict=False)):
        start = 0 if k % m else half.enclosure[0] - whole.enclosure[0]  # perhaps another period
        assert (a - b - start).contains(0)
    squares = sorted(float(abs(mu) ** 2) for mu in half.multipliers)
    np.testing.assert_allclose(
        squares, sorted(float(abs(mu)) for mu in whole.multipliers), atol=1e-14
    )


@pytest.mark.parametrize("name", MODELS)
def test_events_of_symmetric_orbits_with_impacts_are_proved(tmp_path: Path, name: str) -> None:
    model, proofs = loaded(tmp_path, name), list[Any]()
    for seed in range(4):
        orbit = half_orbit(model, seed)
        w = orbit.params["w"]
        branch = cf.continue_orbit(orbit, "w", (w - 0.2, w + 0.2))
        proofs += [event.certify() for event in branch.bifurcations if event.orbit.system.half]
    assert len(proofs) > 3
    assert all(proof.proved for proof in proofs), [proof.why for proof in proofs]


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize(
    "left",
    ["-q*v", "-r*v - 0.01", "-r*v + 0.01*(x + d)", "-(r + 1e-12)*v", "-r*v + 0.01*cos(2*w*t)"],
)
def test_resets_that_are_no_images_are_refused(tmp_path: Path, name: str, left: str) -> None:
    """Also where they differ by a rounding, or not on the wall (x = -d)."""
    good = half_orbit(loaded(tmp_path, name), 0)
    r = good.params["r"]
    (tmp_path / "other").mkdir()
    model = loaded(tmp_path / "other", name, left=left)
    system = build_system(model, good.system.itinerary, good.periods, half=True)
    bad = replace(good, system=system)
    assert shown_symmetric(good, q=0.5)
    assert not shown_symmetric(bad, q=float(np.nextafter(r, 1)))
    with working(128):
        balls = ball_model(model, {**good.params, "q": 0.5})
        assert not keeps(system, segments_of(system), balls, balls)


def test_mirrored_resets_are_known_as_such(tmp_path: Path) -> None:
    """Resets that depend on time and place, and are images of each other."""
    good = half_orbit(loaded(tmp_path, "free"), 0)
    (tmp_path / "other").mkdir()
    texts = "-r*v + 0.1*(x - d) + 0.1*cos(w*t) + 0.2", "-r*v + 0.1*(x + d) + 0.1*cos(w*t) - 0.2"
    model = loaded(tmp_path / "other", "free", *texts)
    system = build_system(model, good.system.itinerary, good.periods, half=True)
    assert shown_symmetric(replace(good, system=system), q=0.5)


@pytest.mark.parametrize("modes", ["[slide+]", "[stick]"])
def test_a_reset_that_acts_in_other_modes_is_no_image(tmp_path: Path, modes: str) -> None:
    """Its formula is that of the image: what differs is that the image orbit passes without an impact."""
    good = half_orbit(loaded(tmp_path, "rubbing"), 0)
    (tmp_path / "other").mkdir()
    model = loaded(tmp_path / "other", "rubbing", left=f"-r*v, from: {modes}")
    system = build_system(model, good.system.itinerary, good.periods, half=True)
    with working(128):
        balls = ball_model(model, good.params)
        assert keeps(system, segments_of(system), balls, balls)
    assert not shown_symmetric(replace(good, system=system), q=0.5)
