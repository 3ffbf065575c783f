"""Units that balance a matrix: steps of a solution are as long as its largest rate lets them be."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.flow.linear.system import growth


def rate_and_spread(matrix: FloatArray) -> tuple[float, float]:
    """Return the rate of a matrix in units that make it small, and the largest ratio of these."""
    off = np.abs(matrix - np.diag(np.diag(matrix)))

    def sums(piece: int, co: Any, units: Any, row: Any, column: Any, own: Any) -> None:
        row += off @ units
        column += off.T @ (1.0 / units)
        own += np.abs(np.diag(matrix))

    system = SimpleNamespace(work=np.empty((6, len(matrix))), co=None)
    rate, spread = growth.py_func(SimpleNamespace(sums=sums), 0, system)
    return float(rate), float(spread)


def masses(stiffness: FloatArray, damping: FloatArray) -> FloatArray:
    """Return the matrix of masses of 1 on springs, coordinates first."""
    n = len(stiffness)
    return np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -damping]])


def test_modes_of_any_frequencies_take_steps_of_the_fastest_one() -> None:
    """A sweep that changes both units of a pair by all that is missing swaps them: 400 times as fast."""
    rng = np.random.default_rng(0)
    for _ in range(200):
        n = int(rng.integers(2, 13))
        frequencies, ratio = 10.0 ** rng.uniform(-2.0, 4.0, n), float(rng.uniform(0.0, 0.1))
        matrix = masses(np.diag(frequencies**2), np.diag(2.0 * ratio * frequencies))
        rate, spread = rate_and_spread(matrix)
        fastest = frequencies.max()
        assert fastest * (1.0 - 1e-12) <= rate < 2.0 * (1.0 + 2.0 * ratio) * fastest
        assert spread <= 1e12


def test_rates_of_random_structures_bound_them_and_are_near() -> None:
    rng = np.random.default_rng(1)
    for _ in range(200):
        n = int(rng.integers(2, 13))
        springs = 10.0 ** rng.uniform(-1.0, 3.0, n)
        stiffness = np.diag(springs + np.append(springs[1:], 0.0))
        stiffness -= np.diag(springs[1:], 1) + np.diag(springs[1:], -1)
        matrix = masses(stiffness, 1e-3 * stiffness)
        rate, _ = rate_and_spread(matrix)
        fastest = np.abs(np.linalg.eigvals(matrix)).max()
        assert fastest * (1.0 - 1e-12) <= rate < 4.0 * fastest


def test_what_nothing_holds_has_a_bounded_spread() -> None:
    """Free bodies, and couplings of 1e-30: units stay within what the terms of a series allow for."""
    rng = np.random.default_rng(2)
    for weak in (0.0, 1e-30, 1e-12):
        n = int(rng.integers(2, 7))
        rate, spread = rate_and_spread(masses(weak * np.eye(n), np.zeros((n, n))))
        assert rate <= 1.0 and spread <= 1e12
