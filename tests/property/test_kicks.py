"""Kicks against the motion: what is fast passes the gate all the same, what is slow turns back.

The recoil of an escapement, an impulse where the position passes a value in one direction. Which way a state
goes is told by the sides of a surface at which the rate of the gate's observable vanishes.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from typed import typed

import contfric as cf
from contfric.events.bifurcation import Kind

KICK = """
name: kick
states: [x, v]
parameters: {{J: {J!r}, w: 1.3, d: {d!r}}}
period: 2*pi/w
surfaces: {{gate: {{observable: x, level: d}}{stop}}}
field: {{x: v, v: cos(w*t) - x - 0.2*v}}
modes: {{left: {{in: {{gate: -}}}}, right: {{in: {{gate: +}}}}}}
resets: {{gate: {{v: {map}, from: [left]{to}}}}}
spread: {{x: 2, v: 2}}
"""
STOP = ", stop: {observable: v}"
KICKS = {
    "v - J": lambda v, J: v - J,
    "v**2 - J": lambda v, J: v**2 - J,
    "J*(v - 1)": lambda v, J: J * (v - 1.0),
}


def followed(
    kick: str, J: float, d: float, y: list[float], end: float
) -> tuple[int, int, np.ndarray]:
    """Return how often motion is kicked, how often it turns back, and the last state, by scipy."""

    def field(t: float, y: np.ndarray) -> list[float]:
        return [y[1], math.cos(1.3 * t) - y[0] - 0.2 * y[1]]

    def up(_t: float, y: np.ndarray) -> float:
        return float(y[0] - d)

    up.terminal, up.direction = True, 1  # type: ignore[attr-defined]
    t, kicked, back = 0.0, 0, 0
    while True:
        done = solve_ivp(field, (t, end), y, events=up, rtol=1e-11, atol=1e-13, max_step=0.2)
        t, last = float(done.t[-1]), done.y[:, -1]
        if done.status == 0:
            return kicked, back, last
        after = KICKS[kick](float(last[1]), J)
        kicked, back = kicked + 1, back + (after < 0.0)
        # a small step off the gate: what is thrown back is not kicked where it starts
        step = 1e-9
        y, t = [d + after * step, after + step * field(t, [d, after])[1]], t + step


@pytest.mark.parametrize(
    "to", ["", pytest.param(", to: {right: {stop: +}, left: {stop: -}}", marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("kick", KICKS)
def test_a_kick_passes_or_turns_back_as_it_is_fast(tmp_path: Path, kick: str, to: str) -> None:
    draw = np.random.default_rng(len(kick) + len(to))
    seen = [0, 0]
    for _ in range(3):
        J, d = float(draw.uniform(0.3, 1.2)), float(draw.uniform(-0.3, 0.4))
        model = typed(tmp_path, KICK.format(J=J, d=d, map=kick, to=to, stop=STOP))
        start, periods = [float(draw.uniform(-1.5, d)), float(draw.uniform(-1.0, 1.0))], 6
        found = cf.simulate(model, state=start, periods=periods)
        kicks = [
            i
            for i, (mode, met) in enumerate(found.itinerary)
            if (mode[:4], met) == ("left", "gate")
        ]
        after = [mode for mode, _ in found.itinerary[1:]] + [found.last[3]]
        kicked, back, last = followed(kick, J, d, start, periods * 2 * math.pi / 1.3)
        assert len(kicks) == kicked
        assert sum(after[i][:4] == "left" for i in kicks) == back
        seen = [seen[0] + kicked - back, seen[1] + back]
        np.testing.assert_allclose(
            found.last[2], last, atol=1e-5
        )  # a first step, and few kicks after it
    assert min(seen) > 0


@pytest.mark.parametrize("kick", KICKS)
def test_a_kick_whose_way_nothing_tells_is_refused(tmp_path: Path, kick: str) -> None:
    with pytest.raises(cf.ModelError, match="declare a surface where the rate of its observable"):
        typed(tmp_path, KICK.format(J=0.8, d=0.1, map=kick, to="", stop=""))
    for text, side in (("J*v", -1), ("-J*v", 1)):  # these all pass, or all turn back
        model = typed(tmp_path, KICK.format(J=0.8, d=0.1, map=text, to="", stop=STOP))
        assert model.resets[0].lands == {"gate": side}


#: An oscillator that grows, and is kicked against its motion on its way up.
GROWS = """
name: grows
states: [x, v]
parameters: {a: 0.1, J: 1.5, d: 0.5}
autonomous: true
surfaces: {gate: {observable: x, level: d}, stop: {observable: v}}
field: {x: v, v: 2*a*v - x}
modes: {forth: {in: {stop: +}}, back: {in: {stop: -}}}
resets: {gate: {v: v - J, from: [forth]}}
"""


def returned(a: float, d: float) -> float:
    """Return the speed at which motion that is at rest at the gate is back at it, a turn later."""
    w = math.sqrt(1.0 - a * a)

    def x(t: float) -> float:
        return d * math.exp(a * t) * (math.cos(w * t) - a / w * math.sin(w * t))

    def v(t: float) -> float:
        return -d * math.exp(a * t) * math.sin(w * t) / w

    return v(brentq(lambda t: x(t) - d, 1.1 * math.pi / w, 2.0 * math.pi / w, xtol=1e-14))


def test_a_kick_that_just_turns_back_leads_to_one_that_just_passes(tmp_path: Path) -> None:
    """The gate pulls motion back to where it came from, and nothing maps it there: the map is continuous."""
    model = typed(tmp_path, GROWS)
    at = returned(0.07, 0.5)
    orbit = cf.find_orbit(model, {"a": 0.07, "J": 1.3 * at})
    diagram = cf.explore(orbit, "J", (0.9 * at, 1.4 * at))
    met = [b for b in diagram.bifurcations if b.kind is Kind.CS]
    assert [b.params["J"] for b in met] == pytest.approx([at], rel=1e-9)
    assert sum(end.reason.name == "CS" for b in diagram.branches for end in b.ends) == 2
    assert diagram.verify(restarts=2).passed


def test_a_kick_that_is_met_again_jumps(tmp_path: Path) -> None:
    """Where what just turns back is kicked again at once, nothing lies between it and what just passes."""
    text = GROWS.replace("autonomous: true", "period: 2*pi/w").replace(
        "a: 0.1, J: 1.5, d: 0.5", "w: 1.2, J: 0.3"
    )
    text = text.replace("level: d", "level: 0.2").replace("2*a*v - x", "cos(w*t) - x - 0.1*v")
    model = typed(tmp_path, text)
    branch = cf.continue_orbit(cf.find_orbit(model), "J", (0.2, 2.5))
    event = branch.bifurcations[-1]
    assert event.kind is Kind.GS and "the map jumps" in event.meaning
    t, _, v = event.orbit.joints[1]
    assert (
        v == pytest.approx(event.params["J"], abs=1e-9) and math.cos(1.2 * t) > 0.2
    )  # it is pushed on
    assert "the map jumps" in branch.ends[-1].message


def test_what_falls_through_a_gate_and_is_kicked_on_its_way_back_jumps(tmp_path: Path) -> None:
    """A stop that comes down to the gate: a moment below it, and motion is kicked as it comes up again."""
    text = GROWS.replace("autonomous: true", "period: 2*pi/w").replace(
        "a: 0.1, J: 1.5, d: 0.5", "w: 0.7, J: 1.86"
    )
    text = text.replace("level: d", "level: 0.8").replace("2*a*v - x", "cos(w*t) - x - 0.1*v")
    model = typed(tmp_path, text)
    branch = cf.continue_orbit(cf.find_orbit(model), "J", (1.8, 2.5))
    event = branch.bifurcations[-1]
    assert event.kind is Kind.GS and "the map jumps" in event.meaning
    assert min(abs(event.orbit.joints - [0.0, 0.8, 0.0])[:, 1:].max(axis=1)) < 1e-9
