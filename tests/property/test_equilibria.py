"""Random piecewise affine systems: pseudo-equilibria, and what a boundary equilibrium is, by a second way.

For f+- = A+- y + b+- on the sides of x = 0, equilibria of the sliding field are the roots in (0, 1) of the
first component of y(alpha), where ((1 - alpha) A+ + alpha A-) y = -((1 - alpha) b+ + alpha b-). They are
searched for here on a fine grid of alpha, with brentq.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import contfric as cf
from contfric.models.reading.files import from_data


def system(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    return rng.uniform(-2, 2, (2, n, n)), rng.uniform(-2, 2, (2, n))


def model_of(a: np.ndarray, b: np.ndarray) -> cf.Model:
    """The fields with m added to the last component of f+, as a model."""
    names = ["x", "y", "z"][: a.shape[1]]

    def field(k: int) -> dict[str, str]:
        rows = {}
        for i, name in enumerate(names):
            terms = [f"({float(a[k, i, j])!r})*{other}" for j, other in enumerate(names)]
            more = " + m" if k == 0 and i == len(names) - 1 else ""
            rows[name] = " + ".join([*terms, f"({float(b[k, i])!r})"]) + more
        return rows

    return from_data(
        {
            "name": "random",
            "states": names,
            "parameters": {"m": 0.0},
            "autonomous": True,
            "surfaces": {"h": {"observable": "x", "level": 0, "sliding": "filippov"}},
            "modes": {
                "plus": {"in": {"h": "+"}, "field": field(0)},
                "minus": {"in": {"h": "-"}, "field": field(1)},
            },
        }
    )


def by_alpha(a: np.ndarray, b: np.ndarray) -> list[np.ndarray]:
    """The equilibria of sliding that attracts: f+ leads down to x = 0, and f- up."""

    def y(alpha: float) -> np.ndarray:
        mixed, right = ((1 - alpha) * part[0] + alpha * part[1] for part in (a, b))
        return np.linalg.solve(mixed, -right)

    ends = np.geomspace(1e-9, 1e-3, 200)  # near a boundary equilibrium alpha is near 0
    grid = np.concatenate([ends, np.linspace(2e-3, 1 - 2e-3, 4001), 1 - ends[::-1]])
    heights = np.array([y(alpha)[0] for alpha in grid])
    found = []
    for k in np.flatnonzero(heights[:-1] * heights[1:] < 0):
        if min(abs(heights[k]), abs(heights[k + 1])) > 1.0:
            continue  # a pole
        at = y(brentq(lambda s: y(s)[0], grid[k], grid[k + 1], xtol=1e-14))
        rates = [(part @ at + right)[0] for part, right in zip(a, b, strict=True)]
        if rates[0] < 0 < rates[1]:
            found.append(at)
    return found


@pytest.mark.parametrize("seed", range(8))
def test_all_pseudo_equilibria_are_found(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = system(rng, 2 + seed % 2)
    exact = by_alpha(a, b)
    found = [e for e in cf.find_equilibria(model_of(a, b)) if e.pseudo]
    assert len(found) == len(exact)
    for at in exact:
        assert min(np.max(np.abs(e.state - at)) for e in found) < 1e-9
    for e in found:  # the eigenvalues, by differences of the sliding field along the surface

        def sliding(rest: np.ndarray) -> np.ndarray:
            y = np.array([0.0, *rest])
            up, down = (part @ y + right for part, right in zip(a, b, strict=True))
            return ((down[0] * up - up[0] * down) / (down[0] - up[0]))[1:]

        rest, eps = e.state[1:], 1e-6
        steps = eps * np.eye(len(rest))
        jac = np.array([(sliding(rest + d) - sliding(rest - d)) / (2 * eps) for d in steps]).T
        exact_values = np.sort_complex(np.linalg.eigvals(jac))
        assert np.allclose(np.sort_complex(e.eigenvalues), exact_values, atol=1e-6, rtol=1e-6)


@pytest.mark.parametrize("seed", range(8))
def test_boundary_equilibria_are_what_their_product_says(seed: int) -> None:
    """The branch of f+ reaches x = 0 at a known m; what is beyond is counted on both sides of it."""
    rng = np.random.default_rng(100 + seed)
    n = 2 + seed % 2
    a, b = system(rng, n)
    # x of -A+^-1 (b+ + m e_n) vanishes at m*
    inverse = np.linalg.inv(a[0])
    critical = -(inverse @ b[0])[0] / inverse[0, -1]
    model = model_of(a, b)
    sign = 1.0 if -inverse[0, -1] > 0 else -1.0  # x grows with sign * m
    (start,) = [
        e for e in cf.find_equilibria(model, {"m": critical + 0.1 * sign}) if e.mode == "plus"
    ]
    branch = cf.continue_equilibrium(start, "m", (critical - 0.2, critical + 0.2))
    event = min(branch.of_kind("BE"), key=lambda e: abs(e.value - critical))
    assert event.value == pytest.approx(critical, abs=1e-10)
    at = event.equilibrium.state
    jump = a[1] @ at + b[1]  # f+ vanishes there
    product = -(inverse @ jump)[0]
    if jump[0] < 0:  # sliding next to the event repels, and no mode rests there
        assert event.unfolding.name == "ALONE"
        return
    assert event.product == pytest.approx(product, rel=1e-6)
    assert event.unfolding.name == ("PERSISTENCE" if product > 0 else "FOLD")
    step = 1e-4
    moved = np.zeros(n)
    beside = {}
    for side in (step, -step):
        moved[-1] = critical + side * sign
        beside[side] = [
            y
            for y in by_alpha(a, b + np.array([moved, np.zeros(n)]))
            if np.max(np.abs(y - at)) < 100 * step * (1 + np.max(np.abs(inverse)))
        ]
    # the equilibrium of f+ is admissible at +step: its partner there too (fold), or at -step (persistence)
    assert len(beside[step]) == (product < 0) and len(beside[-step]) == (product > 0)


@pytest.mark.parametrize("seed", [136, 137, 138])
def test_each_boundary_is_met_once_and_unfolds_as_its_product_says(seed: int) -> None:
    """A branch that goes on from a boundary begins there to rounding, on either side of it."""
    rng = np.random.default_rng(seed)
    a, b = system(rng, 3)
    inverse = np.linalg.inv(a[0])
    critical = -(inverse @ b[0])[0] / inverse[0, -1]
    model = model_of(a, b)
    sign = 1.0 if -inverse[0, -1] > 0 else -1.0
    found = cf.find_equilibria(model, {"m": critical + 0.1 * sign})
    (start,) = [e for e in found if e.mode == "plus"]
    branch = cf.continue_equilibrium(start, "m", (critical - 0.2, critical + 0.2))
    events = branch.of_kind("BE")
    assert len({round(e.value, 9) for e in events}) == len(events) > 0
    for event in events:
        if np.isfinite(event.product):
            assert event.unfolding.name == ("PERSISTENCE" if event.product > 0 else "FOLD")


def test_a_pole_is_no_zero() -> None:
    """The friction law of one mode, gone on with, has its pole where the equilibrium would be."""
    poles = 0
    for seed in range(6):
        delta = float(np.random.default_rng(seed).uniform(0.5, 8.0))
        params = {"delta": delta, "vb": 1.0 / delta}
        poles += 1.0 + delta * (0.0 - params["vb"]) == 0.0
        found = cf.find_equilibria("belt", params, starts=12)
        # at rest under the friction of a belt that is faster, and nothing else within reach
        (point,) = found.points
        assert point.location.name == "ADMISSIBLE"
        assert point.state == pytest.approx([1.0 / (1.0 + delta * params["vb"]), 0.0], abs=1e-12)
    assert poles > 3
