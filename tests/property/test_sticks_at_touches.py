"""Motion on a belt that touches the belt's velocity, where friction does not jump at rest.

There a stick comes in for no time. Where the smooth orbit is unstable, orbits of several of its periods stick
in some of them only: all of them meet at the touch, whichever of them a diagram is started from.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typed import typed

import contfric as cf

LINEAR = """
name: belt
states: [x, v]
parameters: {w: 0.9, vb: 0.3, F: 0.15, s: 0.4, h: 0.5, c: 0.02}
period: 2*pi/w
observables: {u: -x - c*v + F*cos(w*t), r: v - vb}
surfaces:
  R: {observable: r}
  U+: {observable: u, level: s}
  U-: {observable: u, level: -s}
modes:
  slow: {in: {R: -}, field: {x: v, v: "u + s + h*(v - vb)"}}
  fast: {in: {R: +}, field: {x: v, v: "u - s + h*(v - vb)"}}
  stick: {in: {R: 0, U+: -, U-: +}, field: {x: vb, v: 0}}
"""
WEAKENING = """
name: weak
states: [x, v]
parameters: {w: 0.9, vb: 0.3, F: 0.15, k: 0.25, s: 0.4}
period: 2*pi/w
observables: {u: -x - 0.02*v + F*cos(w*t), r: v - vb}
surfaces:
  R: {observable: r}
  U+: {observable: u, level: s}
  U-: {observable: u, level: -s}
modes:
  slow: {in: {R: -}, field: {x: v, v: "u + k + (s - k)*exp(5*r)"}}
  fast: {in: {R: +}, field: {x: v, v: "u - k - (s - k)*exp(-5*r)"}}
  stick: {in: {R: 0, U+: -, U-: +}, field: {x: vb, v: 0}}
"""
#: Cases of which the smooth orbit touches the velocity of the belt within the range.
DRAWN = [
    (1.064, {"vb": 0.436, "F": 0.137, "h": 0.196, "s": 0.676}),
    (0.794, {"vb": 0.432, "F": 0.185, "h": 0.241, "s": 0.552}),
    (1.159, {"vb": 0.353, "F": 0.132, "h": 0.103, "s": 0.659}),
]


def smooth_branch(found: cf.Diagram) -> int:
    (smooth,) = (i for i, b in enumerate(found.branches) if b.name.startswith("0a"))
    return smooth


def stuck(orbit: cf.Orbit) -> float:
    """Return how long an orbit sticks in a period."""
    whole = orbit.as_whole()
    lasts = whole.ends[:, 0] - whole.begins[:, 0]
    return float(sum(lasts[k] for k, (mode, _) in enumerate(whole.itinerary) if mode == "stick"))


def test_a_stick_comes_in_for_no_time_and_grows_as_the_root(tmp_path: Path) -> None:
    model = typed(tmp_path, LINEAR)
    for w, params in DRAWN:
        first = cf.explore(cf.find_orbit(model, params | {"w": w}), "w", (w - 0.1, w + 0.1))
        started = first.branches[smooth_branch(first)]
        found = cf.explore(started[len(started) // 2], "w", (w - 0.1, w + 0.1))
        assert not found.loose_ends
        smooth = smooth_branch(found)
        (touch,) = (e for e in found.events if smooth in e.branches)
        assert any("stick at the touch of rest" in p.reason for p in touch.proposals)
        (other,) = (found.branches[i] for i in touch.branches if i != smooth)
        there = touch.bifurcation.params["w"]
        near = sorted(other, key=lambda orbit: abs(orbit.params["w"] - there))[2:7]
        lasts = [stuck(orbit) for orbit in near]
        apart = [abs(o.params["w"] - there) for o in near]
        slope = np.polyfit(np.log(apart), np.log(lasts), 1)[0]
        assert 0.4 < slope < 0.6, slope  # the root, and what follows it


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_orbits_that_stick_in_some_of_their_periods_meet(tmp_path: Path, seed: int) -> None:
    model = typed(tmp_path, WEAKENING)
    rng = np.random.default_rng([606, seed])
    params = {"vb": 0.3 * rng.uniform(0.98, 1.02), "F": 0.15 * rng.uniform(0.98, 1.02)}
    found = cf.explore(cf.find_orbit(model, params), "w", (0.7, 1.1))
    assert not found.loose_ends
    smooth = smooth_branch(found)
    (touch,) = (e for e in found.events if smooth in e.branches)
    assert len(touch.branches) > 4
    checked = found.verify(4)
    assert checked.passed, str(checked)
