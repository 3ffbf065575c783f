"""The pencil of a turn against LAPACK's QR factorisation, and against the product of the maps."""

from __future__ import annotations

import numpy as np
import pytest

from contfric.bvp.pencil import turn_pencil


def pencil_of(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    out = np.empty((2, *a.shape[1:]))
    turn_pencil(a, b, out)
    return out


def by_lapack(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Take each inner joint out by the last rows of the transposed Q of the two blocks on it."""
    m = a.shape[1]
    p, q = a[0], b[0]
    for i in range(1, len(a)):
        rest = np.linalg.qr(np.vstack([q, a[i]]), mode="complete")[0][:, m:].T
        p, q = rest[:, :m] @ p, rest[:, m:] @ b[i]
    return np.stack([p, q])


@pytest.mark.parametrize("m", [1, 2, 3, 5])
@pytest.mark.parametrize("count", [1, 2, 7, 30])
def test_it_is_that_of_lapack(m: int, count: int) -> None:
    a, b = np.random.default_rng([m, count]).normal(size=(2, count, m, m))
    if count > 2:
        a[1] = b[0] = 0.0  # nothing to reflect
    found = pencil_of(a, b)
    assert found == pytest.approx(by_lapack(a, b), abs=1e-13 * count)


@pytest.mark.parametrize("seed", range(10))
def test_its_eigenvalues_are_those_of_the_turn(seed: int) -> None:
    """``a_i z_i + b_i z_{i+1} = 0`` maps z_0 to z_N by the product of ``-b_i^{-1} a_i``."""
    rng = np.random.default_rng(seed)
    count, m = int(rng.integers(1, 9)), int(rng.integers(1, 5))
    a, b = rng.normal(size=(2, count, m, m)) + 2.0 * np.eye(m)
    turn = np.eye(m)
    for i in range(count):
        turn = -np.linalg.solve(b[i], a[i]) @ turn
    p, q = pencil_of(a, b)
    condition = np.linalg.cond(q) * np.prod([np.linalg.cond(x) for x in b])
    scale = float(np.max(np.abs(turn)))
    assert -np.linalg.solve(q, p) == pytest.approx(turn, abs=1e-14 * condition * scale)
