"""Chatter in any of several modes: a print hammer whose coil is switched while it rests on its anvil."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import brentq
from typed import typed

import contfric as cf

#: A hammer on a spring that presses it to its stop, thrown by a pulse; later another current holds it.
HAMMER = """
name: hammer
states: [x, v]
parameters: {c: 0.1, F: 0.6, H: -0.2, T: 16.0, on: 1.8, hold: 14.5, pre: 0.3, e: 0.5}
period: T
surfaces:
  back: {observable: x}
  off: {observable: "mod(t, T)", level: on}
  switch: {observable: "mod(t, T)", level: hold}
modes:
  driven: {in: {off: -, back: +}, field: {x: v, v: -x - pre - c*v + F}}
  free: {in: {off: +, switch: -, back: +}, field: {x: v, v: -x - pre - c*v}}
  held: {in: {switch: +, back: +}, field: {x: v, v: -x - pre - c*v + H}}
resets: {back: {v: -e*v, chatter: true}}
"""
PRE, C, E = 0.3, 0.1, 0.5


def flight(x: float, v: float, force: float) -> Callable[[float], tuple[float, float]]:
    """Return displacement and speed of the damped oscillator after a time."""
    w, at = np.sqrt(1.0 - C**2 / 4.0), force - PRE
    a, b = x - at, (v + C / 2.0 * (x - at)) / w

    def after(t: float) -> tuple[float, float]:
        cos, sin, fade = np.cos(w * t), np.sin(w * t), np.exp(-C / 2.0 * t)
        moved = fade * (a * cos + b * sin)
        return at + moved, -C / 2.0 * moved + w * fade * (b * cos - a * sin)

    return after


def at_rest(x: float, v: float, t: float) -> float:
    """Return the time at which impacts with the stop have come to rest, flight by flight."""
    while True:
        fly = flight(x, v, 0.0)
        step = 1e-3 if x > 0.0 else min(1e-3, 0.5 * v / PRE)
        while fly(step)[0] > 0.0:
            step *= 1.2
        low = step / 1.2
        end = brentq(lambda s, fly=fly: fly(s)[0], low, step, xtol=1e-16)
        t, x, v = t + end, 0.0, -E * fly(end)[1]
        if v < 1e-9:
            return t + 2.0 * v / PRE / (1.0 - E)


def test_contact_goes_on_where_a_coil_is_switched(tmp_path) -> None:
    """The hammer comes to rest in one mode, is held in the next, and is thrown at the tick."""
    model = typed(tmp_path, HAMMER)
    assert [c.mode for c in model.chatters] == ["chatter_driven", "chatter_free", "chatter_held"]
    assert cf.check_model(model).ok
    orbit = cf.find_orbit(model, state=[0.5, 0.0])
    joints = " -> ".join(map(str, (orbit.signature,)))
    assert "chatter_free -> chatter_held -> reset@tick" in joints
    assert orbit.period == pytest.approx(16.0, rel=1e-12)
    assert np.max(np.abs(orbit.multipliers)) < 1e-9  # it begins at rest, whatever was before
    x, v = flight(0.0, 0.0, 0.6)(1.8)
    rest = at_rest(x, v, 1.8)
    assert 1.8 < rest < 14.5
    peak = max(flight(x, v, 0.0)(s)[0] for s in np.linspace(0.0, 2.0, 40001))
    assert orbit.quantity("max(x)") == pytest.approx(peak, abs=1e-8)


def test_contact_ends_at_once_where_it_is_pulled(tmp_path) -> None:
    """A current that is stronger than the spring lifts the hammer where it is switched on."""
    model = typed(tmp_path, HAMMER)
    found = cf.simulate(model, {"H": 0.5}, state=[0.0, 0.0], periods=0.99)
    modes = [mode for mode, _ in found.itinerary]
    assert ("chatter_free", "switch") in found.itinerary
    assert found.last[2][:2] == pytest.approx(flight(0.0, 0.0, 0.5)(0.99 * 16.0 - 14.5), abs=1e-10)
    assert "chatter_held" not in modes
