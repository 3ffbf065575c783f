"""What a diagram says of its points and events holds for their own joints.

Of random scenes in all five parameters: every point is admissible, multipliers at ends are those of the
joints that stand there, a fold, branch point or doubling has its multiplier on the unit circle, and stability
is told in the order of the parameter.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import contfric as cf
from contfric.bvp.system import EventFunction, Margin
from contfric.continuation.accuracy.rounding import off_circle
from contfric.continuation.singular_points.vertices import symmetric_part
from contfric.orbit.solve import refine
from contfric.signature.holds import TOUCH

Scene = tuple[dict[str, float], str, tuple[float, float]]

SCENES, BRANCHES = 19, 20
#: Where a slide between two holds shrinks to nothing, and where sticks begin tangentially.
CHOSEN: dict[str, Scene] = {
    "slides between holds, h": (
        {
            "Omega": 0.17838134201611394,
            "S": 0.04861123577505324,
            "S0": 0.29197502853433555,
            "h": 0.0,
            "zeta": 0.00039190316692945255,
        },
        "h",
        (-0.09587562068941574, 0.07623155200304373),
    ),
    "slides between holds, zeta": (
        {
            "Omega": 0.12784125417014755,
            "S": 0.020945700324858936,
            "S0": 0.04634510276660679,
            "h": 0.04157323245145339,
            "zeta": 0.004829303425705549,
        },
        "zeta",
        (-0.0524787394622068, 0.07329936289463754),
    ),
    "sticks that begin tangentially": (
        {
            "Omega": 0.07126325362760999,
            "S": 0.0650942913310507,
            "S0": 0.13162220049679194,
            "h": 0.2583164956524864,
            "zeta": 0.0,
        },
        "zeta",
        (-0.08984247628585654, 0.05699312733023525),
    ),
}
#: A located multiplier is on the circle to the root of rounding, times the size of the others.
ON_CIRCLE = 1e-6
#: Stored and recomputed ones, also of mirror images; a release without a rate makes them infinite.
SAME, INFINITE = 1e-6, 1e6
#: Multipliers change with the root of the distance next to a tangential stop: how much over one point.
NEAR = 0.05
#: Distances (in Omega) from which a vertex is looked for.
DISTANCES = (1e-8, 1e-6, 1e-5, 1e-4, 1e-3)
#: Rounding in every equation may move an orbit that is called solved by less than this.
DETERMINED = 1e-5


def random_scene(seed: int) -> Scene:
    rng = np.random.default_rng([seed, 13])
    S = rng.uniform(0.03, 0.5)
    value = {
        "Omega": rng.uniform(0.2, 0.9),
        "S": S,
        "S0": S * rng.uniform(1.0, 2.2),
        "h": float(rng.choice([0.0, rng.uniform(-0.4, 0.4)])),
        "zeta": float(rng.choice([0.0, rng.uniform(0.0, 0.15)])),
    }
    varied = str(rng.choice(list(value)))
    half = rng.uniform(0.03, 0.15)
    low = value[varied] - half
    return value, varied, (max(low, 0.1) if varied == "Omega" else low, value[varied] + half)


@cache
def diagram(case: int | str) -> cf.Diagram | None:
    params, varied, bounds = CHOSEN[case] if isinstance(case, str) else random_scene(case)
    try:
        orbit = cf.find_orbit("coulomb", params, longest=2000)
    except cf.ContfricError:
        return None
    return cf.explore(orbit, varied, bounds, max_branches=BRANCHES, max_points=600)


each_case = pytest.mark.parametrize("case", [*CHOSEN, *range(SCENES)])


def branches(case: int | str) -> Iterator[cf.Branch]:
    found = diagram(case)
    return iter(()) if found is None else iter(found.branches)


def test_most_scenes_are_there() -> None:
    found = [diagram(case) for case in range(SCENES)]
    assert sum(d is not None for d in found) > SCENES // 2
    assert {d.parameter for d in found if d is not None} == {"Omega", "S", "S0", "h", "zeta"}


@each_case
def test_every_point_is_admissible(case: int | str) -> None:
    for branch in branches(case):
        bad = [(k, orbit.violations()) for k, orbit in enumerate(branch) if not orbit.admissible]
        assert not bad, (branch, bad)


@each_case
def test_multipliers_at_ends_are_those_of_their_joints(case: int | str) -> None:
    for branch in branches(case):
        if branch.turn_multipliers is None:
            continue
        for k in (0, -1):
            stored, own = branch.turn_multipliers[k], branch[k].turn_multipliers
            if max(np.max(np.abs(stored)), np.max(np.abs(own))) < INFINITE:
                assert np.allclose(stored, own, rtol=SAME, atol=SAME), (branch, k)


def test_multipliers_do_not_jump_where_a_stick_begins_tangentially() -> None:
    """At such an end time is divided by an acceleration that is rounding."""
    asked = 0
    for branch in branches("sticks that begin tangentially"):
        for k, beside, end in ((0, 1, branch.ends[0]), (-1, -2, branch.ends[1])):
            event = end.bifurcation
            if branch.turn_multipliers is None or event is None or not is_tangential(branch[k]):
                continue
            here, near = branch.turn_multipliers[k], branch.turn_multipliers[beside]
            assert np.max(np.abs(here - near)) < NEAR * (1.0 + np.max(np.abs(near))), branch
            asked += 1
    assert asked > 4


def is_tangential(orbit: cf.Orbit) -> bool:
    """Whether a slide of an orbit comes to a stick without acceleration."""
    itinerary = orbit.system.itinerary
    return any(
        test.margin is Margin.EXIT
        and itinerary[test.segment][0] != "stick"
        and itinerary[(test.segment + 1) % len(itinerary)][0] == "stick"
        and abs(margin) < 1e-12
        for test, margin in zip(orbit.system.tests, orbit.margins, strict=True)
    )


def smooth_events(case: int | str) -> list[cf.Bifurcation]:
    """Return the located events at which a multiplier reaches the unit circle and nothing is held."""
    return [
        event
        for branch in branches(case)
        for event in branch.bifurcations
        if event.kind in (cf.Kind.SN, cf.Kind.BP, cf.Kind.PD)
        and event.located
        and not event.orbit.system.holds
    ]


@each_case
def test_smooth_events_have_their_multiplier(case: int | str) -> None:
    for event in smooth_events(case):
        size = 1.0 + float(np.max(np.abs(event.orbit.turn_multipliers)))
        assert abs(off_circle(event.kind, event.orbit)) < ON_CIRCLE * size, event


def test_some_scenes_have_smooth_events() -> None:
    found = [len(smooth_events(case)) for case in (*CHOSEN, *range(SCENES))]
    assert np.count_nonzero(found) >= 5 and sum(found) >= 15


@each_case
def test_stability_is_told_in_the_order_of_the_parameter(case: int | str) -> None:
    found = diagram(case)
    for branch in branches(case):
        assert found is not None
        if branch.stable is None or branch.bridge:
            continue
        for event in branch.bifurcations[1:-1]:
            k = int(np.searchsorted(branch.arc, event.position))
            value = event.params[found.parameter]
            if event.kind is cf.Kind.SN or not 1 < k < len(branch) - 1:
                continue
            for index in (k - 1, k):
                below = branch.values[index] < value
                said = event.stable_before if below else event.stable_after
                clear = abs(branch.arc[index] - event.position) > 1e-6
                if clear and said is not None and only_event(branch, index, k):
                    assert said == branch.stable[index], (branch, event)


def only_event(branch: cf.Branch, a: int, b: int) -> bool:
    """Whether one event alone lies between the points around it."""
    low, high = branch.arc[min(a, b - 1)], branch.arc[max(a, b)]
    return sum(bool(low <= e.position <= high) for e in branch.bifurcations) == 1


def test_a_slide_between_two_holds_must_last() -> None:
    """Both its ends are tangential: the acceleration at its start vanishes with the square of its length."""
    seen = 0
    for case in list(CHOSEN)[:2]:
        for branch in branches(case):
            itinerary = branch.system.itinerary
            for i, (_, exit_) in enumerate(itinerary):
                if exit_ == TOUCH and itinerary[i - 2][1].startswith("hold@"):
                    assert (
                        EventFunction(Margin.LASTING, (i - 1) % len(itinerary), "v")
                        in branch.system.tests
                    )
                    seen += 1
    assert seen > 4


@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_place_of_a_vertex_does_not_depend_on_where_it_is_looked_for(
    distance: float, sign: float
) -> None:
    """From any symmetric orbit near it: the same place, or none."""
    orbit = cf.solve_orbit("coulomb", "2s", {"Omega": 0.489, "S": 0.32, "S0": 0.4})
    vertex = 0.48874064302956684431  # 40 digits
    vector = orbit.vector.copy()
    active = orbit.model.index_of("Omega")
    vector[active] = vertex + sign * distance
    beside = refine(replace(orbit.as_half(), vector=vector)).as_whole()
    found = symmetric_part(beside, active)
    if found is None:
        assert distance > 1e-5
    else:
        assert abs(float(found.vector[active]) - vertex) < 1e-14


def test_what_rounding_moves_is_not_solved() -> None:
    """With S = S0 just above the force a mass creeps to rest: slides of no length make no orbit."""
    params = {
        "Omega": 0.39478189823284165,
        "S": 1.0581242941885205,
        "S0": 1.0581242941885205,
        "zeta": 0.25615313074692964,
    }
    with pytest.raises(cf.ConvergenceError, match="marginally stable"):
        cf.find_orbit("coulomb", params, longest=4000)


@pytest.mark.parametrize("seed", range(12))
def test_what_is_solved_is_determined(seed: int) -> None:
    found = diagram(seed)
    if found is None:
        pytest.skip("nothing periodic attracts there")
    from contfric.bvp.linear import assembled

    for branch in found.branches[:8]:
        orbit = refine(branch[len(branch) // 2], damped=False)
        if not orbit.converged:
            continue
        inverse = np.linalg.inv(assembled(orbit.system, orbit.joints, orbit.vector))
        assert np.max(np.abs(inverse)) * orbit.model.rounding < DETERMINED


@pytest.mark.slow
def test_where_two_holds_end_together_the_branch_ends_with_both() -> None:
    """Four orbits are next to such an event, two of them with one hold of negative length."""
    params = {
        "Omega": 0.11178554286530032,
        "S": 0.017432193156589813,
        "S0": 0.021965405542497998,
        "h": -0.10669269216044042,
        "zeta": 0.0001622256486222396,
    }
    orbit = cf.find_orbit("coulomb", params, longest=1000)
    range_ = (-0.23908159485669728, 0.03418848256440038)
    diagram = cf.explore(orbit, "h", range_, max_branches=85)
    together = 0
    for branch in diagram.branches:
        for tip in (branch[0], branch[-1]):
            assert tip.admissible, branch
            lasts = tip.ends[:, 0] - tip.cycle[:, 0]
            short = [lasts[hold.segment] for hold in tip.system.holds if lasts[hold.segment] < 1e-4]
            # the square of a length is what is located, to about 1e-13
            assert not short or min(short) > -1e-6, branch
            together += len(short) > 1
    assert together
