"""Diagrams of models other than ``coulomb`` do not depend on their start."""

from __future__ import annotations

from pathlib import Path

import models
import numpy as np
import pytest
import restarts
from report import Tally

import contfric as cf
from contfric.atlas.matching import inner_orbit, on_branch

FILES = Path(__file__).parents[1] / "models"
#: Models whose scenes take up to a minute.
LONG = {"lugre", "beam-stop", "bang-bang", "pendulum", "braced-chain", "soft_pendulum"}
Case = tuple[str, dict[str, float], str, tuple[float, float]]
VERTEX = "points next to a branch point were those of the symmetric branch"
#: Scenes that gave different diagrams from different starts, or indices that do not balance.
CAUGHT: dict[str, Case] = {
    "what a segment of no length crosses was a tangency, next to a graze": (
        "bilinear.yaml",
        {
            "omega": 0.7163110745730397,
            "k": 17.315442267881664,
            "zeta": 0.04613522673522831,
            "gap": 0.0,
            "A": 0.8870835762852588,
        },
        "omega",
        (0.4883743370810352, 0.9673974235429389),
    ),
    VERTEX: (
        "walls.yaml",
        {
            "w": 1.850743132745149,
            "F": 2.052376932294043,
            "a": 0.05653019712301369,
            "phase": 0.4330028632109529,
            "zeta": 0.04948224224032298,
            "k3": 0.0007280126763103273,
            "d": 0.5633745457124505,
            "e": 0.7267949652931818,
        },
        "w",
        (1.6509324712260434, 3.3492994690408917),
    ),
    "at a graze an orbit of two periods did not show that its solution repeats itself": (
        "impact",
        {
            "A": 0.18773144545737439,
            "w": 0.9306347269457018,
            "k": 0.8856291361281822,
            "c": 0.08778852400449907,
            "d": 1.187480796135489,
            "e": 0.7239943095941395,
        },
        "A",
        (0.04034647799077167, 0.3648848015995212),
    ),
    "next to a graze of six impacts other multipliers are rounding of the largest": (
        "driven_box.yaml",
        {
            "omega": 0.835901371798044,
            "zeta": 0.0578951709403574,
            "d": 1.2660167131231854,
            "A": 1.06254195112957,
            "r": 0.5795720860146288,
            "m": 0.16192237368273435,
            "k2": 0.2754896360162347,
            "c2": 0.04576969713473296,
        },
        "m",
        (0.12423531110582867, 0.2589240832374207),
    ),
}


@pytest.mark.parametrize("case", CAUGHT.values(), ids=CAUGHT)
def test_a_diagram_is_the_same_from_each_of_its_branches(case: Case) -> None:
    name, params, vary, bounds = case
    orbit = cf.find_orbit(FILES / name if name.endswith("yaml") else name, params)
    found = cf.explore(orbit, vary, bounds, max_periods=2).verify()
    assert len(found.restarts) >= 4
    assert found.faults == ()


@pytest.mark.parametrize("step", [None, 0.0031, 0.02])
def test_a_branch_comes_to_its_vertex_from_one_side(step: float | None) -> None:
    """Near a branch point the parameter goes on as a parabola of the distance: it does not come back."""
    name, params, vary, bounds = CAUGHT[VERTEX]
    orbit = cf.find_orbit(FILES / name, params)
    diagram = cf.explore(orbit, vary, bounds, max_periods=1, max_step=step)
    ends = [
        (branch, side)
        for branch in diagram.branches
        for side, end in enumerate(branch.ends)
        if end.reason is cf.EndReason.BP
    ]
    assert ends
    for branch, side in ends:
        near = np.abs(branch.arc - branch.arc[-side]) < 0.05
        apart = (branch.values - branch.values[-side])[near]
        assert np.all(apart <= 0.0) or np.all(apart >= 0.0)


@pytest.mark.parametrize("first", [0, 6, 12, 18])
def test_random_scenes_of_models_that_bundled_studies_explore(first: int) -> None:
    tally = Tally()
    for index in range(first, first + 6):
        tally.index = index
        found = models.scene(7, index)
        if Path(found.model).stem in LONG:
            continue
        restarts.one_scene(tally, found, most=2, branches=40, max_periods=models.PERIODS)
    assert tally.counts.get("scenes", 0) >= 2
    assert tally.failed == []


@pytest.mark.parametrize("seed", range(2, 7))
def test_a_branch_is_known_where_its_middle_is_not_solved_again(seed: int) -> None:
    """Half of the points of this doubled branch crowd next to a touch, where Newton's method leaves 1e-9."""
    rng = np.random.default_rng([50, seed])
    params = {"A": 0.8217, "C": 0.83373 * (1.0 + rng.uniform(-0.02, 0.02))}
    step = float(rng.uniform(0.005, 0.03))
    orbit = cf.find_orbit(FILES / "switched.yaml", params, longest=1000)
    diagram = cf.explore(orbit, "A", (0.5375, 1.02695), max_periods=2, max_step=step)
    assert len(diagram.branches) == 2
    for branch in diagram.branches:
        assert on_branch(inner_orbit(branch), branch)
        start = branch[len(branch) // 3]
        again = cf.explore(start, "A", diagram.range, max_periods=2, max_step=step)
        assert sorted(b.system.periods for b in again.branches) == [1, 2]
