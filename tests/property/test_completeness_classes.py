"""Classes of scenes whose diagrams once depended on the start: what was wrong with each, and that it is not.

The scenes are those of the stress run (``benchmarks/stress/restarts.py``), by seed and index.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import restarts
from report import Tally
from typed import typed

import contfric as cf
from contfric.atlas.completeness.balance import _solved_at
from contfric.atlas.exploration import Exploration
from contfric.atlas.leaving.faults import fault_of
from contfric.continuation.accuracy.moved_by_errors import duration_error
from contfric.continuation.families.continuum import is_continuum
from contfric.continuation.located_event import ROUGH
from contfric.continuation.points import settings_of
from contfric.continuation.singular_points.arms import arms_at
from contfric.continuation.singular_points.openings import with_openings
from contfric.events.doubling_point import _LOCATED, Line, opening
from contfric.orbit.index import opening_sign

#: Scenes by what was wrong with them.
CLASSES: dict[str, tuple[tuple[int, int], ...]] = {
    "a vertex on a bridge, next to a fold of the simpler bridge": (
        (1, 495),
        (1, 640),
        (1, 907),
        (1, 2105),
    ),
    "a branch point next to a sliding event, nearer than parameters can tell": (
        (2, 101),
        (1, 2097),
        (1, 1268),
    ),
    "a hold that grows slowly": ((2, 58),),
    "a branch point of a bridge next to its end": ((2, 169),),
    "a hold on a limit from which its load no longer falls": ((1, 2323), (1, 2146)),
    "two holds end at once, and Newton fails just before it": ((31, 25),),
    "a touch that splits into two of equal height": ((21, 3),),
    "a unit of a bridge that turns as one, over two of which its hold is longer, then shorter": (
        (34, 61),
    ),
    "a bridge that is its own image beyond a fold of symmetric orbits": ((34, 112),),
    "an end of a bridge that rounding places anywhere": ((34, 204),),
    "a narrow bridge whose last margin is nearly reached": ((39, 48),),
    "two slides that vanish together, one of them first on another curve": ((40, 10),),
    "a stick that a slow load makes short, and that still ends in a jump": ((34, 360),),
    "a slide of no length between two crests of equal height": ((50, 62),),
    "two touches within one step": ((1, 435), (1, 1117), (1, 2243), (1, 2331), (1, 2413)),
}
#: Others with a branch point or a doubling of a bridge.
OPENINGS = ((2, 48), (4, 70))
#: Random scenes of a slow run: as many as take a few minutes.
MANY = range(150)


@cache
def diagram(seed: int, index: int) -> cf.Diagram:
    found = restarts.scene(seed, index)
    orbit = cf.find_orbit("coulomb", found.params, longest=1000)
    return cf.explore(orbit, found.vary, found.range)


@pytest.mark.parametrize("name", CLASSES)
def test_the_same_from_every_branch(name: str) -> None:
    checked = 0
    for seed, index in CLASSES[name]:
        found = diagram(seed, index).verify(restarts=4)
        assert found.passed, (seed, index, str(found))
        checked += len(found.restarts)
    assert checked >= len(CLASSES[name])


def test_two_margins_that_vanish_together_at_a_singular_point() -> None:
    """The place is known to the root of rounding: that of a jump of Newton's method is not it."""
    found = diagram(34, 142)
    (simple,) = (e for e in found.of_kind("GS") if e.symmetric and e.params["h"] > 0.0559)
    restarts = found.verify(restarts=6).restarts
    assert len(restarts) == 6 and all(restart.same for restart in restarts), restarts
    near = [e for e in found.of_kind("GS") if abs(e.params["h"] - simple.params["h"]) < 1e-6]
    assert len(near) > 1
    for event in near:
        known = event.accuracy * (found.range[1] - found.range[0])
        assert abs(event.params["h"] - simple.params["h"]) < known


def test_a_slow_load_is_known_well_enough_for_its_bridge() -> None:
    """Where it stands still a stop is known to the root of rounding, where it is only slow to rounding."""
    for share in (0.0, 1e-7, -1e-7):
        found = restarts.scene(34, 360)
        params = {**found.params, "S": found.params["S"] * (1.0 + share)}
        orbit = cf.find_orbit("coulomb", params, longest=1000)
        explored = cf.explore(orbit, found.vary, found.range)
        assert not explored.loose_ends, (share, explored.loose_ends)
        short = [b for b in explored.branches if b.bridge and np.ptp(b.values) < 1e-5]
        assert short and all(o.admissible for b in short for o in b)
        ends = [end.bifurcation for b in short for end in b.ends if end.bifurcation is not None]
        width = found.range[1] - found.range[0]
        assert all(event.accuracy * width < 0.01 * np.ptp(short[0].values) for event in ends)


def test_no_slide_moves_nothing_all_along_a_branch() -> None:
    """Two crests of a symmetric force are equally high: a stick that touches both may be held at the second.

    Held at the first as well, it would have to slide in between, and by nothing.
    """
    rng = np.random.default_rng(2)
    scene = {"Omega": 0.1004407, "S": 0.0512191, "S0": 0.0863105, "zeta": 9.54e-4}
    slides = 0
    for _ in range(7):
        params = {name: value * rng.uniform(0.985, 1.015) for name, value in scene.items()}
        orbit = cf.find_orbit("coulomb", {**params, "h": -0.143}, longest=300)
        for branch in cf.explore(orbit, "h", (-0.23, -0.13)).branches:
            x = branch.joints[1:-1, :, 1]
            moved = np.abs(np.roll(x, -1, axis=1) - x)
            sliding = [i for i, (mode, _) in enumerate(branch.system.itinerary) if "slide" in mode]
            within = [i for i in sliding if i + 1 < moved.shape[1]]  # a half ends at its image
            assert np.all(moved[:, within].max(axis=0) > 1e-9), (params, branch.name)
            slides += len(within)
    assert slides > 300


def test_an_event_is_no_jump_to_another_curve() -> None:
    """Without damping curves of asymmetric slides cross next to a switching-sliding: they are not its end."""
    found = restarts.scene(50, 369)
    orbit = cf.find_orbit("coulomb", {**found.params, "h": 0.057}, longest=300)
    explored = cf.explore(orbit, "h", (0.056, 0.075), max_periods=1)
    (bridge,) = (b for b in explored.branches if b.name == "2a, 10seg, 1hold" and not b.mirrored)
    symmetric = [e.params["h"] for e in explored.of_kind("SS") if e.symmetric]
    rng, known = np.random.default_rng(1), min(symmetric)
    for step in (0.0031, *rng.uniform(1e-3, 0.01, 9)):
        again = cf.continue_orbit(bridge[len(bridge) // 2], "h", (0.056, 0.075), max_step=step)
        assert abs(again.values.min() - known) < 5e-8, step  # a slide is known to 2e-5 there
        assert all(point.admissible for point in again), step


def test_a_doubling_just_before_a_tangential_release() -> None:
    """There a multiplier passes -1, then infinity: at the located release its sign is that of rounding."""
    found = restarts.scene(34, 476)
    orbit = cf.find_orbit("coulomb", found.params, longest=1000)
    explored = cf.explore(orbit, found.vary, found.range, max_periods=2, copies=1)
    branch = next(
        b
        for b in explored.branches
        if b.system.periods == 1 and any(e.kind == "PD" for e in b.bifurcations)
    )
    (doubling,) = (e for e in branch.bifurcations if e.kind == "PD")
    release = branch.ends[1].bifurcation
    assert release is not None and release.kind == "AS"
    width = found.range[1] - found.range[0]
    gap = abs(doubling.params["zeta"] - release.params["zeta"]) / width
    assert doubling.accuracy < 1e-3 * gap < 1e-8
    assert any(proposal.branch is not None for proposal in doubling.proposals)
    for start in (1, 3, 4):
        for step in (None, 0.0062, 0.003, 0.001):
            again = cf.continue_orbit(branch[start], found.vary, found.range, max_step=step)
            (event,) = (e for e in again.bifurcations if e.kind == "PD")
            assert abs(event.params["zeta"] - doubling.params["zeta"]) < 1e-10 * width


@pytest.mark.parametrize(("friction", "limit"), [(0.25, 0.3), (0.25, 0.33), (0.32, 0.33)])
def test_a_bridge_that_ends_at_a_symmetric_orbit(friction: float, limit: float) -> None:
    """There its hold is as long as the stick of the other half, and another curve crosses.

    Tangents are rounding at that point. A fold was named where their slope jumps, and the search for what
    turns there ended with an error: one half of the solution has a hold, the other none. The symmetric
    branch knows the event better than the bridge does: from where the bridge ends it began outside.
    """
    params = {"Omega": 0.5, "S": friction, "S0": limit, "h": 0.0, "zeta": 0.0}
    found = cf.explore(cf.find_orbit("coulomb", params), "Omega", (0.4, 0.6))
    verified = found.verify()
    assert len(verified.restarts) == 6 and verified.same, str(verified)
    assert verified.passed, str(verified)
    (bridge,) = (
        b
        for b in found.branches
        if b.bridge
        and not b.mirrored
        and not b.symmetric
        and any(end.bifurcation is not None and end.bifurcation.symmetric for end in b.ends)
    )
    for k in range(2, len(bridge) - 2, 3):
        again = cf.continue_orbit(bridge[k], "Omega", (0.4, 0.6), max_step=0.0062)
        assert not [event for event in again.bifurcations if event.kind == "SN"]


def test_units_that_differ_in_their_holds_have_no_arms() -> None:
    """An orbit near a symmetric one may have a hold in one half and a stick in the other."""
    params = {"Omega": 0.5, "S": 0.25, "S0": 0.33, "h": 0.0, "zeta": 0.0}
    found = cf.explore(cf.find_orbit("coulomb", params), "Omega", (0.4, 0.6))
    checked = 0
    for branch in (b for b in found.branches if b.bridge and not b.symmetric):
        for tip, end in zip((branch[0], branch[-1]), branch.ends, strict=True):
            symmetric = end.bifurcation is not None and end.bifurcation.symmetric
            if symmetric and len(tip.as_whole().system.holds) == 1:
                assert arms_at(tip) is None
                checked += 1
    assert checked


@pytest.mark.slow
def test_many_random_scenes() -> None:
    """Another seed than that of the quick share: no difference outside of the degenerate classes."""
    tally = Tally()
    for index in MANY:
        tally.index = index
        restarts.one_scene(tally, restarts.scene(2, index), most=3, branches=60)
    assert not tally.failed, tally.failed
    assert tally.counts["restarts"] > len(MANY)


def test_a_bridge_without_damping_ends_where_its_end_is_known() -> None:
    """Where a continuum of holds seems to be many bridges, none of them is one; all points are admissible."""
    found = diagram(34, 204)
    assert len(found.branches) < 20
    assert all(orbit.admissible for branch in found.branches for orbit in branch)
    for branch in found.branches:
        ends = [end.bifurcation for end in branch.ends if end.bifurcation is not None]
        assert not branch.bridge or all(event.accuracy < 1.0 for event in ends)


def test_a_narrow_bridge_is_held_against_how_well_its_ends_are_known_in_its_own_units() -> None:
    """Two bridges that pass one rest are run through one after the other: its ends are singular twice.

    They are known to a share of the range, which is narrow: a bridge that is narrower than that share as a
    number is wide enough.
    """
    found = restarts.scene(43, 23)
    for name, share in (("S0", 0.0), ("h", -1e-3)):
        params = {**found.params, name: found.params[name] * (1.0 + share)}
        orbit = cf.find_orbit("coulomb", params, longest=1000)
        explored = cf.explore(orbit, found.vary, found.range, max_periods=2)
        assert explored.complete and not explored.loose_ends, (name, share)
        balances = explored.verify(restarts=0).balances
        assert len(balances) > 10 and all(balance.holds for balance in balances)
        width = found.range[1] - found.range[0]
        narrow = [
            cf.continue_orbit(branch[len(branch) // 2], found.vary, found.range)
            for branch in explored.branches
            if len(branch.system.holds) == 3 and np.ptp(branch.values) < 1e-5
        ]
        assert narrow and all(fault_of(branch, width) is None for branch in narrow)
        known = [max(e.bifurcation.accuracy for e in b.ends if e.bifurcation) for b in narrow]
        own = [float(np.ptp(branch.values)) for branch in narrow]
        assert any(w * width < o < w for w, o in zip(known, own, strict=True)), (known, own)


def test_a_bridge_reaches_the_limit_at_which_it_turns_in_any_step() -> None:
    """Without friction all orbits of two natural periods are a continuum, and singular: S is a square there.

    A step beyond the vertex, where holds are negative, gave a fold that was not located, up to S = 0.002.
    """
    rng, reached = np.random.default_rng(5), 0
    for limit in rng.uniform(0.38, 0.42, 3):
        params = {"Omega": 0.5, "S": 0.041, "S0": float(limit)}
        diagram = cf.explore(cf.find_orbit("coulomb", params), "S", (0.0, 0.1))
        bridges = [b for b in diagram.branches if not b.mirrored and b.values.min() < 1e-4]
        assert len(bridges) == 2 and not diagram.loose_ends
        for bridge in bridges:
            for _ in range(10):
                step, k = float(10.0 ** rng.uniform(-2.3, -0.4)), int(rng.integers(len(bridge)))
                if bridge.values[k] < 1e-4:
                    continue
                again = cf.continue_orbit(bridge[k], "S", (0.0, 0.1), max_step=step)
                assert {end.reason for end in again.ends} == {end.reason for end in bridge.ends}
                assert cf.Kind.SN not in {b.kind for b in again.bifurcations}, (limit, step)
                assert again.values.min() < 1e-7, (limit, step)
                reached += 1
    assert reached > 25


def test_a_doubling_next_to_an_infinite_multiplier_is_found_from_either_side() -> None:
    """It passes -1 at 4e-5 from the AS at which it is infinite: nobody saw it in a first step from there."""
    rng, low, high = np.random.default_rng(6), 0.26070, 0.26081
    params = {"Omega": 0.10142708114, "S": 0.168751473, "h": 0.45396473416, "zeta": 0.00810911}
    for share in rng.uniform(-1e-5, 1e-5, 3):
        here = {**params, "S0": 0.26075, "S": params["S"] * (1.0 + float(share))}
        diagram = cf.explore(cf.find_orbit("coulomb", here, longest=1000), "S0", (low, high))
        bridge = next(b for b in diagram.branches if b.bridge)
        again = cf.explore(bridge[len(bridge) // 2], "S0", (low, high))
        found = [
            [b.params["S0"] for b in d.bifurcations if b.kind is cf.Kind.PD]
            for d in (diagram, again)
        ]
        assert len(found[0]) == len(found[1]) == 1, share
        assert abs(found[0][0] - found[1][0]) < 1e-11, share


@pytest.mark.parametrize("share", [0.0, -5.8e-7, -1.7e-5])
def test_a_hold_that_turns_back_at_once_is_told_from_none(share: float) -> None:
    """An orbit returns to a stop on the limit with hardly any of its disturbance: twice, a hold in between.

    With f the map of a disturbance d there, ``f(d) = c lambda + k d (d - d1)``, d1 of 1e-5, the stop that is
    held is on the limit where f vanishes, and its hold is in proportion to lambda: a parabola in d, of the
    order of ``d1^2`` at most. The bridge turns where d is ``d1 / 2`` and ends where it began but for d.
    """
    found = restarts.scene(42, 48)
    params = {**found.params, "S": found.params["S"] * (1.0 + share), "zeta": -0.025}
    orbit = cf.find_orbit("coulomb", params, longest=1000)
    explored = cf.explore(orbit, "zeta", (-0.0254, -0.0249), max_periods=4)
    assert explored.complete and not explored.loose_ends
    verified = explored.verify(restarts=1 if share == 0.0 else 0)
    assert verified.passed and len(verified.balances) >= 5, str(verified)
    (bridge,) = (b for b in explored.branches if np.ptp(b.nodes[1]) < 1e-9 and not b.mirrored)
    (fold,) = (b for b in bridge.bifurcations if b.kind == "SN")
    assert not is_continuum(bridge)
    lasts = fold.orbit.ends[:, 0] - fold.orbit.cycle[:, 0]
    hold = min((h.segment for h in bridge.system.holds), key=lambda h: float(lasts[h]))
    error = duration_error(fold.orbit, fold.orbit.model.index_of("zeta"), hold)
    assert error is not None and 0.0 < error < 0.1 * lasts[hold]
    # a parabola: from the middle to the ends the hold and the parameter go by the same share
    for end in (0.25, 0.75):
        solved = _solved_at(bridge, end * float(bridge.arc[-1]), 5e-4)
        assert solved is not None and solved.admissible
        shorter = float(solved.ends[hold, 0] - solved.cycle[hold, 0]) / lasts[hold]
        limit, vertex = (float(b.params["zeta"]) for b in (bridge.ends[0].bifurcation, fold))
        nearer = (limit - solved.params["zeta"]) / (limit - vertex)
        assert abs(shorter - nearer) < 1e-3 and 0.6 < shorter < 0.9


def test_where_a_hold_turns_by_itself_its_fold_is_no_doubling(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Both determinants vanish at such a fold: that of a long chain has no sign from some distance on.

    In scene 210 one of 75 segments had none from a tenth of a step on, and the secant failed: a doubling was
    told there, 30 accuracies from the fold. Here the sign is taken away as near as that.
    """

    def sign(there: cf.Orbit) -> int | None:
        return None if abs(opening(there)) < 3e-8 else opening_sign(there)

    found = restarts.scene(42, 48)
    orbit = cf.find_orbit("coulomb", {**found.params, "zeta": -0.025}, longest=1000)
    explored = cf.explore(orbit, "zeta", (-0.0254, -0.0249), max_periods=4)
    bridge = next(b for b in explored.branches if len(b.system.holds) == 1)
    monkeypatch.setattr("contfric.continuation.singular_points.openings.opening_sign", sign)
    monkeypatch.setattr(
        "contfric.continuation.singular_points.openings.refined_opening", lambda *_: None
    )
    passed = 0
    for step in 0.01 * 10.0 ** np.random.default_rng(3).uniform(-1.0, 0.5, 6):
        middle = bridge[len(bridge) // 2]
        settings = settings_of(middle, "zeta", (-0.02522, -0.02517), float(step), False, 2)
        branch = cf.continue_orbit(middle, "zeta", explored.range, max_step=float(step))
        signs = [opening_sign(there) for there in branch]
        passed += 1 in signs and -1 in signs
        opened = with_openings(branch, replace(settings, copies=4))
        kinds = [b.kind.value for b in opened.bifurcations if b.kind in ("SN", "BP", "PD")]
        assert kinds == ["SN"], (step, kinds)
    assert passed > 1


def test_bridges_have_their_doublings_when_copies_are_raised() -> None:
    """A bridge that was traced with one copy has none, and only a restart with more of them found any."""
    rng, found, ends = np.random.default_rng(4), 0, (0.458, 0.519)
    for friction in rng.uniform(0.2037, 0.2049, 2):
        params = {"Omega": 0.4885, "S": float(friction), "S0": 0.31744, "zeta": -0.008924}
        orbit = cf.find_orbit("coulomb", params)
        asked = settings_of(orbit, "Omega", ends, None, True, 20_000)
        state = Exploration(replace(asked, copies=1), 2, 1, 3000, True, None)
        one = cf.explore(orbit, "Omega", ends, max_periods=2, copies=1)
        for branch in one.branches:
            if not branch.mirrored:
                state.add(branch)
        assert not any(event.bifurcation.kind is cf.Kind.PD for event in state.events)
        state.raise_copies(2)
        raised = [e for e in state.events if e.bifurcation.kind is cf.Kind.PD]
        assert all(event in state.waiting for event in raised)
        met = {e.bifurcation.params["Omega"] for e in raised}
        both = cf.explore(orbit, "Omega", ends, max_periods=2, copies=2).bifurcations
        for b in (b for b in both if b.kind is cf.Kind.PD and b.orbit.periods == 1):
            assert min(abs(b.params["Omega"] - value) for value in met) < 1e-10
            found += 1
    assert found >= 2


def test_orbits_between_two_points_are_as_far_along_as_is_asked() -> None:
    """Solved normal to a chord in the product of a narrow branch, they were up to half a step elsewhere."""
    rng, solved = np.random.default_rng(8), 0
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    diagram = cf.explore(orbit, "Omega", (0.4, 0.6))
    width = diagram.range[1] - diagram.range[0]
    for branch in (b for b in diagram.branches if not b.mirrored):
        arcs = branch.nodes[0]
        for k in rng.integers(1, len(arcs), 12):
            step, share = arcs[k] - arcs[k - 1], float(rng.uniform(0.2, 0.8))
            if step < 1e-6:
                continue
            before = branch.between(float(arcs[k - 1]))
            there = _solved_at(branch, float(arcs[k - 1] + share * step), width)
            assert there is not None
            off = (there.params["Omega"] - before.params["Omega"]) / width
            moved = np.sqrt(np.mean(np.sum((there.joints - before.joints) ** 2, axis=1)) + off**2)
            assert abs(moved - share * step) < 1e-3 * step, (branch.name, k, share)
            solved += 1
    assert solved > 40


def test_branches_that_end_nearer_to_their_vertex_than_they_can_be_solved() -> None:
    """Next to a slide of no length a multiplier passes 1 at a distance in proportion to the damping.

    What leaves the branch point there ends at once: it was refused, and with it a bridge and a branch over
    half of the range that nothing else leads to. At the largest damping Newton's method solves for all of it.
    """
    found, lengths = restarts.scene(45, 7), []
    rng = np.random.default_rng(0)
    for damping in (1e-4, *10.0 ** rng.uniform(-8.5, -5.5, 2)):
        orbit = cf.find_orbit("coulomb", {**found.params, "zeta": float(damping)}, longest=1000)
        explored = cf.explore(orbit, found.vary, found.range)
        assert len(explored.branches) == 13 and not explored.loose_ends, damping
        (short,) = (b for b in explored.branches if b.arc[-1] < 1e-3 and not b.mirrored)
        assert [end.reason.name for end in short.ends] == ["BP", "SS"]
        assert all(o.admissible and o.converged and o.residual < 1e-12 for o in short), damping
        assert explored.verify(restarts=2).passed, damping
        lengths.append(float(short.arc[-1]) / damping)
    assert np.ptp(lengths) < 0.02 * lengths[0], lengths


@pytest.mark.slow
def test_a_bridge_that_begins_where_a_short_branch_ends() -> None:
    """What is held is negative between that end and the next event, by the square of 1e-8: it began there."""
    found = restarts.scene(42, 56)
    for damping in (1e-9, 7e-10, 3e-7):
        orbit = cf.find_orbit("coulomb", {**found.params, "zeta": damping}, longest=1000)
        explored = cf.explore(orbit, found.vary, found.range)
        assert not explored.loose_ends and len(explored.branches) == 11, damping
        assert explored.verify(restarts=4).passed, damping


@pytest.mark.parametrize("share", [1.0, 0.7, 1.3, 0.4])
def test_where_a_bridge_begins_does_not_depend_on_the_range(share: float) -> None:
    """A short branch and the next event are 1e-5 apart: whatever part of a narrow range that is."""
    found = restarts.scene(55, 321)
    damping = share * found.params["zeta"]
    orbit = cf.find_orbit("coulomb", {**found.params, "zeta": damping}, longest=1000)
    explored = cf.explore(orbit, "h", (0.005, 0.03))
    assert len(explored.branches) == 11 and not explored.loose_ends
    assert explored.verify(restarts=0).passed


def test_what_leaves_a_branch_point_does_not_begin_beyond_an_event() -> None:
    """Damping of 1e-9: a bridge ends 1e-8 from a branch point, nearer than what leaves it can be started."""
    found = restarts.scene(42, 56)
    for damping in (7e-10, 2e-9, 3e-9):
        orbit = cf.find_orbit("coulomb", {**found.params, "zeta": damping}, longest=1000)
        explored = cf.explore(orbit, found.vary, found.range)
        assert len(explored.of_kind("BP")) > 1 and not explored.loose_ends
        assert all(o.admissible for branch in explored.branches for o in branch), damping


@pytest.mark.slow
def test_each_sequence_of_arms_is_one_branch() -> None:
    """What passes a fold ends there, or goes on with all arms exchanged: one bridge was there twice."""
    found = restarts.scene(36, 36)
    for share in (0.005, 0.0):
        params = {**found.params, "S": found.params["S"] * (1.0 + share), "h": 0.14}
        orbit = cf.find_orbit("coulomb", params, longest=1000)
        explored = cf.explore(orbit, "h", (0.11, 0.145), max_periods=3)
        (node,) = [n for n in explored.events if n.bifurcation.kind == "SN" and not n.mirrored]
        assert len(node.branches) > 20  # sequences of up to six half periods
        balances = explored.verify(restarts=0).balances
        assert len(balances) > 30 and all(balance.holds for balance in balances), share


def test_orbits_on_a_curve_that_turns() -> None:
    """Through folds: both sides are solved, and the parameter is on one side of the fold."""
    checked = 0
    for seed, index in [pair for pairs in CLASSES.values() for pair in pairs]:
        found = diagram(seed, index)
        width = found.range[1] - found.range[0]
        for fold in found.of_kind("SN"):
            active = fold.orbit.model.index_of(found.parameter)
            line = Line.through(fold.orbit, active)
            assert line is not None
            value = fold.params[found.parameter]
            for distance in (1e-4, 2e-4):
                sides = [line.at(s * distance) for s in (-1.0, 1.0)]
                if any(side is None for side in sides):
                    continue
                gaps = [float(o.vector[active]) - value for o in sides if o is not None]
                assert all(o is not None and o.converged for o in sides)
                assert gaps[0] * gaps[1] > 0.0 or max(map(abs, gaps)) < 1e-9 * width
                checked += 1
    assert checked > 5


def test_located_openings_open() -> None:
    """What vanishes at a branch point or a doubling of a bridge does so, as the search for it promises."""
    checked = 0
    for seed, index in [*(pair for pairs in CLASSES.values() for pair in pairs), *OPENINGS]:
        found = diagram(seed, index)
        for event in found.bifurcations:
            if event.kind in (cf.Kind.BP, cf.Kind.PD) and event.orbit.system.holds:
                assert abs(opening(event.orbit)) < _LOCATED
                assert event.accuracy <= ROUGH
                checked += 1
    assert checked >= 3  # those at folds at which passages turn by themselves belong to the folds


def test_a_bridge_goes_on_where_its_touch_splits() -> None:
    """At h = -1/9 the maximum of cos t + h cos 3t becomes two; only the time of the pin turns there."""
    found, checked = diagram(21, 3), 0
    low, place = found.range[0], -1.0 / 9.0
    assert low < place and not found.of_kind("SN")
    for event in found.of_kind("AS"):
        if abs(event.params["h"] - place) > 1e-3:
            continue
        assert abs(event.params["h"] - place) < event.accuracy * (found.range[1] - low)
        (node,) = [n for n in found.events if n.bifurcation is event]
        sides = sorted(found.branches[k].values.mean() - place for k in node.branches)
        assert len(sides) == 2 and sides[0] < 0.0 < sides[1]
        checked += 1
    assert checked == 2
    for branch in (b for b in found.branches if b.bridge and not b.mirrored):
        for orbit in (branch[k] for k in range(0, len(branch), 5)):
            for hold in (h for h in orbit.system.holds if h.after_rest):
                h, phase = orbit.params["h"], orbit.cycle[hold.segment, 0] * orbit.params["Omega"]
                if abs(h - place) < 1e-8:  # the event, and points that cannot be told from it
                    continue
                angle = (phase + np.pi / 2.0) % np.pi - np.pi / 2.0  # from the next multiple of pi
                equal = np.arcsin(np.sqrt((9.0 * h + 1.0) / (12.0 * h))) if h < place else 0.0
                assert abs(angle + equal) < 1e-7, (h, angle)


@pytest.mark.parametrize("friction", [0.0716077640887964, 0.05])
def test_a_branch_into_resonance_ends_where_power_balances(friction: float) -> None:
    """At Omega = 1/3 the third harmonic, h cos t, does the work pi h A a turn, and friction takes 4 S A."""
    params = {"Omega": 1.0 / 3.0, "S": friction, "S0": 1.2 * friction, "h": 0.0, "zeta": 0.0}
    orbit = cf.find_orbit("coulomb", params, longest=1000)
    found = cf.explore(orbit, "h", (-0.05, 0.15))
    ends = [
        (branch, end)
        for branch in found.branches
        for end in branch.ends
        if end.reason is cf.EndReason.UNBOUNDED
    ]
    assert len(ends) == 1 and not found.loose_ends
    branch, end = ends[0]
    value = branch.values[0 if end is branch.ends[0] else -1]
    assert abs(4.0 * friction / np.pi - value) < 1e-8
    again = cf.continue_orbit(branch[len(branch) // 8], "h", (-0.05, 0.15), max_step=0.0031)
    assert [e.reason is cf.EndReason.UNBOUNDED for e in again.ends].count(True) == 1
    assert abs(again.values[-1] - value) < 1e-8 or abs(again.values[0] - value) < 1e-8


FIRES = """
name: resonator
states: [x, y]
parameters: {W: 0.9, A: 0.9, I: 0.2}
period: 2*pi/W
surfaces: {fire: {observable: y, level: 1}, s: {observable: x}}
field: {x: -0.1*x - y + I + A*cos(W*t), y: x - 0.1*y}
modes: {a: {in: {fire: -, s: +}}, c: {in: {fire: -, s: -}}}
resets: {fire: {x: -0.3, y: 0.2}}
"""


def test_where_a_firing_comes_in_the_sum_of_indices_jumps(tmp_path: Path) -> None:
    diagram = cf.explore(cf.find_orbit(typed(tmp_path, FIRES), {}), "W", (0.8, 1.0))
    assert [b.kind.value for b in diagram.bifurcations] == ["GS"]  # below it the neuron fires twice
    found = diagram.verify()
    assert found.passed and [b.below for b in found.balances] == [None]


@pytest.mark.parametrize("case", [None, 2, 1, 5])
def test_a_slide_that_nearly_stands_before_it_is_held_begins_where_it_begins(
    case: int | None,
) -> None:
    """Held at a touch or not, the solution at that event is one: its slide begins before the touch."""
    found = restarts.scene(56, 142)
    random = np.random.default_rng([142, case or 0])
    params = dict(found.params)
    if case is not None:
        for name, within in (("S", 0.02), ("h", 0.01), ("S0", 0.02)):
            params[name] *= random.uniform(1.0 - within, 1.0 + within)
    orbit = cf.find_orbit("coulomb", params, longest=1000)
    explored = cf.explore(orbit, found.vary, found.range)
    assert len(explored.branches) >= 5 and explored.verify().passed


@pytest.mark.parametrize("case", range(3))
def test_an_event_at_which_the_pin_of_a_hold_moves_has_one_name(case: int) -> None:
    """A hold touches its limit on its way, or a slide stops tangentially: which depends on the branch."""
    found, random = restarts.scene(56, 3), np.random.default_rng([3, case])
    params = dict(found.params)
    for name in ("S", "S0", "h") if case else ():
        params[name] *= random.uniform(0.97, 1.03)
    orbit = cf.find_orbit("coulomb", params, longest=1000)
    explored = cf.explore(orbit, found.vary, (0.0, 0.05))
    assert len(explored.branches) >= 7
    assert explored.verify(restarts=3).passed


@pytest.mark.parametrize("seed", [1, 7])
def test_a_slide_that_stands_at_an_event_hides_no_branch(seed: int) -> None:
    """Where a slide has shrunk to a stop without acceleration, how long it stands there is free.

    Along that line nothing changes; what is traced may follow it, and the branch leaves in another direction.
    What rests there has no outcome that leads to its form, and over two periods both follow each other.
    """
    draw = np.random.default_rng([57, seed])
    about = {
        "k": 5.05,
        "b": 0.735,
        "m": 0.912,
        "Ff": 0.6547,
        "omega": 1.0864,
        "a": 0.917,
        "e": 0.7775,
    }
    params = {name: value * draw.uniform(0.99, 1.01) for name, value in about.items()}
    orbit = cf.find_orbit("impact-friction", params, state=[-0.08, 0.0], time=-1.5, longest=1000)
    explored = cf.explore(orbit, "k", (4.03, 6.95), max_periods=2)
    assert sorted(branch.system.periods for branch in explored.branches) == [1, 1, 1, 2]
    assert not explored.loose_ends
    assert explored.verify().passed
