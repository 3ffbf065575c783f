"""The derivative of a slide by damping, against a convolution in 40 digits, by all of its forms."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

import contfric as cf

RNG = np.random.default_rng(20261125)


def in_digits(
    zeta: float, w: float, h: float, S: float, t0: float, y0: np.ndarray, d: float
) -> list[mp.mpf]:
    """Return d(x, v)/dzeta: the last two components of the linear system of x, v, cos, sin and both slopes.

    The states are x, v, 1, cos(w t), sin(w t), cos(3 w t), sin(3 w t), dx/dzeta and dv/dzeta.
    """
    with mp.workdps(40):
        z, w, h, S, t0, d = (mp.mpf(float(value)) for value in (zeta, w, h, S, t0, d))
        a = mp.zeros(9)
        a[0, 1] = a[7, 8] = 1
        a[1, 0] = a[8, 7] = -1
        a[1, 1] = a[8, 8] = -2 * z
        a[1, 2], a[1, 3], a[1, 5], a[8, 1] = -S, 1, h, -2
        a[3, 4], a[4, 3], a[5, 6], a[6, 5] = -w, w, -3 * w, 3 * w
        state = [*map(mp.mpf, map(float, y0)), mp.mpf(1)]
        state += [mp.cos(w * t0), mp.sin(w * t0), mp.cos(3 * w * t0), mp.sin(3 * w * t0), 0, 0]
        return list(mp.expm(a * d, method="taylor") * mp.matrix(state))[7:]


def drawn(kind: str) -> tuple[float, float, float]:
    """Return damping, frequency and duration of a random slide, anywhere or where closed forms cancel."""
    zeta = float(RNG.choice([0.0, 10 ** RNG.uniform(-4, 0), RNG.uniform(0, 1.3)]))
    w, d = float(RNG.uniform(0.05, 3)), float(RNG.uniform(0.5, 8))
    if kind == "resonance":
        w = float((1 + 10 ** RNG.uniform(-9, -1) * RNG.choice([-1, 1])) / RNG.choice([1, 3]))
        zeta = float(RNG.choice([0.0, 10 ** RNG.uniform(-9, -1)]))
    if kind == "critical":
        zeta = float(1 + RNG.choice([0, 1, -1]) * 10 ** RNG.uniform(-9, -1))
    if (
        kind == "long"
    ):  # G has vanished, next to critical damping the closed form divides by its distance
        zeta = float(1 - 10 ** RNG.uniform(-5, -1))
        d = float(RNG.uniform(1, 100) / np.sqrt(1 - zeta**2) ** RNG.uniform(0, 1))
    if kind == "short":
        d = float(10 ** RNG.uniform(-3, 0.2))
    return zeta, w, d


@pytest.mark.parametrize("kind", ["anywhere", "resonance", "critical", "short", "long"])
def test_the_slope_by_damping_keeps_its_digits(kind: str) -> None:
    flow = cf.load_model("coulomb").flow
    which = np.array([4])
    for _ in range(40):
        zeta, w, d = drawn(kind)
        h, S, t0 = float(RNG.choice([0.0, 0.3])), 0.3, float(RNG.uniform(0, 6))
        y0, y1, jac = RNG.normal(size=2), np.empty(2), np.empty((2, 5))
        flow.flow(0, t0, y0, d, np.array([w, S, 0.4, h, zeta]), which, y1, jac)
        load = abs(y0[0] + S) + 1.0 + h
        # what x and v are made of, by their powers of d; free motion may grow with d at resonance
        sizes = (
            load * min(d**3 / 6, d) + abs(y0[1]) * min(d**2 / 2, d),
            load * min(d**2 / 2, d) + abs(y0[1]) * d,
        )
        exact = in_digits(zeta, w, h, S, t0, y0, d)
        for value, true, size in zip(jac[:, 4], exact, sizes, strict=True):
            assert abs(value - float(true)) < 1e-13 * size, (zeta, w, d, h)
