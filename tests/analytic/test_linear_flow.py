"""The closed form of affine modes against 50 digits: defective, resonant, singular and stiff matrices too."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from dense_linear import SIZE, definition

import contfric as cf

EPS = 2.0**-52
#: Units in the last place, times 1 + the fastest rate times the duration, that a solution may err.
UNITS = 50
#: States of a model of which most of a solution is kept from call to call.
WIDE = 8
#: Places on the way at which the size of a solution is looked at.
PARTS = 8
NONE, NOTHING = np.empty(0, dtype=np.int64), np.empty((0, 0))


def load(path: Path, size: int = SIZE) -> cf.Model:
    """The model of some states; a text in JSON is one in YAML."""
    path.write_text(json.dumps(definition(size)))
    return cf.load_model(path)


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> cf.Model:
    return load(tmp_path_factory.mktemp("models") / "dense-linear.yaml")


@pytest.fixture(scope="module")
def wide(tmp_path_factory: pytest.TempPathFactory) -> cf.Model:
    return load(tmp_path_factory.mktemp("models") / "dense-wide.yaml", WIDE)


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


#: Binary digits of the numbers with a fixed point that references are computed in.
BITS = 320


def fixed(x: Any) -> int:
    """A number with a fixed point: whole multiples of 2**-BITS are exact, and fast."""
    return int(mp.nint(mp.ldexp(mp.mpf(x), BITS)))


def exact(values: Any) -> np.ndarray:
    return np.vectorize(lambda x: fixed(float(x)), otypes=[object])(np.asarray(values))


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a.dot(b) >> BITS


def exponential(m: np.ndarray, dt: float) -> np.ndarray:
    """exp(m dt) by scaling and squaring; 100 digits are far more than what is lost."""
    m = product(m, exact(np.eye(len(m)) * dt))
    squarings = max(0, int(np.abs(m).sum(axis=1).max()).bit_length() - BITS + 4)
    m, found = m >> squarings, exact(np.eye(len(m)))
    term = found
    for k in range(1, 60):  # (1/8)**60 / 60! is nothing
        term = product(term, m) // k
        found = found + term
    for _ in range(squarings):
        found = product(found, found)
    return found


def extended(a: np.ndarray, forces: np.ndarray, w: float) -> np.ndarray:
    """The matrix of (y, 1, cos, sin), shape (n + 3, n + 3)."""
    n = len(a)
    m = np.zeros((n + 3, n + 3))
    m[:n, :n], m[:n, n:] = a, forces
    m[n + 1, n + 2], m[n + 2, n + 1] = -w, w
    return exact(m)


def start(y0: np.ndarray, w: float, t0: float) -> np.ndarray:
    phase = mp.mpf(w) * mp.mpf(t0)
    return np.array([*exact(y0), fixed(1), fixed(mp.cos(phase)), fixed(mp.sin(phase))], object)


def natural(sizes: np.ndarray, fastest: float) -> np.ndarray:
    """The largest values on the way, of displacements and speeds in each other's units.

    Rounding in a force of a stiff spring moves the mass by what it moves it, however slow it is.
    """
    most = sizes.max(axis=0)
    other = [
        most[i + 1] / fastest if i % 2 == 0 else most[i - 1] * fastest for i in range(len(most))
    ]
    return np.maximum(most, other)


def plain(values: np.ndarray) -> np.ndarray:
    return np.array([float(mp.ldexp(int(x), -BITS)) for x in values])


def assert_close(found: np.ndarray, part: np.ndarray, begin: np.ndarray, case: Any) -> None:
    """Compare numbers with the first ones of part**PARTS begin, against their largest values on the way."""
    a, w, dt = case
    n, fastest = len(a), max(float(np.abs(np.linalg.eigvals(a)).max()), w, 1.0)
    at, sizes = begin, [np.abs(plain(begin[:n]))]
    for _ in range(PARTS):
        at = product(part, at)
        sizes.append(np.abs(plain(at[:n])))
    error = np.abs(plain(exact(found) - at[:n]))
    allowed = UNITS * EPS * (1.0 + fastest * abs(dt))
    assert np.all(error <= allowed * natural(np.array(sizes), fastest))


def doubled(m: np.ndarray, entries: dict[tuple[int, int], int]) -> np.ndarray:
    """The matrix whose exponential has the derivative of that of m by some of its entries."""
    n = len(m)
    both = exact(np.zeros((2 * n, 2 * n)))
    both[:n, :n], both[n:, n:] = m, m
    for (i, j), value in entries.items():
        both[i, n + j] = fixed(value)
    return both


def vector_of(model: cf.Model, a: np.ndarray, forces: np.ndarray, w: float) -> np.ndarray:
    """The parameters of a model."""
    n = len(a)
    values = {f"a{i}{j}": a[i, j] for i in range(n) for j in range(n)}
    for i in range(n):
        values |= dict(zip((f"b{i}", f"c{i}", f"s{i}"), forces[i], strict=True))
    return model.vector({**values, "w": w})


@pytest.mark.parametrize("name", [*CASES, *RANDOM])
def test_state_and_derivatives(model, name):
    """By the start, its time, the duration, entries of the matrix, a force and the frequency."""
    case = {**CASES, **RANDOM}[name]
    a, w, dt = case
    rng = np.random.default_rng(len(name))
    forces, y0, t0 = rng.uniform(-1, 1, (SIZE, 3)), rng.uniform(-1, 1, SIZE), rng.uniform(0, 2)
    p = vector_of(model, a, forces, w)
    which = np.array([model.index_of(k) for k in ("a00", "a10", "c1", "w")])
    y1, alone, jac = np.empty(SIZE), np.empty(SIZE), np.empty((SIZE, 2 + SIZE + len(which)))
    model.flow.flow(0, t0, y0, dt, p, which, y1, jac)
    model.flow.flow(0, t0, y0, dt, p, NONE, alone, NOTHING)
    assert np.array_equal(y1, alone)
    n = SIZE + 3
    with mp.workprec(BITS):
        m, at = extended(a, forces, w), start(y0, w, t0)
        part, unit = exponential(m, dt / PARTS), exact(np.eye(n))
        assert_close(y1, part, at, case)
        for j in range(SIZE):
            assert_close(jac[:, 1 + j], part, unit[:, j], case)
        turn = exact(np.zeros((n, n)))  # a later start turns the phase
        turn[SIZE + 1, SIZE + 2], turn[SIZE + 2, SIZE + 1] = fixed(-w), fixed(w)
        assert_close(jac[:, 0], part, product(turn, at), case)
        assert_close(jac[:, 1 + SIZE], part, product(m, at), case)
        turns = {(SIZE + 1, SIZE + 2): -1, (SIZE + 2, SIZE + 1): 1}
        for k, entries in enumerate(({(0, 0): 1}, {(1, 0): 1}, {(1, SIZE + 1): 1}, turns)):
            begin = np.array([fixed(0)] * n + [*at], object)
            if k == 3:  # the phase at the start depends on the frequency, too
                begin[SIZE + 1] = -fixed(t0) * at[SIZE + 2] >> BITS
                begin[SIZE + 2] = fixed(t0) * at[SIZE + 1] >> BITS
            both = exponential(doubled(m, entries), dt / PARTS)
            assert_close(jac[:, 2 + SIZE + k], both, begin, case)


def twice(a: np.ndarray) -> np.ndarray:
    """Two systems next to each other, their states mixed."""
    n = len(a)
    both = np.zeros((2 * n, 2 * n))
    both[:n, :n] = both[n:, n:] = a
    order = [0, 1, n, n + 1, 2, 3, n + 2, n + 3]
    return both[np.ix_(order, order)]


def moved(model: cf.Model, t0: float, y0: np.ndarray, dt: float, p: np.ndarray, *names: str) -> Any:
    """The state after a duration, and its derivatives."""
    which, n = np.array([model.index_of(k) for k in names], dtype=np.int64), len(y0)
    y1, jac = np.empty(n), np.empty((n, 2 + n + len(names)))
    model.flow.flow(0, t0, y0, dt, p, which, y1, jac)
    return y1, jac


@pytest.mark.parametrize("name", [*CASES, *RANDOM])
def test_what_is_kept_errs_no_more(wide, name):
    """Many states: of a solution to 50 digits, whatever was asked before, and by forces and frequencies.

    Responses to unit forces are kept where the frequency is not free, and are found for the forces else.
    """
    a, w, dt = {**CASES, **RANDOM}[name]
    a = twice(a)
    case, rng, n = (a, w, dt), np.random.default_rng(len(name)), WIDE
    forces, y0, t0 = rng.uniform(-1, 1, (n, 3)), rng.uniform(-1, 1, n), rng.uniform(0, 2)
    p = vector_of(wide, a, forces, w)
    first = moved(wide, t0, y0, dt, p, "c1")
    others = vector_of(wide, a + 0.01, forces, w), vector_of(wide, a, 2.0 * forces, 1.1 * w)
    for duration, other in ((1.001 * dt, p), (dt, others[0]), (dt, others[1])):
        moved(wide, t0 + 0.3, -y0, duration, other, "c1", "w")
    y1, jac = moved(wide, t0, y0, dt, p, "c1")
    assert np.array_equal(first[0], y1)
    assert np.array_equal(first[1], jac)
    _, free = moved(wide, t0, y0, dt, p, "c1", "w")
    with mp.workprec(BITS):
        m, at = extended(a, forces, w), start(y0, w, t0)
        part, unit = exponential(m, dt / PARTS), exact(np.eye(n + 3))
        assert_close(y1, part, at, case)
        for j in range(n):
            assert_close(jac[:, 1 + j], part, unit[:, j], case)
        turn = exact(np.zeros((n + 3, n + 3)))
        turn[n + 1, n + 2], turn[n + 2, n + 1] = fixed(-w), fixed(w)
        assert_close(jac[:, 0], part, product(turn, at), case)
        assert_close(jac[:, 1 + n], part, product(m, at), case)
        begin = np.array([fixed(0)] * (n + 3) + [*at], object)
        both = exponential(doubled(m, {(1, n + 1): 1}), dt / PARTS)
        assert_close(jac[:, 2 + n], both, begin, case)
        assert_close(free[:, 2 + n], both, begin, case)
        begin[n + 1], begin[n + 2] = -fixed(t0) * at[n + 2] >> BITS, fixed(t0) * at[n + 1] >> BITS
        both = exponential(doubled(m, {(n + 1, n + 2): -1, (n + 2, n + 1): 1}), dt / PARTS)
        assert_close(free[:, 3 + n], both, begin, case)


def test_threads_share_what_is_kept(wide):
    """Solutions of one model in several threads are those of one thread, to the last bit."""
    rng = np.random.default_rng(5)
    a, forces, y0 = rng.uniform(-1, 1, (WIDE, WIDE)), rng.uniform(-1, 1, (WIDE, 3)), np.ones(WIDE)
    p, durations = vector_of(wide, a, forces, 1.1), [0.2 + 0.013 * k for k in range(300)]
    alone = [moved(wide, 0.4, y0, d, p, "c1")[1] for d in durations]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda d: moved(wide, 0.4, y0, d, p, "c1")[1], durations * 4))
    for k, jac in enumerate(found):
        assert np.array_equal(jac, alone[k % len(durations)])


@pytest.mark.parametrize("seed", range(6))
def test_stationary_points_of_many_states(wide, seed):
    """As many as the rate changes its sign, and its zeros; the same bits whatever was asked before."""
    rng = np.random.default_rng(seed)
    a = twice(rng.uniform(-1, 1, (SIZE, SIZE)) - 0.5 * np.eye(SIZE))
    forces, y0, t0 = rng.uniform(-1, 1, (WIDE, 3)), rng.uniform(-1, 1, WIDE), 0.7
    p, flow = vector_of(wide, a, forces, 2.3), wide.flow
    moved_p = vector_of(wide, a + 0.01, forces, 2.1)
    times, values, y, empty = np.empty(64), np.empty(64), np.empty(WIDE), np.empty(0)
    for observable, dt in ((1, 9.0), (0, 9.0), (1, 4.0), (1, 9.0)):

        def rate(t: float, c: int = observable) -> float:
            flow.flow(0, t0, y0, t, p, NONE, y, NOTHING)
            return float(flow.rate(0, c, t0 + t, y, p, NONE, empty))

        first = flow.stationary(0, observable, t0, y0, dt, p, times, values)
        same = times[:first].copy(), values[:first].copy()
        for other, duration in ((observable, 0.6 * dt), (0, dt), (1, dt)):
            flow.stationary(0, other, t0, -y0, duration, moved_p, times, values)
            flow.stationary(0, other, t0, -y0, duration, p, times, values)
        for _ in range(12):
            found = flow.stationary(0, observable, t0, y0, dt, p, times, values)
        assert found == first
        assert np.array_equal(times[:found], same[0])
        assert np.array_equal(values[:found], same[1])
        signs = np.sign([rate(t) for t in np.linspace(0.0, dt, 1500)])
        assert found == np.count_nonzero(np.diff(signs))
        for k in range(found):
            assert abs(rate(times[k])) < 1e-12 * (1.0 + np.abs(y).max())
            assert values[k] == pytest.approx(
                flow.observe(observable, t0 + times[k], y, p, NONE, empty), abs=1e-13, rel=1e-13
            )


def test_stationary_points_do_not_depend_on_the_steps(wide):
    """Those of a shorter motion are the first ones of a longer one, wherever steps end."""
    rng = np.random.default_rng(1)
    a = twice(rng.uniform(-1, 1, (SIZE, SIZE)) - 0.5 * np.eye(SIZE))
    forces, y0 = rng.uniform(-1, 1, (WIDE, 3)), rng.uniform(-1, 1, WIDE)
    p = vector_of(wide, a, forces, 2.3)
    most, times, values = np.empty(64), np.empty(64), np.empty(64)
    count = wide.flow.stationary(0, 1, 0.7, y0, 9.0, p, most, values)
    for dt in np.geomspace(0.5, 9.0, 700):
        found = wide.flow.stationary(0, 1, 0.7, y0, dt, p, times, values)
        assert found == np.count_nonzero(most[:count] < dt)
        assert np.allclose(times[:found], most[:found], atol=1e-9)
