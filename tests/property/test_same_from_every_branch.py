"""Folds, touches and names of events do not depend on where steps end, nor on the branch that arrives."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.completeness.verification import STEP, differences
from contfric.base.attributes import altered
from contfric.continuation.half_branch import point_before
from contfric.continuation.locating import smooth
from contfric.continuation.points import LARGEST_STEP
from contfric.continuation.singular_points.folds import fold_at
from contfric.events.bifurcation import Kind
from contfric.events.incident.incident import Name, kinds_between

#: A bridge turns over 1e-8 of its range.
FOLD = {"Omega": 0.07742262128103025, "S0": 0.13762082006748685, "h": 0.0, "zeta": 1e-9}
#: A bridge turns, and ends on both sides of its fold within a usual step.
SHORT = {
    "Omega": 0.08455978673933087,
    "S": 0.06637008905438091,
    "S0": 0.12664371489538423,
    "zeta": -0.005,
}
#: An asymmetric branch touches u = 0 next to the point at which it becomes symmetric.
TOUCH = {"Omega": 0.3390492697931732, "S": 0.09820819315675781, "S0": 0.19211709392812384, "h": 0.0}
#: Two holds of a bridge over three periods touch their limit together.
HOLDS = {"Omega": 0.3599045472299525, "S": 0.1533706969500193, "S0": 0.36969068182533193}


def _bridge_folds(monkeypatch, params, parameter, bounds):
    """Return what bridges that hardly turn are asked at their folds, with the located points."""
    asked = []

    def located(step, point):
        if step.orbit.system.holds:
            asked.append((step, point))
        return fold_at(step, point)

    with monkeypatch.context() as patched:
        patched.setattr(smooth, "fold_at", located)
        orbit = cf.find_orbit("coulomb", params, longest=1000)
        cf.explore(orbit, parameter, bounds, max_branches=40)
    return asked


def test_a_fold_is_one_however_near_to_it_a_step_ends(monkeypatch):
    rng = np.random.default_rng(5)
    params = {**FOLD, "S": 0.0810880207884525}
    asked = _bridge_folds(monkeypatch, params, "S", (0.0720337655, 0.0903702620))
    assert asked
    for step, point in asked:
        here = step.orbit_at(point)
        for _ in range(8):
            near, far = 10.0 ** rng.uniform(-7.0, -2.0), 10.0 ** rng.uniform(-4.0, -2.0)
            near, far = (near, far) if rng.random() < 0.5 else (far, near)
            before, after = (
                point_before(here, point, back, step.settings) for back in (near, -far)
            )
            found = fold_at(replace(step, before=before, after=after, beyond=after), point)
            assert [event.kind for event, _ in found] == [Kind.SN]
        # a parameter that goes on in the same direction does not turn
        rising = altered(after, w=2.0 * point.w - after.w)
        monkeypatch.setattr(
            "contfric.continuation.singular_points.folds._farther", lambda _o, _p, sides, _s: sides
        )
        assert not fold_at(replace(step, before=before, after=rising, beyond=rising), point)
        monkeypatch.undo()


def test_a_fold_of_a_short_branch_is_one_however_near_to_it_a_step_ends(monkeypatch):
    """So far away as its parabola is told from rounding in general there are no orbits of it."""
    rng, told = np.random.default_rng(6), 0
    for step, point in _bridge_folds(monkeypatch, SHORT, "zeta", (-0.012, 0.0)):
        here = step.orbit_at(point)
        if min(point.arc, step.length) < 1e-4:
            continue  # at an event at either end, next to which slopes are rounding
        for _ in range(4):
            near, far = 10.0 ** rng.uniform(-7.0, -5.0), 10.0 ** rng.uniform(-4.0, -3.0)
            before, after = (
                point_before(here, point, back, step.settings) for back in (far, -near)
            )
            found = fold_at(replace(step, before=before, after=after, beyond=after), point)
            assert [event.kind for event, _ in found] == [Kind.SN]
            told += 1
    assert told


@pytest.mark.parametrize("seed", range(4))
def test_touches_next_to_a_branch_point_are_found_towards_it_and_away_from_it(seed):
    rng = np.random.default_rng(seed)
    params = TOUCH | {"S": TOUCH["S"] * (1.0 + rng.uniform(-2e-5, 2e-5)), "zeta": 0.0}
    orbit = cf.find_orbit("coulomb", params, longest=1000)
    diagram = cf.explore(orbit, "zeta", (0.0, 0.03))
    branch = next(
        b
        for b in diagram.branches
        if [e.reason.name for e in b.ends if e.bifurcation and e.bifurcation.kind is Kind.BP]
        and any(e.kind is Kind.T for e in b.bifurcations)
    )
    vertex = next(e for e in branch.bifurcations if e.kind is Kind.BP)
    touches = [e.params["zeta"] for e in branch.bifurcations if e.kind is Kind.T]
    assert min(abs(t - vertex.params["zeta"]) for t in touches) < 3e-7
    start = branch[len(branch) // 2]
    for step in rng.uniform(0.1, 1.0, 4) * LARGEST_STEP:
        toward = cf.continue_orbit(start, "zeta", (0.0, 0.03), max_step=step)
        found = [e.params["zeta"] for e in toward.bifurcations if e.kind is Kind.T]
        assert found == pytest.approx(touches, abs=1e-10) or found[::-1] == pytest.approx(
            touches, abs=1e-10
        )
        symmetric = next(b for b in diagram.branches if b.symmetric and not b.bridge)
        away = cf.explore(symmetric[5], "zeta", (0.0, 0.03), max_step=step, max_branches=4)
        assert any(
            abs(e.params["zeta"] - t) < 1e-10
            for t in touches
            for e in away.bifurcations
            if e.kind is Kind.T
        )


@pytest.mark.parametrize("seed", range(20))
def test_an_event_has_the_names_of_all_changes_between_its_branches(seed):
    """Each place has two outcomes, with a name for either way; brute force over all pairs of branches."""
    rng = np.random.default_rng(seed)
    places = int(rng.integers(1, 5))
    ways = rng.choice([Kind.CS, Kind.SS, Kind.AS, Kind.GS], (places, 2))
    forms = list(product((0, 1), repeat=places))
    names = [
        Name(ways[k][form[k]], frozenset([form]), frozenset([_changed(form, k)]))
        for form in forms
        for k in range(places)
    ]
    followed = {forms[i] for i in rng.choice(len(forms), rng.integers(1, len(forms) + 1))}
    expected = {
        ways[k][a[k]] for a, b in product(followed, repeat=2) for k in range(places) if a[k] != b[k]
    }
    assert kinds_between(names, followed) == expected


def _changed(form, k):
    return (*form[:k], 1 - form[k], *form[k + 1 :])


def test_two_holds_that_change_together_have_one_name_from_every_branch():
    bounds = (0.03, 0.045)
    orbit = cf.find_orbit("coulomb", {**HOLDS, "h": 0.0, "zeta": 2.568e-5}, longest=1000)
    diagram = cf.explore(orbit, "h", (-0.02, 0.06))
    held = [b for b in diagram.branches if len(b.system.holds) == 2 and not b.mirrored]
    assert held
    for branch in held:
        again = cf.explore(
            branch[len(branch) // 2], "h", (-0.02, 0.06), max_step=STEP * LARGEST_STEP
        )
        assert [*differences(diagram, again), *differences(again, diagram)] == []
    assert any(bounds[0] < e.params["h"] < bounds[1] for e in diagram.of_kind("GS"))


@pytest.mark.parametrize("seed", [0, 2, 3, 5, 7, 8])
def test_nothing_is_held_at_the_second_of_two_equal_maxima(seed):
    """Rest through both meets an AS: a slide after the first one leaves the load below the second one."""
    rng = np.random.default_rng(seed)
    near = {"Omega": 0.19073341966320848, "S": 0.18, "S0": 0.9042822380372987}
    near |= {"h": 0.40181602459629007, "zeta": 2.8374848045155377e-07}
    params = {name: value * rng.uniform(0.97, 1.03) for name, value in near.items()}
    orbit = cf.find_orbit("coulomb", params, longest=1000)
    diagram = cf.explore(orbit, "S", (0.14, 0.21), max_branches=60)
    assert diagram.of_kind("AS") and not diagram.loose_ends
    assert diagram.verify(3).passed


@pytest.mark.parametrize("seed", [1, 4, 5, 7, 9])
def test_branches_begin_at_their_events_where_two_have_nearly_the_same_solution(seed):
    """With nearly equal friction limits holds last a moment: Newton's method finds what begins next to it."""
    rng = np.random.default_rng(seed)
    near = {"Omega": 0.10107089480900815, "S": 0.0889656667920143}
    near |= {"h": 0.1277389169773503, "zeta": 0.0015}
    params = {name: value * rng.uniform(0.99, 1.01) for name, value in near.items()}
    params["S0"] = params["S"] * (1.0 + 10.0 ** rng.uniform(-3.6, -2.8))
    orbit = cf.find_orbit("coulomb", params, longest=1000)
    diagram = cf.explore(orbit, "zeta", (-0.03, 0.03), max_branches=100)
    begun = [
        (value, end.bifurcation.params["zeta"])
        for branch in diagram.branches
        for value, end in zip(branch.values[[0, -1]], branch.ends, strict=True)
        if end.bifurcation is not None
    ]
    assert len(begun) > 8 and not diagram.loose_ends
    for value, event in begun:
        assert value == pytest.approx(event, abs=1e-8 * diagram.width)
