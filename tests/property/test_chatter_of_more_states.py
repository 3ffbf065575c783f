"""Chatter of models with a state beside those of the mass: a temperature, an actuator, a second mass.

Limits and their derivatives are compared with impacts one after the other in 40 digits; multipliers with
differences of periods by exponentials of matrices, impact by impact.
"""

from __future__ import annotations

from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from scipy.optimize import brentq
from typed import typed

import contfric as cf

FOLLOWED = """
name: followed
states: [x, v, q]
parameters: {a: 0.9, e: 0.5, k: 1.0, h: 0.1}
period: 2*pi
observables: {gap: x - a*sin(t)}
surfaces: {table: {observable: gap}}
define: {arrives: v - a*cos(t)}
modes: {flight: {in: {table: +}, field: {x: v, v: -1, q: k*(v - q)}}}
resets: {table: {v: (1 + e)*a*cos(t) - e*v, q: q + h*arrives**2, chatter: true}}
spread: {x: 6, v: 3, q: 3}
"""


def limit(p: dict[str, mp.mpf], t: mp.mpf, y: list[mp.mpf]) -> list[mp.mpf]:
    """Return time and states where the impacts after one end, in 40 digits."""
    (x, v, q), a, e, k = y, p["a"], p["e"], p["k"]
    while v - a * mp.cos(t) > mp.mpf(10) ** -19:

        def lowered(s, t=t, x=x, v=v):
            return (x + v * s - s * s / 2 - a * mp.sin(t + s)) / s

        s = 2 * (v - a * mp.cos(t)) * mp.mpf("0.01")
        while lowered(s) > 0:
            s *= mp.mpf("1.2")
        s = mp.findroot(lowered, (s / mp.mpf("1.2"), s), solver="anderson", tol=1e-70)
        q = v - s + 1 / k + (q - v - 1 / k) * mp.exp(-k * s)
        t, x, v = t + s, x + v * s - s * s / 2, v - s
        arrives = v - a * mp.cos(t)
        v, q = v - (1 + e) * arrives, q + p["h"] * arrives**2
    return [t, x, v, q]


@pytest.fixture(scope="module")
def followed(tmp_path_factory) -> cf.Model:
    return typed(tmp_path_factory.mktemp("followed"), FOLLOWED)


@pytest.mark.parametrize("seed", range(10))
def test_the_limit_of_a_state_that_follows_quickly_or_slowly(followed, seed: int) -> None:
    """On a table at rest (a = 0) three impacts give the time of the limit, and not that state."""
    draw = np.random.default_rng(seed)
    p = {
        "a": float(draw.uniform(0.2, 0.9)) if seed % 2 else 0.0,
        "e": float(draw.uniform(0.05, 0.8)),
        "k": float(10.0 ** draw.uniform(-1.0, 2.0)),
        "h": float(draw.uniform(-1.0, 1.0)),
    }
    t, speed, q = (float(draw.uniform(*r)) for r in ((0.0, 6.0), (0.05, 0.3), (-1.0, 1.0)))
    begin = [t, p["a"] * np.sin(t), p["a"] * np.cos(t) + speed, q]
    with mp.workdps(40):
        exact = {name: mp.mpf(value) for name, value in p.items()}
        first = [mp.mpf(t), exact["a"] * mp.sin(t), mp.mpf(begin[2]), mp.mpf(q)]
        ends, step = limit(exact, first[0], first[1:]), mp.mpf(10) ** -12
        slopes = []  # by speed and q; the time and the place keep the ball on its table
        for i in (2, 3):
            moved = [
                limit(exact, first[0], [y + s * (j == i) for j, y in enumerate(first)][1:])
                for s in (step, -step)
            ]
            slopes.append([float((a - b) / (2 * step)) for a, b in zip(*moved, strict=True)])
        rests = float(ends[0] - first[0])
    vector, n = followed.vector(p), 3
    out, jac = np.empty(n), np.empty((n, 2 + n + len(vector)))
    which = np.arange(len(vector))
    m = followed.mode_index["chatter"]
    followed.flow.flow(m, t, np.array(begin[1:]), rests, vector, which, out, jac)
    assert out[2] == pytest.approx(float(ends[3]), abs=2e-12)
    at_rest = jac[
        2, 1 + n
    ]  # the duration is fixed: what moves the limit is lived through in contact
    for column, (by_time, _, _, by_state) in zip((2, 3), slopes, strict=True):
        assert jac[2, column] == pytest.approx(by_state - at_rest * by_time, abs=1e-9, rel=1e-9)


PRESSED = """
name: pressed
states: [x, v, q]
parameters: {w: 0.6, F: 0.8, e: 0.3, c: 0.1, k: 0.5, b: 0.4, g: 0.3}
period: 2*pi/w
surfaces: {wall: {observable: x}}
modes:
  free:
    in: {wall: +}
    field: {x: v, v: -x - c*v - q + F*cos(w*t) - g, q: k*(b*x + b*v - q)}
resets: {wall: {v: -e*v, chatter: true}}
spread: {x: 1, v: 1, q: 0.5}
"""


def moved(matrix: np.ndarray, time: float, state: np.ndarray) -> np.ndarray:
    """Return ``expm(matrix*time) @ state`` by its series: to rounding for what is as short as steps here."""
    assert np.abs(matrix).max() * time < 0.2
    found = state
    for k in range(14, 0, -1):
        found = state + (time / k) * (matrix @ found)
    return found


def one_period(p: dict[str, float], t: float, y: np.ndarray) -> np.ndarray:
    """Return the state of a mass with an actuator a period later, impact by impact."""
    w, end = p["w"], t + 2.0 * np.pi / p["w"]
    free = np.zeros((6, 6))  # of (x, v, q, cos, sin, 1)
    free[0, 1], free[1] = 1.0, [-1.0, -p["c"], -1.0, p["F"], 0.0, -p["g"]]
    free[2, :3] = p["k"] * np.array([p["b"], p["b"], -1.0])
    free[3, 4], free[4, 3] = -w, w
    contact = free.copy()
    contact[:2] = 0.0
    state, rests, slow = np.array([*y, np.cos(w * t), np.sin(w * t), 1.0]), False, 0.0
    while True:
        matrix, row, side = (contact, free[1], 1.0) if rests else (free, np.eye(6)[0], -1.0)
        step = 0.02 if rests or slow > 0.02 else max(slow, 1e-11) * 0.5

        def watched(s, since, state, matrix=matrix, row=row, side=side):
            return side * float(row @ moved(matrix, s - since, state))

        since, before, after = 0.0, 0.0, step
        while t + after < end and watched(after, since, state) < 0.0:
            state, since = moved(matrix, after - since, state), after
            before, after, step = after, after + step, min(0.02, 1.3 * step)
        if t + after >= end and watched(end - t, since, state) < 0.0:
            return moved(matrix, end - t - since, state)[:3]
        if before == 0.0:
            before = 0.01 * after if not rests else 0.0
        lasts = brentq(watched, before, min(after, end - t), args=(since, state), xtol=1e-15)
        state, t = moved(matrix, lasts - since, state), t + lasts
        state[0] = 0.0
        if rests:
            rests, slow = False, 1.0
            # off the wall by the third power of time
            state, t = moved(free, 0.05, state), t + 0.05
            continue
        state[1] *= -p["e"]
        slow = state[1]
        if slow < 1e-8 and free[1] @ state < 0.0:
            state[1], rests = 0.0, True


@pytest.mark.parametrize("seed", range(3))
def test_multipliers_through_chatter_with_an_actuator(seed: int, tmp_path: Path) -> None:
    draw, path = np.random.default_rng(seed), tmp_path / "pressed.yaml"
    path.write_text(PRESSED, encoding="utf-8")
    p = {
        "w": float(draw.uniform(0.45, 0.6)),
        "e": float(draw.uniform(0.1, 0.4)),
        "k": float(draw.uniform(0.1, 0.3)),
        "b": float(draw.uniform(0.2, 1.0)),
    }
    orbit = cf.find_orbit(path, p)
    modes = [mode for mode, _ in orbit.itinerary]
    assert modes.count("chatter") == 1 and orbit.admissible
    i, p = modes.index("free"), dict(orbit.params)
    t, y = orbit.begins[i, 0], orbit.begins[i, 1:]
    middle = 0.5 * (orbit.ends[i, 0] - t)
    state, t = orbit.flow.state("free", t, y, middle), t + middle
    assert one_period(p, t, state) == pytest.approx(state, abs=1e-8)
    h = 1e-4
    turn = np.array(
        [
            (one_period(p, t, state + s) - one_period(p, t, state - s)) / (2 * h)
            for s in h * np.eye(3)
        ]
    ).T
    expected = sorted(np.linalg.eigvals(turn), key=abs)
    assert sorted(orbit.multipliers, key=abs) == pytest.approx(expected, abs=1e-6)
    assert abs(expected[-1]) > 1e-3 and np.count_nonzero(orbit.multipliers) == 1
