"""Linear algebra that rounds otherwise gives the same diagram, next to continua too.

At Omega = 1/2 and without damping curves of orbits cross, and what is near is known to the root of rounding.
Another processor, or another kernel of BLAS, rounds otherwise.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.completeness.balance import balances
from contfric.atlas.completeness.verification import differences
from contfric.continuation.points import LARGEST_STEP
from contfric.orbit.orbit import Orbit

BOUNDS = (0.4, 0.6)
EPS = float(np.finfo(float).eps)


def round_otherwise(monkeypatch: pytest.MonkeyPatch, seed: int) -> None:
    """Change the entries of every matrix that is decomposed or solved by about a unit in the last place."""
    rng = np.random.default_rng(seed)

    def nudging(function: Callable[..., Any]) -> Callable[..., Any]:
        def call(a: Any, *args: Any, **kwargs: Any) -> Any:
            matrix = np.asarray(a)
            change = 0.5 * EPS * rng.standard_normal(matrix.shape)
            return function(matrix * (1.0 + change), *args, **kwargs)

        return call

    for name in ("svd", "solve", "lstsq"):
        monkeypatch.setattr(np.linalg, name, nudging(getattr(np.linalg, name)))


def told(diagram: cf.Diagram, orbit: Orbit, step: float) -> list[str]:
    """Return what differs when a diagram is explored from an orbit, and what does not hold of it."""
    again = cf.explore(orbit, "Omega", BOUNDS, max_step=step * LARGEST_STEP)
    return [
        *(f"without {text}" for text in differences(diagram, again)),
        *(f"with {text}" for text in differences(again, diagram)),
        *(f"unbalanced: {b}" for b in balances(again) if not b.holds),
        *(str(end) for end in again.loose_ends),
        *(f"not admissible: {b.name}" for b in again.branches if not all(o.admissible for o in b)),
    ]


#: Scenes, branches and steps at which a T was there or not, or a corner passed, as arithmetic rounds.
SOME = [(0, "1a", 0.31), (2, "1a, 7seg, 1hold", 2.0)]


@pytest.mark.parametrize(("seed", "name", "step"), SOME)
@pytest.mark.parametrize("other", range(3))
def test_the_same_however_linear_algebra_rounds(
    seed: int, name: str, step: float, other: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(seed)
    friction = float(rng.uniform(0.25, 0.33))
    limit = friction + float(rng.uniform(0.008, 0.03))
    params = {"Omega": 0.5, "S": friction, "S0": limit, "h": 0.0, "zeta": 0.0}
    round_otherwise(monkeypatch, other)
    diagram = cf.explore(cf.find_orbit("coulomb", params), "Omega", BOUNDS)
    branch = next(b for b in diagram.branches if b.name == name)
    assert told(diagram, branch[len(branch) // 2], step) == []
