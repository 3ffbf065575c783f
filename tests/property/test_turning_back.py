"""A mode that holds on both sides of where it is entered: motion goes on there, or turns back at once.

A ship whose rudder is moved by a switch with a dead band and hysteresis (Nomoto's model). Where the rudder is
held, the switching function may rise or fall: which, depends on the state.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from typed import typed

import contfric as cf

SHIP = """
name: ship
states: [psi, r, rudder]
parameters: {T: 2.0, K: 0.5, db: 0.1, h: 0.02, kr: 0.8, rate: 0.5}
autonomous: true
observables: {s: psi + kr*r + rudder}
surfaces:
  right: {observable: s, level: db}
  left: {observable: s, level: -db}
  right0: {observable: s, level: db - h}
  left0: {observable: s, level: h - db}
modes:
  hold: {in: {right: -, left: +}, field: {psi: r, r: (K*rudder - r)/T, rudder: 0}}
  minus: {in: {right0: +}, field: {psi: r, r: (K*rudder - r)/T, rudder: -rate}}
  plus: {in: {left0: -}, field: {psi: r, r: (K*rudder - r)/T, rudder: rate}}
symmetry: psi -> -psi, r -> -r, rudder -> -rudder
"""


def after(p: dict[str, float], mode: str, y: np.ndarray, time: float) -> np.ndarray:
    """Return the state after a time, by scipy, mode by mode."""
    turn = {"hold": 0.0, "minus": -p["rate"], "plus": p["rate"]}
    ends = {
        "hold": ((p["db"], 1, "minus"), (-p["db"], -1, "plus")),
        "minus": ((p["db"] - p["h"], -1, "hold"),),
        "plus": ((p["h"] - p["db"], 1, "hold"),),
    }
    t = 0.0
    while True:

        def field(_t: float, y: np.ndarray, mode: str = mode) -> list[float]:
            return [y[1], (p["K"] * y[2] - y[1]) / p["T"], turn[mode]]

        events = []
        for level, way, _ in ends[mode]:

            def reached(_t: float, y: np.ndarray, level: float = level) -> float:
                return y[0] + p["kr"] * y[1] + y[2] - level

            reached.terminal, reached.direction = True, way  # type: ignore[attr-defined]
            events.append(reached)
        done = solve_ivp(field, (t, time), y, events=events, rtol=1e-11, atol=1e-13, max_step=0.1)
        t, y = done.t[-1], done.y[:, -1]
        if done.status == 0:
            return y
        mode = next(e[2] for e, met in zip(ends[mode], done.t_events, strict=True) if len(met))


@pytest.mark.parametrize("seed", range(3))
def test_a_held_rudder_turns_the_ship_either_way(tmp_path: Path, seed: int) -> None:
    draw = np.random.default_rng(seed)
    drawn = {"kr": draw.uniform(0.75, 0.95), "rate": draw.uniform(0.4, 0.6)}
    model = typed(tmp_path, SHIP)
    assert {"left0", "right0"} <= {s for mode, s in model.turned_at_times if mode == "hold"}
    orbit, p = cf.find_orbit(model, drawn), model.defaults | drawn
    assert orbit.admissible
    modes = [segment.split(":")[0] for segment in orbit.signature.segments]
    assert modes[0] == "hold" != modes[-1]  # the first joint is where the rudder is held
    again = after(p, "hold", orbit.joints[0, 1:], orbit.period)
    np.testing.assert_allclose(again, orbit.joints[0, 1:], atol=1e-8)
