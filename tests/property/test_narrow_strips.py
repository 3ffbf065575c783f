"""Next to equal limits a hold crosses the strip between them in no time: its two ends are one event.

Where the branch of the hold is too narrow to be told from none, the regular branches at its two ends go on
from each other: the slide of no length at a stop on the limit, as at equal limits.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import contfric as cf
from contfric.events.incident import incident_forms
from contfric.events.narrow_strips import regular_outcomes
from contfric.orbit.solve import refine

#: Scenes near these have a stop on the limit in the range of h.
SCENES = (
    ({"Omega": 0.197146, "S": 0.0563972, "h": 0.370846, "zeta": 0.0}, "h", (0.25, 0.39)),
    ({"Omega": 0.211803, "S": 0.150216, "h": -0.184494, "zeta": 0.01}, "zeta", (-0.04, 0.02)),
)


@cache
def diagram(seed: int) -> cf.Diagram:
    """Explore a random scene with a narrow strip between both limits."""
    rng = np.random.default_rng([94, seed])
    base, vary, bounds = SCENES[seed % len(SCENES)]
    params = {name: value * (1.0 + rng.uniform(-0.01, 0.01)) for name, value in base.items()}
    params["S0"] = params["S"] * (1.0 + 10.0 ** rng.uniform(-4.6, -3.7))
    return cf.explore(cf.find_orbit("coulomb", params, longest=1000), vary, bounds, max_branches=80)


def stops_on_the_limit(found: cf.Diagram) -> list[cf.Bifurcation]:
    return [b for b in found.bifurcations if b.kind is cf.Kind.SS]


@pytest.mark.parametrize("seed", range(6))
def test_nothing_ends_at_a_stop_on_the_limit(seed: int) -> None:
    found = diagram(seed)
    assert stops_on_the_limit(found)
    assert not found.loose_ends
    checked = found.verify(2)
    assert checked.passed, str(checked)


@pytest.mark.parametrize("seed", range(6))
def test_both_regular_passages_are_solutions_at_the_event(seed: int) -> None:
    """With the slide and without it, the equations of either alone have the solution of the event."""
    for b in stops_on_the_limit(diagram(seed)):
        regular = [form for form in incident_forms(b).forms if not form.has_hold]
        assert {len(form.itinerary) for form in regular} >= {
            min(len(form.itinerary) for form in regular) + k for k in (0, 1)
        }
        for form in regular:
            moved = replace(form.orbit, joints=form.orbit.joints + 1e-9)
            solved = refine(moved)
            assert solved.converged
            assert solved.outline.apart(b.outline) < 1e-8
            assert float(np.min(np.abs(solved.margins))) < 1e-9


@pytest.mark.parametrize("width", [0.02, 0.2, 1.0])
def test_a_wide_strip_is_not_crossed(width: float) -> None:
    """There the branch of the hold leads from one edge to the other."""
    base, vary, bounds = SCENES[1]
    params = {**base, "S0": base["S"] * (1.0 + width)}
    found = cf.explore(
        cf.find_orbit("coulomb", params, longest=1000), vary, bounds, max_branches=20
    )
    held = [orbit.as_whole() for b in found.branches if b.bridge for orbit in (b[0], b[-1])]
    assert held
    assert not any(list(regular_outcomes(o, len(o.itinerary))) for o in held)


@pytest.mark.parametrize(
    ("params", "bounds"),
    [
        (
            {
                "Omega": 0.08522782883656335,
                "S": 0.040571679038123705,
                "S0": 0.04057323566406074,
                "h": -0.37243437908184646,
                "zeta": 0.0,
            },
            (0.07500048937617575, 0.09545516829695096),
        ),
        (
            {
                "Omega": 0.14409300575820697,
                "S": 0.14582794342466832,
                "S0": 0.14583149445942145,
                "h": -0.2200274355109686,
                "zeta": 0.01,
            },
            (0.12680184506722214, 0.1613841664491918),
        ),
    ],
)
def test_symmetric_orbits_next_to_a_family_are_solved_on_their_half(
    params: dict[str, float], bounds: tuple[float, float]
) -> None:
    """Whichever of the two equal lengths of a segment rounding makes the shorter one."""
    found = cf.explore(cf.find_orbit("coulomb", params, longest=1000), "Omega", bounds)
    assert all(restart.complete for restart in found.verify(3).restarts)
