"""The closed form of affine modes against 50 digits: defective, resonant, singular and stiff matrices too."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "models"))

from dense_linear import SIZE, definition

import contfric as cf

EPS = 2.0**-52
#: Units in the last place, times 1 + the fastest rate times the duration, that a motion may err.
UNITS = 50
NONE, NOTHING = np.empty(0, dtype=np.int64), np.empty((0, 0))


def load(path: Path) -> cf.Model:
    """The model of four states; a text in JSON is one in YAML."""
    path.write_text(json.dumps(definition()))
    return cf.load_model(path)


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> cf.Model:
    return load(tmp_path_factory.mktemp("models") / "dense-linear.yaml")


def oscillators(*pairs: tuple[float, float]) -> np.ndarray:
    """Uncoupled oscillators x'' + 2 zeta sqrt(k) x' + k x, by (k, zeta); their states are (x, v)."""
    a = np.zeros((SIZE, SIZE))
    for i, (k, zeta) in enumerate(pairs):
        a[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = [[0, 1], [-k, -2 * zeta * np.sqrt(k)]]
    return a


def coupled(k: float, c: float) -> np.ndarray:
    """Two unit masses, each on a spring, with a stiff contact between them."""
    a = np.zeros((SIZE, SIZE))
    a[0, 1] = a[2, 3] = 1.0
    a[1] = [-1.0 - k, -0.1 - c, k, c]
    a[3] = [k, c, -1.0 - k, -0.1 - c]
    return a


def jordan(eigenvalue: float, apart: float) -> np.ndarray:
    return np.diag(eigenvalue + apart * np.arange(SIZE)) + np.diag(np.ones(SIZE - 1), 1)


def rigid(coupling: float) -> np.ndarray:
    """Two masses that nothing holds but a spring between them."""
    a = np.zeros((SIZE, SIZE))
    a[0, 1] = a[2, 3] = 1.0
    a[1, 0], a[1, 2], a[3, 0], a[3, 2] = -coupling, coupling, coupling, -coupling
    return a


#: name: matrix, frequency, duration
CASES = {
    "resonance": (oscillators((1.0, 0.0), (4.0, 0.0)), 1.0, 20.0),
    "near resonance": (oscillators((1.0, 0.0), (4.0, 1e-9)), 1.0 + 1e-9, 20.0),
    "critical": (oscillators((1.0, 1.0), (9.0, 1.0)), 0.7, 8.0),
    "nearly critical": (oscillators((1.0, 1.0 - 1e-8), (9.0, 1.0 + 1e-8)), 0.7, 8.0),
    "strongly damped": (oscillators((1.0, 30.0), (1.0, 300.0)), 0.7, 2.0),
    "negative damping": (oscillators((1.0, -0.2), (2.0, -0.01)), 0.7, 9.0),
    "jordan": (jordan(-0.5, 0.0), 1.3, 10.0),
    "nearly jordan": (jordan(-0.5, 1e-8), 1.3, 10.0),
    "zero jordan": (jordan(0.0, 0.0), 1.3, 6.0),
    "rigid body": (rigid(1.0), 0.8, 15.0),
    "free masses": (rigid(0.0), 0.8, 15.0),
    "nothing": (np.zeros((SIZE, SIZE)), 0.8, 30.0),
    "stiff contact": (coupled(1e8, 0.0), 1.0, 1e-3),
    "stiff contact, long": (coupled(1e8, 0.0), 1.0, 0.3),
    "stiff and damped": (coupled(1e8, 2e3), 1.0, 0.1),
    "slow and fast": (oscillators((1e-6, 0.0), (1e4, 0.01)), 3.0, 2.0),
    "fast excitation": (oscillators((1.0, 0.05), (4.0, 0.0)), 40.0, 3.0),
    "backwards": (oscillators((1.0, 0.05), (4.0, 0.0)), 0.9, -5.0),
}
RANDOM = {
    f"random {seed}": (np.random.default_rng(seed).uniform(-1, 1, (SIZE, SIZE)), 1.1, 4.0)
    for seed in range(12)
}


def extended(a: np.ndarray, forces: np.ndarray, w: float) -> mp.matrix:
    """The matrix of (y, 1, cos, sin), shape (n + 3, n + 3)."""
    n = len(a)
    m = mp.zeros(n + 3)
    for i in range(n):
        for j in range(n):
            m[i, j] = mp.mpf(float(a[i, j]))
        for j in range(3):
            m[i, n + j] = mp.mpf(float(forces[i, j]))
    m[n + 1, n + 2], m[n + 2, n + 1] = -mp.mpf(float(w)), mp.mpf(float(w))
    return m


def start(y0: np.ndarray, w: float, t0: float) -> mp.matrix:
    phase = mp.mpf(float(w)) * mp.mpf(float(t0))
    return mp.matrix([*(mp.mpf(float(y)) for y in y0), mp.mpf(1), mp.cos(phase), mp.sin(phase)])


def tolerance(a: np.ndarray, w: float, dt: float) -> float:
    fastest = max(np.abs(np.linalg.eigvals(a)).max(), w)
    return UNITS * EPS * (1.0 + fastest * abs(dt))


def within(found: np.ndarray, want: mp.matrix, largest: np.ndarray, allowed: float) -> bool:
    error = [abs(mp.mpf(float(f)) - x) for f, x in zip(found, want, strict=True)]
    return all(e <= allowed * mp.mpf(float(size)) for e, size in zip(error, largest, strict=True))


def motions(model, name):
    """The case's flow from the compiled module, and what defines it exactly."""
    a, w, dt = {**CASES, **RANDOM}[name]
    rng = np.random.default_rng(len(name))
    forces, y0, t0 = rng.uniform(-1, 1, (SIZE, 3)), rng.uniform(-1, 1, SIZE), rng.uniform(0, 2)
    values = {f"a{i}{j}": a[i, j] for i in range(SIZE) for j in range(SIZE)}
    for i in range(SIZE):
        values |= dict(zip((f"b{i}", f"c{i}", f"s{i}"), forces[i], strict=True))
    return a, forces, w, y0, t0, dt, model.vector({**values, "w": w})


@pytest.mark.parametrize("name", [*CASES, *RANDOM])
def test_state_and_derivatives_by_the_start(model, name):
    a, forces, w, y0, t0, dt, p = motions(model, name)
    y1, jac = np.empty(SIZE), np.empty((SIZE, 2 + SIZE))
    model.flow.flow(0, t0, y0, dt, p, NONE, y1, jac)
    with mp.workdps(50):
        m = extended(a, forces, w)
        steps = 8
        part = mp.expm(m * (mp.mpf(dt) / steps))
        at, map_, sizes = start(y0, w, t0), mp.eye(SIZE + 3), []
        for _ in range(steps):
            sizes.append([abs(x) for x in at[:SIZE]] + [abs(x) for x in map_[:SIZE, :SIZE]])
            at, map_ = part * at, part * map_
        # the largest value on the way: of the state, and of each entry of the exponential
        largest = np.array([[float(x) for x in row] for row in sizes]).max(axis=0)
        here = np.array([float(abs(x)) for x in at[:SIZE]])
        state = np.maximum(largest[:SIZE], here)
        allowed = tolerance(a, w, dt)
        assert within(y1, at[:SIZE], state, allowed)
        for j in range(SIZE):
            column = map_[:SIZE, j]
            size = np.array(
                [max(largest[SIZE + i * SIZE + j], float(abs(column[i]))) for i in range(SIZE)]
            )
            assert within(jac[:, 1 + j], column, np.maximum(size, 1e-300), allowed)
