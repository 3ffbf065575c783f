"""The error of an averaged exponent falls with the square root of the periods, and is never too small."""

from __future__ import annotations

import numpy as np

import contfric as cf

PARAMS = {"Omega": 0.35, "S": 0.05, "S0": 0.4}


def test_error_falls_with_the_square_root() -> None:
    lengths = 500 * 4 ** np.arange(5)
    found = [
        cf.lyapunov_exponent("coulomb", PARAMS, periods=int(n), tolerance=0.0) for n in lengths
    ]
    slope = np.polyfit(np.log(lengths), np.log([f.error for f in found]), 1)[0]
    # each error is known to about a fifth (16 to 32 batches), and so the slope to about 0.07
    assert abs(slope + 0.5) < 0.2
    best = found[-1]
    assert all(abs(f.largest - best.largest) < 4.0 * np.hypot(f.error, best.error) for f in found)


def test_tolerance_is_kept() -> None:
    for tolerance in (0.05, 0.02, 0.01):
        found = cf.lyapunov_exponent("coulomb", PARAMS, tolerance=tolerance)
        assert found.converged
        assert found.error <= tolerance * found.largest
        assert found.followed < 100_000
