"""Bridges of diagrams that nobody has chosen: motions of the differential inclusion, joined at both ends.

The scenes are random (``scenes(count)``); a long run by hand::

    python tests/property/test_bridges.py 200 [first]
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import cache
from typing import Any

import networkx as nx
import numpy as np
import pytest

import contfric as cf
from contfric.atlas.matching import stops_distance
from contfric.events.bifurcation import ACCURACY, EndReason
from contfric.signature.holds import TOUCH, is_hold

Scene = tuple[dict[str, float], str, tuple[float, float]]

#: Random scenes whose diagrams have bridges: the first ten that have at most 30 branches (the last
#: three take longest), and larger ones.
SEEDS = (1, 29, 33, 35, 37, 46, 49, 10, 43, 56)
LARGE = (16, 20, 25)
#: Chosen ones: what each holds is asserted by test_the_chosen_ones_have_each_kind.
CHOSEN: dict[str, Scene] = {
    "SS, one hold": ({"Omega": 0.5, "S": 0.32, "S0": 0.4}, "Omega", (0.4, 0.6)),
    "SS, two mirrored holds": (
        {"Omega": 0.44, "S": 0.17605, "S0": 0.219291},
        "Omega",
        (0.42, 0.44),
    ),
    "GS, up to three holds": ({"Omega": 0.5, "S": 0.2, "S0": 0.4}, "S", (0.0, 0.4)),
    "SS, AS and GS": ({"Omega": 0.5, "S": 0.3, "S0": 0.4, "h": 0.28}, "h", (0.2385, 0.3)),
}
#: Ends of one event, in the parameter relative to the range, and in the motion.
SAME_VALUE, SAME_SOLUTION = 1e-10, 1e-7
#: A solution of the inclusion, by simulation from joint to joint.
MOTION = 1e-9
#: Where a margin is smaller than this, rounding decides whether another event is met (nondimensional).
UNDECIDED = 1e-9
#: The load is this far (relative) before the time of a touch below its limit by the square of it.
BEFORE_TOUCH = 1e-6
JUMPS = {EndReason.SS, EndReason.AS, EndReason.GS}


def random_scene(seed: int) -> Scene:
    """A random scene: parameters, the one that varies, and its range."""
    rng = np.random.default_rng(seed)
    S0 = rng.uniform(0.1, 0.8)
    S = S0 * rng.uniform(0.3, 1.0)
    h = float(rng.choice([0, 0, rng.uniform(-0.15, 0.15)]))
    zeta = float(rng.choice([0, 0, rng.uniform(0, 0.1)]))
    omega = rng.uniform(0.25, 0.9)
    params = {"Omega": omega, "S": S, "S0": S0, "h": h, "zeta": zeta}
    parameter = str(rng.choice(["Omega", "Omega", "S", "S0", "h", "zeta"]))
    w = rng.uniform(0.05, 0.25)
    low, high = {
        "Omega": (max(0.1, omega - w), omega + w),
        "S": (max(0, S - w), min(S + w, S0)),
        "S0": (max(S, S0 - w), S0 + w),
        "h": (h - w, h + w),
        "zeta": (max(0, zeta - w / 2), zeta + w / 2),
    }[parameter]
    return params, parameter, (float(low), float(high))


def scenes(seeds: tuple[int, ...]) -> Iterator[tuple[int, cf.Orbit, Scene]]:
    """The scenes of some seeds; a simulation of each converges to a periodic orbit."""
    for seed in seeds:
        scene = random_scene(seed)
        yield seed, cf.find_orbit("coulomb", scene[0], longest=2000), scene


@cache
def settled() -> dict[int, tuple[cf.Orbit, Scene]]:
    return {seed: (orbit, scene) for seed, orbit, scene in scenes((*SEEDS, *LARGE))}


@cache
def diagram(case: int | str) -> cf.Diagram:
    """The diagram of a case."""
    if isinstance(case, str):
        params, parameter, bounds = CHOSEN[case]
        return cf.explore(cf.find_orbit("coulomb", params), parameter, bounds, max_branches=150)
    orbit, (_, parameter, bounds) = settled()[case]
    return cf.explore(orbit, parameter, bounds, max_branches=150)


each_case = pytest.mark.parametrize(
    "case",
    [*CHOSEN, *SEEDS[:7], *(pytest.param(k, marks=pytest.mark.slow) for k in (*SEEDS[7:], *LARGE))],
)


def computed(found: cf.Diagram) -> Iterator[tuple[int, cf.Branch]]:
    return ((i, b) for i, b in enumerate(found.branches) if not b.mirrored)


# ----------------------------------------------------------- a solution of the inclusion


def domain_of(orbit: cf.Orbit, i: int) -> str:
    """The domain in which segment i of the whole orbit starts."""
    mode = orbit.itinerary[i][0]
    if mode == "stick":
        return "stick"
    u, S0 = load(orbit, *orbit.cycle[i, :2]), orbit.params["S0"]
    side = "+" if u > S0 else "-" if u < -S0 else "0"
    return f"x{side}v{mode[-1]}"


def load(orbit: cf.Orbit, t: float, x: float) -> float:
    phase = orbit.params["Omega"] * t
    return float(x - np.cos(phase) - orbit.params["h"] * np.cos(3.0 * phase))


def motion_errors(orbit: cf.Orbit) -> Iterator[tuple[str, float]]:
    """How far each segment is from a solution of the inclusion, (what, error)."""
    start = orbit.cycle.copy()
    assert np.max(np.abs(start[:, 2])) < MOTION  # every joint of this model is at rest
    start[:, 2] = 0.0
    for i, (mode, exit_) in enumerate(orbit.itinerary):
        begin, end = start[i], orbit.ends[i]
        if is_hold(exit_):
            yield from held_errors(orbit, i)
        elif end[0] - begin[0] > MOTION:  # at an event a segment may have no length
            yield f"{mode} {exit_}", simulated_error(orbit, i, begin, end)


def simulated_error(orbit: cf.Orbit, i: int, begin: np.ndarray, end: np.ndarray) -> float:
    """Distance of the simulated end of a segment from the next joint."""
    touches = orbit.itinerary[(i + 1) % len(orbit.itinerary)][1] == TOUCH
    duration = end[0] - begin[0]
    if (
        touches and orbit.itinerary[i][0] == "stick"
    ):  # a touch of the limit may release: a little before it
        duration -= BEFORE_TOUCH * (1.0 + duration)
    longest = duration if touches else 1.5 * duration + 1.0
    path = cf.simulate(
        "coulomb",
        orbit.params,
        state=begin[1:],
        time=float(begin[0]),
        periods=longest * orbit.params["Omega"] / (2.0 * np.pi),
        events=1_000_000 if touches else 1,
        domain=domain_of(orbit, i),
    )
    if (
        touches
    ):  # whether a touch is met is a matter of rounding; where the solution is there is not
        return float(np.max(np.abs(path.last[2] - [end[1], 0.0])))
    assert path.itinerary == (orbit.itinerary[i],), (orbit, i, path.itinerary)
    period = 2.0 * np.pi / orbit.params["Omega"]
    time = path.cycles[0] * period + path.times[0]
    # a nearly tangential exit is where its rate says: what it misses is the error of the observable
    rate = min(1.0, abs(float(exit_rate(orbit, i))))
    return max(abs(time - end[0]) * rate, float(np.max(np.abs(path.states[0] - [end[1], 0.0]))))


def exit_rate(orbit: cf.Orbit, i: int) -> float:
    at = [k for k, t in enumerate(orbit.system.tests) if t.margin.value == "exit"]
    return orbit.margins[at[i % orbit.system.segments]]


def held_errors(orbit: cf.Orbit, i: int) -> Iterator[tuple[str, float]]:
    """During a hold the mass is at rest, and may be and may leave; at its start it is pinned."""
    S, S0 = orbit.params["S"], orbit.params["S0"]
    (begin, x, _), end = orbit.cycle[i], orbit.ends[i]
    yield "hold at rest", max(abs(end[1] - x), abs(end[2]))
    loads = np.array([load(orbit, t, x) for t in np.linspace(begin, end[0], 50)])
    yield "hold |u| <= S0", max(0.0, float(np.max(np.abs(loads))) - S0)
    side = -1.0 if orbit.itinerary[(i + 1) % len(orbit.itinerary)][0] == "slide+" else 1.0
    yield "hold could be left", max(0.0, S - float(np.min(side * loads)))
    before = orbit.itinerary[i - 1][0]
    if orbit.itinerary[i][1] != TOUCH:  # SS
        yield "pin on the surface", abs(side * loads[0] - S0)
    elif before == "stick":  # AS: on the limit, and stationary
        omega, h = orbit.params["Omega"], orbit.params["h"]
        slope = omega * (np.sin(omega * begin) + 3.0 * h * np.sin(3.0 * omega * begin))
        yield "pin at the limit", max(abs(side * loads[0] - S0), abs(slope))
    else:  # GS: a stop without acceleration
        yield "pin at rest", abs(side * loads[0] - S)


def undecided(orbit: cf.Orbit) -> bool:
    watched = [t.margin.value in ("interior", "joint") for t in orbit.system.tests]
    return bool(np.min(orbit.margins[watched], initial=np.inf) < UNDECIDED)


@each_case
def test_every_orbit_is_a_motion_of_the_inclusion(case: int | str) -> None:
    found = diagram(case)
    for _, branch in computed(found):
        step = 1 if branch.bridge else max(1, len(branch) // 8)
        places = [k for k in range(1, len(branch) - 1, step) if not undecided(branch[k])]
        spans = np.ptp(branch.values) / (found.range[1] - found.range[0])
        assert len(places) > 0 or len(branch) < 3 or spans < SAME_VALUE, branch
        for k in places:
            for what, error in motion_errors(branch[k]):
                assert error <= MOTION, (branch, k, what)


# ------------------------------------------------------------------- joined at the ends


def gaps(found: cf.Diagram, index: int, side: int) -> Iterator[tuple[float, float]]:
    """Distances (parameter relative to the range, motion) to the other tips at the event of an end.

    The solution and not the stops: at GS a touch of rest is a stop of the orbit with the hold only.
    """
    branch = found.branches[index]
    event = branch.ends[side].bifurcation
    here, width = branch[-side], found.range[1] - found.range[0]
    for node in found.nodes:
        if index not in node.branches or event is None or node.bifurcation.kind != event.kind:
            continue
        away = abs(node.bifurcation.params[found.parameter] - event.params[found.parameter])
        if away > width * max(event.accuracy, node.bifurcation.accuracy):
            continue
        for i in node.branches:
            for k in (0, 1):
                if (i, k) == (index, side):
                    continue
                tip = found.branches[i][-k]
                value = abs(tip.params[found.parameter] - here.params[found.parameter]) / width
                if value < 1e-4:  # far above any accuracy
                    yield value, apart(tip, here)


@each_case
def test_both_ends_of_a_bridge_meet_a_branch(case: int | str) -> None:
    found = diagram(case)
    for index, branch in computed(found):
        for side, end in enumerate(branch.ends):
            if not branch.bridge or end.bifurcation is None or end.reason is EndReason.REST:
                continue
            if end.reason in (
                EndReason.BP,
                EndReason.PD,
            ):  # it meets the inside of a branch, no end
                assert not any((e.branch, e.side) == (index, side) for e in found.loose_ends)
                continue
            accuracy = end.bifurcation.accuracy
            rough = accuracy > ACCURACY
            values, motion = (accuracy, accuracy**0.5) if rough else (SAME_VALUE, SAME_SOLUTION)
            met = list(gaps(found, index, side))
            assert any(v <= values and m <= motion for v, m in met), (branch, end, met)


@pytest.mark.parametrize("case", CHOSEN)
def test_both_sides_of_an_end_are_located_alone(case: str) -> None:
    """A branch starts where another has ended; traced anew from its middle it ends in the same place."""
    found = diagram(case)
    ends = 0
    for index, bridge in computed(found):
        for side, end in enumerate(bridge.ends):
            if not bridge.bridge or end.reason not in JUMPS:
                continue
            b = end.bifurcation
            if b is not None and b.symmetric and not bridge.symmetric:
                continue  # singular there without damping: located to the root of rounding alone
            others = [
                other
                for node in found.nodes
                if index in node.branches and node.bifurcation.kind.name == end.reason.name
                for i in node.branches
                if i != index and not (other := found.branches[i]).mirrored
            ]
            tip = nearest_end(found, bridge, bridge[-side])
            gaps = []
            for other in others:
                met = nearest_end(found, other, bridge[-side])
                value = abs(met.params[found.parameter] - tip.params[found.parameter])
                gaps.append((value / (found.range[1] - found.range[0]), apart(met, tip)))
            assert any(v <= SAME_VALUE and m <= SAME_SOLUTION for v, m in gaps), (bridge, end, gaps)
            ends += 1
    assert ends >= 2


def nearest_end(found: cf.Diagram, branch: cf.Branch, tip: cf.Orbit) -> cf.Orbit:
    middle = branch[len(branch) // 2]
    again = cf.continue_orbit(middle, found.parameter, found.range, stability=False)
    wanted = tip.params[found.parameter]
    return min((again[0], again[-1]), key=lambda o: abs(o.params[found.parameter] - wanted))


@each_case
def test_nothing_is_loose_and_all_is_connected(case: int | str) -> None:
    found = diagram(case)
    assert found.complete
    assert any(branch.bridge for branch in found.branches)
    assert not found.loose_ends, [str(loose) for loose in found.loose_ends]
    graph = nx.Graph(found.graph)
    graph.add_edges_from((i - 1, i) for i, b in enumerate(found.branches) if b.mirrored)
    assert nx.is_connected(graph)


@each_case
def test_ends_of_bridges_have_their_reasons(case: int | str) -> None:
    found = diagram(case)
    allowed = JUMPS | {EndReason.RANGE, EndReason.LIMIT, EndReason.REST, EndReason.CLOSED}
    for _, branch in computed(found):
        if branch.bridge:
            # what may end any branch: another stop at CS, another symmetry, another period
            allowed |= {EndReason.CS, EndReason.BP, EndReason.PD}
            assert {end.reason for end in branch.ends} <= allowed, branch
            assert not branch.stable.any()


@pytest.mark.parametrize("case", [*CHOSEN, 1, 29])
def test_the_same_twice(case: int | str) -> None:
    first, again = diagram(case), diagram.__wrapped__(case)
    assert len(first.branches) == len(again.branches)
    for one, other in zip(first.branches, again.branches, strict=True):
        assert np.array_equal(one.joints, other.joints)
        assert np.array_equal(one.values, other.values)
    assert [str(b) for b in first.bifurcations] == [str(b) for b in again.bifurcations]


def test_the_chosen_ones_have_each_kind() -> None:
    kinds, most = set(), 0
    for case in CHOSEN:
        found = diagram(case)
        for _, branch in computed(found):
            if branch.bridge:
                kinds |= {end.reason.name for end in branch.ends}
                most = max(most, len(branch.system.holds) * (2 if branch.symmetric else 1))
    assert {"SS", "AS", "GS"} <= kinds
    assert most >= 3


# ----------------------------------------------------------------- continuous events (CS)


def apart(one: cf.Orbit, other: cf.Orbit) -> float:
    """Distance of two solutions, up to whole periods and the mirror image."""
    if other.periods > one.periods:
        one, other = other, one
    forcing = one.period / one.periods
    times = np.linspace(0.0, one.period, 40)
    wanted = np.array([one.state(t) for t in times])
    return min(
        float(np.max(np.abs(np.array([image.state(t + k * forcing) for t in times]) - wanted)))
        for image in (other, other.mirror())
        for k in range(other.periods)
    )


def crossings(case: int | str) -> list[Any]:
    return [n for n in diagram(case).nodes if n.bifurcation.kind is cf.Kind.CS and not n.mirrored]


def test_some_scenes_have_crossings() -> None:
    assert sum(bool(crossings(case)) for case in (*CHOSEN, *SEEDS[:7])) >= 3


@each_case
def test_at_cs_both_itineraries_have_the_same_orbit(case: int | str) -> None:
    found = diagram(case)
    for node in crossings(case):
        tips = [
            found.branches[i][-k]
            for i in node.branches
            for k in (0, 1)
            if found.branches[i].ends[k].reason is EndReason.CS
            and abs(
                found.branches[i][-k].params[found.parameter]
                - node.bifurcation.params[found.parameter]
            )
            < 1e-8
        ]
        tips = [
            t for t in tips if stops_distance(t.stops, node.bifurcation.orbit.stops, True) < 1e-4
        ]
        assert len(tips) >= 2, node
        limit = max(1e-10, 0.0 if node.bifurcation.accuracy <= ACCURACY else 1e-4)
        for tip in tips[1:]:
            assert apart(tips[0], tip) <= limit, (node.bifurcation, tip)


def long_run(count: int, first: int) -> None:
    """Run all checks on many scenes and say what fails."""
    checks = [
        test_every_orbit_is_a_motion_of_the_inclusion,
        test_both_ends_of_a_bridge_meet_a_branch,
        test_nothing_is_loose_and_all_is_connected,
        test_ends_of_bridges_have_their_reasons,
        test_at_cs_both_itineraries_have_the_same_orbit,
    ]
    done = bridges = failed = 0
    for seed, orbit, scene in scenes(count, first):
        settled()[seed] = orbit, scene
        found = diagram(seed)
        done += 1
        bridges += sum(branch.bridge for _, branch in computed(found))
        for check in checks:
            try:
                check(seed)
            except AssertionError as error:
                failed += 1
                print(seed, check.__name__, str(error)[:600].replace("\n", " "))
    print(f"{done} scenes, {bridges} bridges, {failed} checks failed")


if __name__ == "__main__":
    long_run(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0)
