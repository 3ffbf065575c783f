"""Local conditions at sliding events: what exists next to one is not refused, whatever is held there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.diagram import Diagram
from contfric.atlas.matching import identity, identity_of
from contfric.bvp.margins import Margin
from contfric.continuation.branch import Branch
from contfric.events.bifurcation import TERMINAL, Kind
from contfric.events.incident.conditions import Relation, possible, relation_of
from contfric.events.incident.incident import incident_forms, vanishing
from contfric.events.local.gradients import gradient_of
from contfric.events.locations import normal_location
from contfric.signature.holds import is_hold

#: In diagrams near this one, in zeta, a hold can just not be left inside any more.
HELD = {"Omega": 0.12784, "S": 0.020946, "S0": 0.046345, "h": 0.04157, "zeta": 0.00483}
WIDTH = 0.06
#: In its diagram, in h, slides stop tangentially.
STOPS = {"Omega": 0.224148285, "S": 0.40331387, "S0": 0.88561545, "h": 0.276719682, "zeta": 1e-7}
#: In diagrams near this one, in zeta, the strip between the limits is narrow: holds cross it in no time.
NARROW = {"Omega": 0.10107, "S": 0.088966, "h": 0.12774, "zeta": 0.00155}
#: In diagrams near this one, in h, holds begin at the first of two maxima that are equal for all parameters.
EQUAL = {"Omega": 0.160638, "S": 0.0236764, "S0": 0.147835, "h": -0.193088, "zeta": 0.0}
#: A rate this large at an exit is the root of what an event is located to.
ROOT = 1e-8


def diagram(seed: int) -> Diagram:
    """Return one of the diagrams, its parameters moved by up to a thousandth."""
    rng = np.random.default_rng(seed)
    moved = {name: value * (1.0 + rng.uniform(-0.001, 0.001)) for name, value in HELD.items()}
    orbit = cf.find_orbit("coulomb", moved, longest=1000)
    return cf.explore(orbit, "zeta", (moved["zeta"] - WIDTH, moved["zeta"] + WIDTH))


def _ahead(branch: Branch, value: float) -> bool:
    """Tell whether a branch lies above the event at which it ends."""
    ends = branch.values[[0, -1]]
    at, inside = ((0, 1), (-1, -2))[int(np.argmin(np.abs(ends - value)))]
    return bool(branch.values[inside] > branch.values[at])


def test_hold_that_cannot_be_left_inside() -> None:
    """The bridge with one hold exists on one side of such an event, that with two holds on the other."""
    asked = 0
    for seed in range(2):
        found = diagram(seed)
        active = found.model.index_of(found.parameter)
        for event in found.events:
            tests = event.bifurcation.tests
            if not any(test.margin is Margin.HELD for test in tests):
                continue
            incident = incident_forms(event.bifurcation)
            relations = [relation_of(form, active, incident.least) for form in incident.forms]
            known = [relation for relation in relations if relation is not None]
            assert len(known) == len(relations) == 2
            sides = possible(known, [(0,), (1,)])
            assert sorted(sides) == [(False, True), (True, False)], sides
            value = event.bifurcation.params[found.parameter]
            ahead = [_ahead(found.branches[index], value) for index in event.branches]
            assert sorted(ahead) == [False, True]
            asked += 1
    assert asked


@pytest.mark.parametrize("seed", range(2))
def test_load_with_equal_maxima(seed: int) -> None:
    """The second maximum is at the limit all along such a bridge: its margin is rounding and says nothing."""
    rng = np.random.default_rng([9, seed])
    moved = {name: value * (1.0 + rng.uniform(-0.001, 0.001)) for name, value in EQUAL.items()}
    orbit = cf.find_orbit("coulomb", moved, longest=1000)
    found = cf.explore(orbit, "h", (-0.252, -0.128))
    active, asked = found.model.index_of("h"), 0
    for event in found.events:
        if event.bifurcation.kind not in TERMINAL:
            continue
        incident, value = incident_forms(event.bifurcation), event.bifurcation.params["h"]
        for form in incident.forms:
            relation = relation_of(form, active, incident.least)
            own = [
                b
                for b in (found.branches[i] for i in event.branches)
                if form.orbit.system.half == b.system.half
            ]
            for branch in (b for b in own if identity_of(b) == identity(form.orbit)):
                assert relation is not None
                assert possible([relation], [(0,)])[0][int(branch.values[len(branch) // 2] > value)]
                asked += any(hold.pin is None for hold in branch.system.holds)
    assert asked > 5


def test_exit_that_is_tangential_to_rounding() -> None:
    """A stop whose time is off by the root of rounding solves the same equations: it is tangential there."""
    orbit = cf.find_orbit("coulomb", STOPS, longest=1000)
    found = cf.explore(orbit, "h", (0.165, 0.424))
    asked = 0
    for event in found.events:
        orbit = event.bifurcation.orbit.as_whole()
        for test in event.bifurcation.tests:
            if event.bifurcation.kind is not Kind.GS or test.margin is not Margin.EXIT:
                continue
            if any(hold.segment == test.segment for hold in orbit.system.holds):
                continue
            joints = orbit.joints.copy()
            joints[(test.segment + 1) % len(joints), 0] -= ROOT * orbit.period
            moved = replace(orbit, joints=joints)
            rate = moved.margins[moved.system.tests.index(test)]
            if not 1e-9 < abs(rate) < 1e-6:
                continue
            places = [place for place, _ in vanishing(moved, 1e-9)]
            assert normal_location(test, moved) in places
            asked += 1
    assert asked


def relay(seed: int) -> Diagram:
    """Return the diagram of a random relay that slides, whose orbits come to touch the surface."""
    rng = np.random.default_rng([7, seed])
    about = {"zeta": 0.05, "lam": 0.05, "k": 1.0, "sigma": -1.0, "rho": 1.0}
    params = {name: value * (1.0 + rng.uniform(-0.2, 0.2)) for name, value in about.items()}
    orbit = cf.find_orbit("relay-sliding", params | {"w": 10.0}, longest=1000)
    return cf.explore(orbit, "w", (9.0, 11.5), max_periods=2)


def test_touches_of_motion_without_excitation() -> None:
    """Each outcome exists on the side that is told; orbits that do both in turn exist on none."""
    asked = 0
    for seed in range(3):
        found = relay(seed)
        active = found.model.index_of(found.parameter)
        for event in found.of_kind("GS"):
            incident = incident_forms(event)
            if len(incident.forms) != 2:
                continue
            known = [relation_of(form, active, incident.least) for form in incident.forms]
            relations = [relation for relation in known if relation is not None]
            assert len(relations) == 2
            told = possible(relations, [(0,), (1,)])
            node = next(n for n in found.events if n.bifurcation is event)
            here = [found.branches[index] for index in node.branches]
            for form, sides in zip(incident.forms, told, strict=True):
                own = [b for b in here if len(b.system.itinerary) == len(form.itinerary)]
                ahead = [_ahead(branch, event.params["w"]) for branch in own]
                assert [(not above, above) for above in ahead] == [sides]
            for in_turn in ((0, 1), (0, 0, 1), (0, 0, 0, 1), (0, 0, 1, 1)):
                assert possible(relations, [in_turn]) == [(False, False)]
            asked += 1
    assert asked


@pytest.mark.parametrize("seed", range(20))
def test_each_sequence_is_told_by_its_own_relations(seed: int) -> None:
    """However many margins vanish at once in others (it was 12 at most), and however often one is told."""
    rng = np.random.default_rng(seed)
    m, relations = 2, []
    for _ in range(3):
        k, limits = int(rng.integers(0, 3)), int(rng.integers(0, 20))
        rows = rng.normal(size=(m + k, 2 * m + 1 + k))
        some = rng.normal(size=(limits, 2 * m + 1 + k))
        # signs for which the unit itself exists above the event, or below
        solved = np.linalg.solve(
            np.hstack([rows[:, :m] + rows[:, m : 2 * m], rows[:, 2 * m + 1 :]]), -rows[:, 2 * m]
        )
        values = some @ np.concatenate([solved[:m], solved[:m], [1.0], solved[m:]])
        some *= (np.sign(values) * rng.choice([1.0, -1.0]))[:, None]
        relations.append(Relation(rows, some, np.zeros(k), np.ones(m)))
    chosen = [(0,), (1,), (2,)]
    alone = [possible([relation], [(0,)])[0] for relation in relations]
    often = [replace(r, margins=np.repeat(r.margins, 5, axis=0)) for r in relations]
    assert possible(relations, chosen) == possible(often, chosen) == alone


@pytest.mark.parametrize("seed", range(3))
def test_margins_of_holds_across_a_narrow_strip(seed: int) -> None:
    """However short such a hold is, its load at the other edge has the gradient of differences."""
    rng = np.random.default_rng([9, seed])
    params = {name: value * (1.0 + rng.uniform(-0.01, 0.01)) for name, value in NARROW.items()}
    params["S0"] = params["S"] * (1.0 + 10.0 ** rng.uniform(-3.6, -3.0))
    orbit = cf.find_orbit("coulomb", params, longest=1000)
    found = cf.explore(orbit, "zeta", (-0.03, 0.03), max_branches=60)
    active, asked = found.model.index_of("zeta"), 0
    for event in found.bifurcations:
        orbit = event.orbit.as_whole()
        for test in event.tests:
            i, count = test.segment, len(orbit.itinerary)
            short = is_hold(orbit.itinerary[i][1]) and orbit.durations[i] < 1e-3
            if not (short and test.margin is Margin.JOINT and i + 1 < count):
                continue
            told = gradient_of(orbit, test, count, active)
            assert told is not None
            k, moves = orbit.system.tests.index(test), []
            for component in range(orbit.joints.shape[1]):
                step = np.zeros(orbit.joints.shape)
                step[i + 1, component] = 1e-5
                near = [replace(orbit, joints=orbit.joints + s * step) for s in (1.0, -1.0)]
                moves.append((near[0].margins[k] - near[1].margins[k]) / 2e-5)
            assert told[0][i + 1] == pytest.approx(moves, abs=1e-8)
            asked += 1
    assert asked
