"""The null vector of a large matrix by inverse iteration: against its singular value decomposition."""

from __future__ import annotations

import numpy as np
import pytest

from contfric.orbit.linear import least_vector


@pytest.mark.parametrize("size", [12, 47, 60, 90])
@pytest.mark.parametrize("least", [0.0, 1e-14, 1e-9])
def test_a_null_vector_is_that_of_the_decomposition(size: int, least: float) -> None:
    draw = np.random.default_rng(size)
    left, right = (np.linalg.qr(draw.standard_normal((size, size)))[0] for _ in range(2))
    sizes = np.concatenate([np.geomspace(50.0, 1e-3, size - 1), [least]])
    found = least_vector(left @ np.diag(sizes) @ right.T)
    assert abs(np.linalg.norm(found) - 1.0) < 1e-14
    assert np.min([np.linalg.norm(found - s * right[:, -1]) for s in (1.0, -1.0)]) < 1e-10


@pytest.mark.parametrize("size", [12, 60])
def test_where_two_vectors_are_null_one_of_them_is_found(size: int) -> None:
    full = np.diag(np.concatenate([np.arange(1.0, size - 1.0), [0.0, 0.0]]))
    found = least_vector(full)
    assert np.linalg.norm(full @ found) < 1e-12
    assert abs(np.linalg.norm(found) - 1.0) < 1e-14
