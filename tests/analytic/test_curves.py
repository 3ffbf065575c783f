"""Curves in two parameters: against fine runs in one parameter, and known points of codimension two."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import contfric as cf
from contfric.bvp.linear import pencil_of_turn
from contfric.continuation.singular_points.switching import leave_along, null_direction
from contfric.curves.trace import continue_bifurcation
from tests.curve_check import miss

PLANE = ("Omega", "S")
RANGES = {"Omega": (0.35, 0.6), "S": (0.02, 0.39)}
START = {"Omega": 0.5, "S": 0.32, "S0": 0.4}


@pytest.fixture(scope="module")
def events():
    """Bifurcations of two diagrams without bridges, by kind and name."""
    across = cf.explore(cf.find_orbit("coulomb", START), "Omega", (0.4, 0.6), bridges=False)
    orbit = cf.solve_orbit("coulomb", "1a", {**START, "S": 0.2})
    down = cf.explore(orbit, "S", (0.02, 0.4), bridges=False)
    found = {}
    for diagram in (across, down):
        for branch in diagram.branches:
            for b in branch.bifurcations:
                found.setdefault((b.kind.value, b.orbit.name.split(",")[0]), b)
    return found


@pytest.fixture(scope="module")
def curves(events):
    wanted = [("SN", "1a"), ("BP", "2s"), ("CS", "1a"), ("SS", "1a"), ("SS", "2a"), ("PD", "1a")]
    wanted += [("GS", "2a"), ("T", "2a")]
    return {key: cf.continue_bifurcation(events[key], PLANE, RANGES) for key in wanted}


KEYS = [("SN", "1a"), ("BP", "2s"), ("CS", "1a"), ("SS", "1a"), ("SS", "2a"), ("PD", "1a")]


@pytest.mark.parametrize("key", [*KEYS, ("GS", "2a"), ("T", "2a")])
def test_one_parameter_runs_find_the_same(curves, key) -> None:
    curve = curves[key]
    chosen = np.linspace(0, len(curve) - 1, 24).astype(int)[1:-1]  # 22 points, the ends apart
    for i in chosen.tolist():
        gap = miss(curve[i], curve.kinds[i])
        if gap > 1e-10:  # the curve may be parallel to the axis of Omega there
            gap = miss(curve[i], curve.kinds[i], "S")
        assert gap < 1e-10, f"{curve.label}, point {i}: {curve[i].params}"


def point_of(curve, name):
    return next(s for s in curve.special if s.name == name)


def test_fold_ends_on_crossing_sliding(curves) -> None:
    """SN_1a meets CS_s; located on both curves, by different equations."""
    on_fold = point_of(curves["SN", "1a"], "SN-CS")
    on_sliding = point_of(curves["CS", "1a"], "CS-SN")
    assert on_fold.params["Omega"] == pytest.approx(0.535596, abs=1e-6)
    assert on_fold.params["S"] == pytest.approx(0.374869, abs=1e-6)
    for name in PLANE:
        assert on_fold.params[name] == pytest.approx(on_sliding.params[name], abs=1e-11)
    orbit = on_sliding.orbit
    assert np.min(np.abs(orbit.multipliers - 1.0)) < 1e-8
    assert np.sort(np.abs(orbit.margins))[0] < 1e-12
    assert curves["SN", "1a"].ends[0].special is on_fold or curves["SN", "1a"].ends[1].special


def test_turnover_of_sliding(curves) -> None:
    """Where the load at the stop stands still, CS and SS change places."""
    curve = curves["SS", "1a"]
    turn = point_of(curve, "CS-SS")
    assert turn.params["Omega"] == pytest.approx(0.493319591748, abs=1e-9)
    assert turn.params["S"] == pytest.approx(0.322357775561, abs=1e-9)
    # u' = v - f'(t) at the stop, where v = 0
    test = curve.parts[0].test
    time = turn.orbit.ends[test.segment, 0]
    assert np.sin(turn.params["Omega"] * time) == pytest.approx(0.0, abs=1e-9)
    assert {kind.value for kind in curve.kinds} == {"CS", "SS"}


def test_symmetry_breaking_changes_its_criticality(curves) -> None:
    """At the degenerate BP the branch that leaves turns from one side of Omega to the other."""
    point = point_of(curves["BP", "2s"], "DBP")
    assert point.params["Omega"] == pytest.approx(0.506246976917, abs=1e-9)
    curve = curves["BP", "2s"]
    sides = []
    for offset in (-2e-3, 2e-3):
        i = int(np.argmin(np.abs(curve.values[:, 1] - point.params["S"] - offset)))
        sides.append(_opening_side(curve[i]))
    assert sides[0] * sides[1] < 0.0


def _opening_side(orbit):
    """Sign of the second derivative of Omega along the asymmetric branch, at the branch point."""
    from contfric.continuation.points import Settings

    value = orbit.params["Omega"]
    settings = Settings("Omega", value - 0.1, value + 0.1, "", "", 0.2)
    whole = orbit.as_whole()
    departure = leave_along(whole, settings, null_direction(whole))
    return departure.point.value - value


def test_folds_leave_the_degenerate_branch_point(curves) -> None:
    """The fold curve of 2a ends where it is tangent to the BP, and both say where."""
    orbit = cf.find_orbit("coulomb", START)
    ranges = {"Omega": (0.48, 0.53), "S": (0.31, 0.36)}
    plane = cf.explore_plane(orbit, PLANE, ranges, max_sections=1, max_periods=1, seeds=None)
    folds = [c for c in plane.curves if c.label == "SN_2a"]
    assert len(folds) == 1
    back = continue_bifurcation(
        cf.Bifurcation(cf.Kind.SN, folds[0][5].params, folds[0][5]), PLANE, ranges
    )
    births = [s for s in back.special if s.kind is cf.CodimTwo.DBP]
    point = point_of(curves["BP", "2s"], "DBP")
    assert len(births) == 1
    for name in PLANE:  # from this side the place is good to the root of rounding
        assert births[0].params[name] == pytest.approx(point.params[name], abs=1e-6)


def test_border_is_singular_on_the_fold(curves) -> None:
    """On the curve the map of one turn has the eigenvalue 1, by another elimination."""
    for i in range(0, len(curves["SN", "1a"]), 10):
        orbit = curves["SN", "1a"][i]
        p, q = pencil_of_turn(orbit.system, orbit.joints, orbit.vector)
        values = np.linalg.svd(p + q, compute_uv=False)
        assert values[-1] / values[0] < 1e-13


def test_differences_give_the_same_points(events) -> None:
    """A flow without second derivatives has the same curves: they decide on Newton's rate only."""
    model = cf.load_model("coulomb")
    flow = replace(model.flow, second=None)
    plain = replace(model, flow_factory=lambda: flow)
    orbit = cf.find_orbit(plain, START)
    branch = cf.continue_orbit(orbit, "Omega", (0.4, 0.6))
    fold = next(b for b in branch.bifurcations if b.kind is cf.Kind.SN)
    ranges = {"Omega": (0.5, 0.6), "S": (0.3, 0.36)}
    exact = cf.continue_bifurcation(events["SN", "1a"], PLANE, ranges)
    found = cf.continue_bifurcation(fold, PLANE, ranges)
    for name in PLANE:
        assert found.params[name][0] == pytest.approx(exact.params[name][0], abs=1e-12)
        assert found.params[name][-1] == pytest.approx(exact.params[name][-1], abs=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_a_curve_around_a_resonance_is_closed(seed: int) -> None:
    """Where the wall is just touched: (k - w^2)^2 + (c w)^2 = (A / d)^2, through negative damping.

    Around the resonance the phase turns once: joints are a period later then, or earlier.
    """
    r = np.random.default_rng(seed)
    k, d, damping = r.uniform(0.8, 1.2), r.uniform(1.5, 3.0), r.uniform(0.02, 0.2)
    given = {"A": 1.0, "k": k, "c": damping, "d": d, "w": 0.3 * np.sqrt(k)}
    branch = cf.continue_orbit(cf.find_orbit("impact", given), "w", (0.2, np.sqrt(k)))
    touch = next(b for b in branch.bifurcations if b.kind is cf.Kind.GS)
    curve = cf.continue_bifurcation(touch, ("w", "c"), {"w": (0.1, 2.0), "c": (-3.0, 3.0)})
    assert [end.reason.name for end in curve.ends] == ["CLOSED", "CLOSED"]
    w, c = curve.values.T
    assert np.max(np.abs((k - w**2) ** 2 + (c * w) ** 2 - d**-2)) < 1e-9
    assert np.min(c) < 0.0 < np.max(c)
    angle = np.unwrap(np.arctan2(c, w - np.sqrt(k)))
    assert 2.0 * np.pi <= abs(angle[-1] - angle[0]) < 3.0 * np.pi, "once around"
