"""Kernels and helpers: helpers are parts of kernels, and nothing by themselves."""

from __future__ import annotations

import math

import numpy as np
import pytest

from contfric.compiled import allocating_helper, f8, helper, kernel
from contfric.inlined import part_options


@helper
def square(x):
    return x * x


@helper
def fourth(x):
    return square(square(x))


@allocating_helper
def total(n, x):
    values = np.empty(n)
    for i in range(n):
        values[i] = fourth(x) + i
    return values.sum()


def twice(x):
    """Stand for an entry point."""
    return 2.0 * total(3, x) + math.sqrt(square(x))


@pytest.fixture
def fresh_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("CONTFRIC_CACHE_DIR", str(tmp_path))
    return tmp_path


def test_a_kernel_contains_its_helpers(fresh_cache):
    first, second = kernel(f8(f8))(twice), kernel(f8(f8))(twice)
    assert first(1.5) == 2.0 * (3 * 1.5**4 + 3) + 1.5
    assert any(fresh_cache.rglob("*.nbc"))
    assert second(1.5) == first(1.5)  # this one is loaded
    assert sum(second.dispatcher.stats.cache_hits.values()) == 1


def test_helpers_are_not_compiled_by_themselves(fresh_cache):
    assert part_options(), (
        "numba has changed: helpers are compiled in its own way, in twice the time"
    )
    kernel(f8(f8))(twice).dispatcher  # noqa: B018 (compiles)
    for part in (square, fourth, total):
        (result,) = part.overloads.values()
        assert result.library.get_pointer_to_function(result.fndesc.mangled_name) == 0
