"""What rests on one wall and is carried against another; angles and continua that are said; blow-ups."""

from __future__ import annotations

import math
import random
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from typed import typed

import contfric as cf

VALVE = """
name: valve
states: [x, v]
parameters: {k: 4.0, p: 1.0, h: 1.0, lash: 0.2, W: 2.0, e: 0.3, es: 0.4}
period: 2*pi/W
surfaces:
  cam: {observable: x + lash - h*(1 - cos(W*t))/2}
  seat: {observable: x}
modes: {free: {in: {cam: +, seat: +}, field: {x: v, v: -k*x - p}}}
resets:
  cam: {v: (1 + e)*h*W*sin(W*t)/2 - e*v, chatter: true}
  seat: {v: -es*v, chatter: true}
"""


class Valve:
    """The same valve in closed form, stepped from impact to impact; on the cam once impacts are slow."""

    def __init__(self, W: float, e: float, es: float, lash: float) -> None:
        self.W, self.e, self.es, self.lash = W, e, es, lash

    def cam(self, t: float) -> tuple[float, float, float]:
        c, s = math.cos(self.W * t), math.sin(self.W * t)
        return (1.0 - c) / 2.0 - self.lash, self.W * s / 2.0, self.W**2 * c / 2.0

    @staticmethod
    def flown(x: float, v: float, s: float) -> tuple[float, float]:
        a, c, d = x + 0.25, math.cos(2.0 * s), math.sin(2.0 * s)
        return a * c + v / 2.0 * d - 0.25, -2.0 * a * d + v * c

    def flight(self, t: float, x: float, v: float) -> tuple[float, float, float, bool]:
        """Return time, state and whether the cam is met, where a flight ends."""

        def least(s: float) -> float:
            at = self.flown(x, v, s)[0]
            return min(at, at - self.cam(t + s)[0])

        before, step = 1e-12, 1e-8
        while least(before + step) > 0.0:
            before, step = before + step, min(1.5 * step, 2e-3)
        s = brentq(least, before, before + step, xtol=1e-16) if least(before) > 0.0 else before
        x, v = self.flown(x, v, s)
        return t + s, x, v, x - self.cam(t + s)[0] < x

    def turn(self, t: float, x: float, v: float) -> tuple[float, float]:
        """Return (time, speed) at which a valve that rests on the cam is carried against the seat."""
        for _ in range(1000):
            t, x, v, on_cam = self.flight(t, x, v)
            below, speed, _ = self.cam(t)
            if not on_cam and abs(v) < 1e-8:  # it rests on the seat, until the cam comes up again
                up = math.acos(1.0 - 2.0 * self.lash) / self.W
                t += (up - t) % (2.0 * math.pi / self.W)
                x, v = 0.0, (1.0 + self.e) * self.cam(t)[1]
            elif not on_cam:
                x, v = max(x, 0.0), -self.es * v
            elif abs(v - speed) > 1e-8:
                x, v = max(x, below), speed - self.e * (v - speed)
            else:  # it rests, where the cam is pressed to it
                after = t
                while self.cam(after)[0] > 0.0:
                    height, _, acceleration = self.cam(after)
                    assert acceleration + 4.0 * height + 1.0 > 0.0
                    after += 1e-3
                met = brentq(lambda s: self.cam(s)[0], after - 1e-3, after, xtol=1e-15)
                return met, self.cam(met)[1]
        raise AssertionError("it does not come to rest on the cam")


@pytest.mark.parametrize("seed", range(3))
def test_a_valve_that_rests_on_its_cam_meets_its_seat(tmp_path: Path, seed: int) -> None:
    """The impact throws it off the cam: 'cam' and 'seat' were said to be hit at the same time."""
    draw = random.Random(seed)
    W, e, es = draw.uniform(1.9, 2.1), draw.uniform(0.1, 0.35), draw.uniform(0.2, 0.45)
    orbit = cf.find_orbit(typed(tmp_path, VALVE), {"W": W, "e": e, "es": es}, state=(1.0, 0.2))
    assert orbit.converged and orbit.admissible
    met = orbit.ends[[i for i, s in enumerate(orbit.itinerary) if s == ("chatter_cam", "seat")]]
    valve = Valve(W, e, es, 0.2)
    later = np.vstack([met[1:], met[:1] + np.array([orbit.period, 0.0, 0.0])])
    for (t, x, v), (again, _, speed) in zip(met, later, strict=True):  # impact by impact
        assert x == pytest.approx(0.0, abs=1e-12)
        assert valve.turn(t, 0.0, -es * v) == pytest.approx((again, speed), abs=1e-9)


PENDULUM = """
name: pendulum
states: [th, w]
parameters: {{c: 0.2, A: {A}, W: 0.7, M: {M}, d: 0.5}}
period: 2*pi/W
{surfaces}
modes: {{free: {{{sides}field: {{th: w, w: "M - c*w - {load} + A*cos(W*t)"}}}}}}
"""
WALL = "surfaces: {{wall: {{observable: {}}}}}\nresets: {{wall: {{w: -0.7*w}}}}"


def pendulum(folder: Path, A: float, M: float, wall: str = "", load: str = "sin(th)") -> cf.Model:
    surfaces, sides = (WALL.format(wall), "in: {wall: -}, ") if wall else ("", "")
    return typed(folder, PENDULUM.format(A=A, M=M, surfaces=surfaces, sides=sides, load=load))


def notes(model: cf.Model) -> str:
    return " ".join(str(f) for f in cf.check_model(model).findings if "a turn (2 pi)" in str(f))


@pytest.mark.parametrize(
    ("A", "M", "wall", "says"),
    [(1.0, 0.8, "", "angles: [th]"), (1.5, 0.0, "th - d", "sin((th - wall)/2)")],
)
def test_an_angle_that_is_not_declared_is_named(tmp_path: Path, A, M, wall, says) -> None:
    """It took a minute to "grows without bound", and `check` said nothing."""
    model = pendulum(tmp_path, A, M, wall)
    assert says in notes(model)
    with pytest.raises(cf.ConvergenceError, match="goes round and round") as refused:
        cf.find_orbit(model)
    assert says in str(refused.value)
    turns = np.abs(refused.value.result.states[-1, 0]) / (2.0 * np.pi)
    assert turns > 8


def test_what_is_no_angle_is_not_called_one(tmp_path: Path) -> None:
    """A load that is no sine; a wall met in each turn; a declared angle; a state that does not matter."""
    assert not notes(pendulum(tmp_path, 0.5, 0.0, load="sin(th) - 0.1*th"))
    assert not notes(pendulum(tmp_path, 0.5, 0.0, load="0.3"))
    assert not notes(cf.load_model("pendulum"))
    walled = pendulum(tmp_path, 1.5, 0.0, "sin((th - d)/2)")
    assert not notes(walled) and cf.find_orbit(walled).converged


SIGMA_DELTA = """
name: sigma_delta
states: [u]
parameters: {x: 0.3, Ts: 1.0}
period: Ts
surfaces: {zero: {observable: u}}
modes: {plus: {field: {u: x - 1}}, minus: {field: {u: x + 1}}}
resets: {tick: {to: {plus: {zero: +}, minus: {zero: -}}}}
"""


@pytest.mark.parametrize(("up", "of"), [(3, 5), (5, 7), (13, 20)])
def test_a_continuum_at_one_value_is_said_to_be_one(tmp_path: Path, up: int, of: int) -> None:
    """A sigma-delta modulator of x = 2 up/of - 1: u -> u + x - sgn u takes values that are 2/of apart."""
    x = 2.0 * up / of - 1.0
    orbit = cf.find_orbit(typed(tmp_path, SIGMA_DELTA), {"x": x})
    ticks = sum(surface == "tick" for _, surface in orbit.itinerary)
    assert ticks == of and orbit.degenerate
    diagram = cf.explore(orbit, "x", (x - 0.05, x + 0.05))
    [branch] = diagram.branches
    assert np.ptp(branch.values) < 1e-12 and "a continuum of orbits" in branch.notes[0]
    # each sample may move until the first of them changes its sign
    width = np.ptp([point.joints[0, 1] for point in branch])
    assert width == pytest.approx(2.0 / of, rel=1e-6)


NEURON = """
name: neuron
states: [V, w]
parameters: {I: 1.0, b: 0.5, top: 24.0}
autonomous: true
surfaces: {spike: {observable: V, level: top}}
modes: {rest: {in: {spike: -}, field: {V: exp(V) - V + I - w, w: -w/3}}}
resets: {spike: {V: -1.0, w: w + b}}
spread: {V: [-2, 1], w: [0, 3]}
"""


@pytest.mark.parametrize("top", [23.0, 25.0])
def test_a_blow_up_is_found_again_on_its_branch(tmp_path: Path, top: float) -> None:
    """A guess of an orbit overshoots its threshold to infinity: its branch was said to be missing."""
    orbit = cf.find_orbit(typed(tmp_path, NEURON), {"top": top})
    diagram = cf.explore(orbit, "I", (0.7, 1.6))
    assert diagram.verify(restarts=1).passed
