"""Sines and cosines of several angles at once, against 60 digits and against each other."""

from __future__ import annotations

import math

import mpmath as mp
import numba
import numpy as np
import pytest

from contfric.flow.sines import sines

pytestmark = pytest.mark.filterwarnings("ignore:invalid value")


@numba.njit  # type: ignore[untyped-decorator]
def of_one(a: float) -> tuple[float, ...]:
    """Return sine and cosine."""
    return sines((a,))  # type: ignore[no-any-return]


@numba.njit  # type: ignore[untyped-decorator]
def of_two(a: float, b: float) -> tuple[float, ...]:
    """Return the sines, then the cosines."""
    return sines((a, b))  # type: ignore[no-any-return]


@numba.njit  # type: ignore[untyped-decorator]
def of_three(a: float, b: float, c: float) -> tuple[float, ...]:
    """Return the sines, then the cosines."""
    return sines((a, b, c))  # type: ignore[no-any-return]


def angles() -> np.ndarray:
    """Return angles of all sizes, many of them next to the zeros of sine and cosine."""
    rng = np.random.default_rng(7)
    quarters = rng.integers(-300_000, 300_000, 400) * (0.5 * math.pi)
    return np.concatenate(
        [
            rng.uniform(-10.0, 10.0, 800),
            rng.uniform(-5e5, 5e5, 800),
            10.0 ** rng.uniform(-12.0, 0.0, 400),
            quarters,
            np.nextafter(quarters, np.inf),
        ]
    )


def test_one_unit_in_the_last_place() -> None:
    with mp.workdps(60):
        for x in angles():
            for got, exact in zip(of_one(x), (mp.sin(x), mp.cos(x)), strict=True):
                unit = np.spacing(abs(float(exact)))
                assert abs(mp.mpf(got) - exact) < 0.8 * unit, x


def test_each_place_of_a_vector_is_alike() -> None:
    for x, y in zip(angles(), angles()[::-1], strict=True):
        alone, other = of_one(x), of_one(y)
        assert of_two(x, y) == (alone[0], other[0], alone[1], other[1])
        assert of_three(y, x, x) == (other[0], alone[0], alone[0], other[1], alone[1], alone[1])


@pytest.mark.parametrize("x", [5.1e5, -3e7, 1e22, 1e300])
def test_large_angles(x: float) -> None:
    assert of_one(x) == pytest.approx((math.sin(x), math.cos(x)), abs=1e-16)
    # a large one changes the others by rounding at most
    assert of_two(1.0, x)[::2] == pytest.approx((math.sin(1.0), math.cos(1.0)), abs=2e-16)


@pytest.mark.parametrize("x", [math.inf, -math.inf, math.nan])
def test_no_angle(x: float) -> None:
    assert all(math.isnan(value) for value in of_one(x))


def test_zero() -> None:
    assert of_one(0.0) == (0.0, 1.0)
