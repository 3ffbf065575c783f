"""Multipliers of turns of many states: LAPACK's eigenvalues, exact zeros, and determinants."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from numba import types

from contfric.bvp.spectrum import spectrum
from contfric.compiled import f8, kernel, matrix, vector


@kernel(types.UniTuple(f8, 2)(matrix, types.int64, types.complex128[::1], vector, matrix, matrix))
def of(m, rank, out, real, copy, other):
    return spectrum(m, rank, out, real, copy, other)


def turn_of(rng: np.random.Generator, size: int, rank: int, spread: float) -> np.ndarray:
    """A random map of one turn: ``rank`` eigenvalues of very different size, the others zero."""
    eigenvalues = 10.0 ** rng.uniform(-spread, 0.5, rank) * rng.choice([-1.0, 1.0], rank)
    block = np.diag(eigenvalues)
    for k in range(0, rank - 1, 3):  # pairs of complex ones
        block[k, k + 1], block[k + 1, k] = -0.5 * eigenvalues[k], 0.5 * eigenvalues[k]
        block[k + 1, k + 1] = eigenvalues[k]
    q = np.linalg.qr(rng.standard_normal((size, size)))[0]
    whole = np.zeros((size, size))
    whole[:rank, :rank] = block
    whole[:rank, rank:] = rng.standard_normal((rank, size - rank))
    return q @ whole @ q.T


@pytest.mark.parametrize("size", [2, 3, 4, 6, 9, 17, 25])
@pytest.mark.parametrize("seed", range(4))
def test_against_fifty_digits(size: int, seed: int) -> None:
    rng = np.random.default_rng([size, seed])
    rank = int(rng.integers(1, size))
    m = turn_of(rng, size, rank, 2.0)
    out = np.empty(size - 1, dtype=np.complex128)
    one, minus = of(
        m, rank, out, np.empty(size + 1), np.empty((size, size)), np.empty((size, size))
    )
    with mpmath.workdps(50):
        exact = mpmath.matrix(m.tolist())
        eigenvalues = sorted(map(complex, mpmath.eig(exact)[0]), key=abs, reverse=True)[:rank]
        signs = [float(mpmath.det(mpmath.eye(size) + s * exact)) for s in (-1, 1)]
    assert np.all(out[rank:] == 0.0)
    assert np.all(np.diff(np.abs(out)) <= 1e-13 * np.abs(out[0]))
    for value in eigenvalues:  # each once, as far as rounding of the map lets it be known
        assert np.min(np.abs(out[:rank] - value)) < 1e-12 * np.linalg.norm(m, 2)
    sizes = [float(np.prod([1.0 + abs(v) for v in eigenvalues]))] * 2
    assert np.allclose([one, minus], signs, rtol=1e-11, atol=1e-13 * sizes[0])


def test_a_turn_without_numbers_has_infinite_multipliers() -> None:
    m = np.full((5, 5), np.nan)
    out = np.empty(4, dtype=np.complex128)
    of(m, 4, out, np.empty(6), np.empty((5, 5)), np.empty((5, 5)))
    assert np.all(np.isinf(out))
