"""Cycles that are born at Hopf points, where they are known in closed form.

In the polar coordinates of ``(x - x0, y - k (x - x0))`` the model is ``r' = m r + a r^3 - r^5``: cycles have
``r^2 = (a -+ sqrt(a^2 + 4 m))/2``, and meet in a fold at ``m = -a^2/4``.
"""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric.models.reading.files import from_data


@pytest.mark.parametrize("seed", range(4))
def test_a_cycle_goes_from_its_hopf_point_through_its_fold(seed: int) -> None:
    draw = np.random.default_rng(seed)
    a, w, k, x0 = (float(v) for v in draw.uniform((0.5, 0.7, -0.4, -0.5), (1.2, 2.0, 0.4, 0.5)))
    x, y = "(x - x0)", "(y - k*(x - x0))"
    growth = f"(m + a*({x}**2 + {y}**2) - ({x}**2 + {y}**2)**2)"
    first = f"({growth}*{x} - w*{y})"
    model = from_data(
        {
            "name": "cycles",
            "states": ["x", "y"],
            "parameters": {"m": -0.1 * a * a, "a": a, "w": w, "k": k, "x0": x0},
            "autonomous": True,
            "modes": {"all": {"field": {"x": first, "y": f"w*{x} + {growth}*{y} + k*{first}"}}},
        }
    )
    (rest,) = cf.find_equilibria(model)
    (hopf,) = cf.continue_equilibrium(rest, "m", (-0.5 * a * a, 0.3)).of_kind("H")
    assert hopf.value == pytest.approx(0.0, abs=1e-12)
    assert hopf.frequency == pytest.approx(w, rel=1e-12)
    diagram = cf.explore(hopf.cycle(), "m", (-0.5 * a * a, 0.3))
    (fold,) = diagram.bifurcations
    assert fold.kind.value == "SN"
    assert fold.params["m"] == pytest.approx(-a * a / 4, rel=1e-10)
    (branch,) = diagram.branches
    assert sorted(end.reason.name for end in branch.ends) == ["POINT", "RANGE"]
    assert not diagram.loose_ends
    assert min(np.abs(branch.values)) < 1e-4  # the end is near the Hopf point
    for orbit in [branch[j] for j in range(0, len(branch.values), 5)]:
        r = orbit.x_max - x0
        assert orbit.params["m"] == pytest.approx(r**4 - a * r**2, abs=1e-9)
        assert orbit.period == pytest.approx(2 * np.pi / w, rel=1e-9)
