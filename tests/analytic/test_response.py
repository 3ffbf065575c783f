"""The closed-form flow against a reference of 150 digits with formulas of its own.

The reference is the method of undetermined coefficients as in a textbook, with ``1/(1 - w^2 + 2 i zeta w)``
and ``exp(lambda d)`` as they stand. It is singular at resonance without damping and at critical damping;
there (and only there: doubles are never nearer than 1e-17 otherwise) the parameter is moved by 1e-45,
which changes the solution by as much, and the digits that cancel are there to be spent. A matrix
exponential, which knows no singular case, holds the reference itself.
"""

from __future__ import annotations

import math
from itertools import islice, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpc, mpf

from contfric.flow.oscillator.flow import flow

DIGITS = 150
EPS = np.finfo(float).eps
STICK = 2

ZETAS = (0.0, 1e-12, 1e-6, 0.05, 0.999999, 1.0, 1.000001, 3.0, -0.05)
NEAR = (1e-15, 1e-12, 1e-9, 1e-6, 1e-3)
OMEGAS = (
    *(0.02, 0.1, 0.5, 0.7, 1.7, 5.0, 1.0, 1 / 3),
    *(1.0 + sign * e for e in NEAR for sign in (1, -1)),
    *(1 / 3 + sign * e for e in NEAR for sign in (1, -1)),
)
DURATIONS = (1e-14, 1e-9, 1e-4, 0.03, 0.4, 2.0, 7.0, 20.0, -0.4, -3.0)


def textbook(s, omega, S, h, zeta, t0, x0, v0, d):
    """(x, v) after a slide of duration d in direction s."""
    tiny = mpf(10) ** -45
    omega, S, h, zeta, t0, x0, v0, d = map(mpf, (omega, S, h, zeta, t0, x0, v0, d))
    if zeta in (1, -1):
        zeta += tiny
    if zeta == 0 and omega in (1, mpf(1) / 3):
        omega += tiny

    def particular(t):
        x, v = -s * S, mpf(0)
        for k, size in ((1, mpf(1)), (3, h)):
            w = k * omega
            turn = size * mp.expj(w * t) / (1 - w * w + 2j * zeta * w)
            x, v = x + turn.real, v + (1j * w * turn).real
        return x, v

    xp, vp = particular(t0)
    a, b = x0 - xp, v0 - vp
    root = mp.sqrt(mpc(zeta * zeta - 1))
    one, two = -zeta + root, -zeta - root
    c1, c2 = (b - two * a) / (one - two), (one * a - b) / (one - two)
    e1, e2 = c1 * mp.exp(one * d), c2 * mp.exp(two * d)
    xp, vp = particular(t0 + d)
    return xp + (e1 + e2).real, vp + (one * e1 + two * e2).real


def by_matrix(s, omega, S, h, zeta, t0, x0, v0, d):
    """The same by the exponential of the matrix of (x, v, cos, sin, cos 3, sin 3, 1)."""
    w = mpf(omega)
    m = mp.zeros(7)
    m[0, 1] = 1
    m[1, 0], m[1, 1], m[1, 2], m[1, 4], m[1, 6] = -1, -2 * mpf(zeta), 1, mpf(h), -s * mpf(S)
    m[2, 3], m[3, 2], m[4, 5], m[5, 4] = -w, w, -3 * w, 3 * w
    t = w * mpf(t0)
    start = mp.matrix([x0, v0, mp.cos(t), mp.sin(t), mp.cos(3 * t), mp.sin(3 * t), 1])
    end = mp.expm(m * mpf(d)) * start
    return end[0], end[1]


def advance(mode, p, t0, y0, d, which=None):
    """State after a duration, and derivatives (t0, x0, v0, dt, parameters) if asked for."""
    y1 = np.empty(2)
    jac = np.empty((2, 4 + len(which))) if which is not None else np.empty((0, 0))
    flow(
        mode,
        t0,
        np.array(y0),
        d,
        np.array(p),
        np.array(which or [], dtype=np.int64),
        y1,
        jac,
    )
    return y1, jac


def vector(omega, S, h, zeta):
    return [omega, S, 1.3 * S, h, zeta]


def rounding(omega, h, zeta, t0, d):
    """The error that the arguments alone cost: half a unit in the last place of each phase, times the
    amplitude (1 + |h|) of the force and the growth of the response to it (d, at resonance), and of
    the free solution (backwards in time, or with negative damping)."""
    fastest = 3 * omega if h else omega
    rate = max(r.real for r in (np.roots([1, 2 * zeta, 1]) * d))
    growth = (1 + abs(d)) * math.exp(max(0.0, rate))
    return EPS * (1 + abs(h)) * growth * (1 + (fastest + 1) * abs(d) + omega * t0)


def cases(seed):
    """Every damping with every frequency, each with a few durations and random states."""
    rng = np.random.default_rng(seed)
    for zeta, omega in product(ZETAS, OMEGAS):
        for d in rng.choice(DURATIONS, 3, replace=False):
            phase = rng.uniform(0, 2 * math.pi)
            yield (
                int(rng.integers(2)),
                (omega, rng.uniform(0, 1), float(rng.choice([0.0, 0.4, -1.3])), zeta),
                (phase / omega, *rng.uniform(-1.5, 1.5, 2), float(d)),
            )


def worst_of(errors):
    """(ratio, description) of the largest error."""
    return max(errors, key=lambda pair: pair[0])


@pytest.mark.parametrize("zeta", ZETAS)
@pytest.mark.parametrize("omega", [1.0, 1 / 3, 0.6, 1 + 1e-12])
def test_reference_agrees_with_the_matrix_exponential(omega: float, zeta: float) -> None:
    # (-1, Omega, S, h, zeta, t0, x0, v0, d); 40 digits, the moved parameter costs no more
    args = (-1, omega, 0.3, 0.4, zeta, 1.7, 0.9, -0.4, 2.5)
    with mp.workdps(DIGITS):
        by_textbook = textbook(*args)
    with mp.workdps(60):
        gap = max(abs(a - b) for a, b in zip(by_textbook, by_matrix(*args), strict=True))
    assert gap < mpf(10) ** -40


def test_state() -> None:
    # Measured over 15 000 cases of twenty seeds: the largest ratio is 1.1, the largest error 7e-14
    # (at resonance after a duration of 20, where the response has grown to 10).
    errors = []
    with mp.workdps(DIGITS):
        for mode, params, (t0, x0, v0, d) in cases(seed=1):
            exact = textbook(1 - 2 * mode, *params, t0, x0, v0, d)
            got, _ = advance(mode, vector(*params), t0, (x0, v0), d)
            error = max(abs(float(a - b)) for a, b in zip(got, exact, strict=True))
            ratio = error / rounding(params[0], *params[2:], t0, d)
            errors.append((ratio, (params, t0, x0, v0, d)))
    ratio, where = worst_of(errors)
    assert ratio < 2.0, where


@pytest.mark.parametrize("zeta", ZETAS)
@pytest.mark.parametrize("d", [1e-14, 1e-12, 1e-9, 1e-6, 1e-3])
def test_increments_of_short_durations(zeta: float, d: float) -> None:
    """From x = v = 0 nothing hides the increments: v is good to rounding, relative to itself; x, which
    is of order d^2, to rounding of d."""
    rng = np.random.default_rng(5)
    for omega in (1.0, 1 / 3, 0.02, 0.7, 5.0):
        t0 = rng.uniform(0, 2 * math.pi) / omega
        for mode, h in product((0, 1), (0.0, 0.4)):
            params = (omega, 0.3, h, zeta)
            with mp.workdps(DIGITS):
                x, v = textbook(1 - 2 * mode, *params, t0, 0, 0, d)
            (got_x, got_v), _ = advance(mode, vector(*params), t0, (0.0, 0.0), d)
            # relative to d (the friction and the force are of order one), hence to v itself
            assert abs(float(got_v - v)) < 20 * EPS * d
            assert abs(float(got_x - x)) < 20 * EPS * d


@pytest.mark.parametrize("d", [1e-12, 1e-6, 0.3, 5.0])
def test_nothing_moves_where_nothing_acts(d: float) -> None:
    # no friction, force cos(t/2) from its zero: v(0) = 0, a(0) = 0, so that v is of order d^2
    y1, _ = advance(0, vector(0.5, 0.0, 0.0, 0.0), math.pi, (0.0, 0.0), d)
    with mp.workdps(DIGITS):
        exact = textbook(1, 0.5, 0, 0, 0, math.pi, 0, 0, d)
    assert abs(float(y1[1] - exact[1])) < 4 * EPS * max(d, d * d)


DERIVATIVES = {  # name: (place among the arguments of textbook, column of jac)
    **{"t0": (4, 0), "x0": (5, 1), "v0": (6, 2), "dt": (7, 3)},
    **{"Omega": (0, 4), "S": (1, 5), "h": (2, 7), "zeta": (3, 8)},
}


@pytest.mark.parametrize("name", DERIVATIVES)
def test_derivative(name: str) -> None:
    # Central differences with a step of 1e-25 in 150 digits: good to 1e-45. Measured over all cases:
    # the largest error is 1e-13 for zeta (repeated squaring), 5e-14 for the others.
    place, column = DERIVATIVES[name]
    limit = 5e-13 if name == "zeta" else 2e-13
    step = mpf(10) ** -25
    errors = []
    with mp.workdps(DIGITS):
        for mode, params, rest in islice(cases(seed=2), 0, None, 3):  # each pair of them once
            t0, x0, v0, d = rest
            _, jac = advance(mode, vector(*params), t0, (x0, v0), d, [0, 1, 2, 3, 4])
            up, down = ([mpf(a) for a in (*params, *rest)] for _ in range(2))
            up[place] += step
            down[place] -= step
            pair = zip(textbook(1 - 2 * mode, *up), textbook(1 - 2 * mode, *down), strict=True)
            for row, (a, b) in enumerate(pair):
                exact = float((a - b) / (2 * step))
                error = abs(jac[row, column] - exact) / (1 + abs(exact))
                errors.append((error, (row, params, rest)))
    worst, where = worst_of(errors)
    assert worst < limit, where


def test_derivatives_of_which_nothing_depends() -> None:
    _, jac = advance(0, vector(0.7, 0.3, 0.4, 0.1), 0.3, (0.1, 0.2), 1.0, [2])
    assert np.all(jac[:, 4] == 0.0), "a slide does not know S0"
    y1, jac = advance(STICK, vector(0.7, 0.3, 0.4, 0.1), 0.3, (0.1, 0.2), 1.0, [0, 1, 2, 3, 4])
    assert y1.tolist() == [0.1, 0.0]
    expected = np.zeros((2, 9))
    expected[0, 1] = 1.0
    assert np.array_equal(jac, expected)


@pytest.mark.parametrize("zeta", [30.0, 300.0])
def test_strong_damping_neither_overflows_nor_cancels(zeta: float) -> None:
    params, rest = (0.5, 0.3, 0.4, zeta), (1.2, 0.9, -0.7, 20.0)
    with mp.workdps(DIGITS):
        exact = textbook(1, *params, *rest)
    got, _ = advance(0, vector(*params), rest[0], rest[1:3], rest[3])
    assert float(max(abs(a - b) for a, b in zip(got, exact, strict=True))) < 1e-14


finite = st.floats(-2, 2)


@given(
    st.floats(0.02, 5),
    st.sampled_from(ZETAS),
    st.sampled_from([0.0, 0.4, -1.3]),
    st.tuples(finite, finite),
    st.floats(0, 6.3),
    st.floats(0, 6),
    st.floats(0, 6),
)
def test_one_slide_is_two_slides(omega, zeta, h, y0, phase, d1, d2) -> None:
    p, t0 = vector(omega, 0.3, h, zeta), phase / omega
    whole, _ = advance(0, p, t0, y0, d1 + d2)
    middle, _ = advance(0, p, t0, y0, d1)
    parts, _ = advance(0, p, t0 + d1, middle, d2)
    limit = 10 * rounding(omega, h, zeta, t0, d1 + d2)
    assert np.max(np.abs(whole - parts)) < limit
