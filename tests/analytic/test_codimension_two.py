"""A cusp and a degenerate period doubling, each against one-parameter runs near it."""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric.continuation.points import Settings
from contfric.continuation.singular_points.switching import leave_along, null_direction
from contfric.curves.leaving import leaving
from contfric.curves.problem import problem_of
from contfric.curves.ranges import box_of
from contfric.curves.trace import trace_curve_side

PLANE = ("Omega", "S")


def folds(s: float) -> list[cf.Bifurcation]:
    """The two folds of 2s, 12seg below Omega = 0.305, at h = 0.05."""
    orbit = cf.find_orbit("coulomb", {"Omega": 0.306, "S": s, "S0": 0.4, "h": 0.05})
    branch = cf.continue_orbit(orbit, "Omega", (0.29, 0.32), max_step=2e-3)
    return [b for b in branch.bifurcations if b.kind is cf.Kind.SN and b.params["Omega"] < 0.305]


@pytest.mark.slow
def test_cusp() -> None:
    """Two folds meet; their distance goes with the power 3/2 of the distance to the cusp."""
    gaps = {}
    for s in (0.1, 0.1013):
        one, other = folds(s)
        gaps[s] = abs(one.params["Omega"] - other.params["Omega"]) ** (2 / 3)
    expected = 0.1 + 0.0013 * gaps[0.1] / (gaps[0.1] - gaps[0.1013])
    curve = cf.continue_bifurcation(folds(0.1)[0], PLANE, {"Omega": (0.3, 0.31), "S": (0.09, 0.11)})
    (cusp,) = [s for s in curve.special if s.kind is cf.CodimTwo.CUSP]
    assert cusp.located
    assert cusp.params["S"] == pytest.approx(expected, abs=2e-6)
    assert cusp.params["S"] == pytest.approx(0.1015116567, abs=1e-9)
    # the curve goes on through it: both folds lie on it
    highest = int(np.argmax(curve.params["S"]))
    assert 0 < highest < len(curve) - 1
    assert curve.params["S"][highest] <= cusp.params["S"] + 1e-12


@pytest.fixture(scope="module")
def doubling():
    orbit = cf.solve_orbit("coulomb", "2a", {"Omega": 0.39, "S": 0.21, "S0": 0.5})
    branch = cf.continue_orbit(orbit, "Omega", (0.36, 0.45))
    return next(b for b in branch.bifurcations if b.kind is cf.Kind.PD)


def opening(orbit: cf.Orbit) -> float:
    """Which side of a doubling the doubled branch opens to, at constant S."""
    value = orbit.params["Omega"]
    settings = Settings("Omega", value - 0.1, value + 0.1, "", "", 0.2)
    doubled = orbit.doubled()
    departure = leave_along(doubled, settings, null_direction(doubled), 3e-4)
    assert departure is not None
    return departure.point.value - value


def test_degenerate_doubling(doubling) -> None:
    ranges = {"Omega": (0.37, 0.42), "S": (0.19, 0.22)}
    curve = cf.continue_bifurcation(doubling, PLANE, ranges, max_step=2e-3)
    (point,) = [s for s in curve.special if s.kind is cf.CodimTwo.GPD]
    assert point.params["Omega"] == pytest.approx(0.384608602, abs=1e-8)
    at = int(np.searchsorted(curve.arc, point.position))
    assert opening(curve[at - 2]) * opening(curve[at + 1]) < 0.0


def test_fold_of_doubled_orbits_leaves(doubling) -> None:
    box = box_of(doubling.orbit.model, PLANE, {"Omega": (0.37, 0.42), "S": (0.19, 0.22)})
    problem = problem_of(doubling, box)
    curve = cf.continue_bifurcation(
        doubling, PLANE, {"Omega": (0.37, 0.42), "S": (0.19, 0.22)}, max_step=2e-3
    )
    (point,) = [s for s in curve.special if s.kind is cf.CodimTwo.GPD]
    found = list(leaving(point, problem, 0.01))
    assert len(found) == 1
    fold, start, border = found[0]
    assert fold.kind is cf.Kind.SN and fold.system.periods == 2
    side = trace_curve_side(fold, start, border, 1e-3, 50)
    for p in side.points[:5]:
        orbit = fold.orbit(p.joints, p.w)
        assert np.min(np.abs(orbit.multipliers - 1.0)) < 1e-6
        assert orbit.residual == 0.0 or orbit.residual < 1e-10
    gap = [abs(side.points[0].w[k] - point.params[n]) for k, n in enumerate(PLANE)]
    assert max(gap) < 1e-3


RANGES = {"Omega": (0.4, 0.6), "S": (0.15, 0.45)}


def smooth_points(s0: float) -> list[tuple[cf.Curve, cf.SpecialPoint]]:
    """Points at which curves of events of period 1 go on in the same itinerary."""
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.6 * s0, "S0": s0})
    found = []
    for event in cf.explore(orbit, "Omega", (0.4, 0.6), max_periods=1).bifurcations:
        simple = event.orbit.periods == 1 and not event.orbit.system.holds
        if simple and event.kind is not cf.Kind.T:
            curve = cf.continue_bifurcation(event, PLANE, RANGES)
            sliding = {cf.Kind.CS, cf.Kind.SS, cf.Kind.AS, cf.Kind.GS, cf.Kind.T}
            found += [(curve, point) for point in curve.special if point.meets not in sliding]
    return found


@pytest.mark.parametrize("s0", [0.37, 0.4, 0.46])
def test_a_curve_that_starts_at_a_point_has_it(s0: float) -> None:
    """The test that vanishes there begins at zero: its sign is that of rounding."""
    points = smooth_points(s0)
    assert {"CS-SS", "CS-SN"} <= {point.name for _, point in points}
    for curve, point in points:
        part = min(curve.parts, key=lambda p: float(np.min(np.abs(p.arc - point.position))))
        margins = () if part.test is None else (part.test,)
        event = cf.Bifurcation(part.kind, point.params, point.orbit, margins)
        again = cf.continue_bifurcation(event, PLANE, RANGES)
        near = [
            other.name
            for other in again.special
            if all(abs(other.params[n] - point.params[n]) < 1e-8 for n in PLANE)
        ]
        assert near.count(point.name) == 1, (point, near)


def test_a_curve_passes_each_itinerary_once_at_one_place() -> None:
    """Where margins vanish all along a curve, itineraries followed each other to their largest number."""
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.322, "S0": 0.4})
    diagram = cf.explore(orbit, "Omega", (0.4, 0.6))
    curves = [
        cf.continue_bifurcation(event, PLANE, {"Omega": (0.4, 0.6), "S": (0.25, 0.4)})
        for event in diagram.bifurcations
        if event.kind is cf.Kind.T and not event.orbit.system.holds
    ]
    assert len(curves) >= 3
    for curve in curves:
        places = [(p.name, *(round(p.params[n], 9) for n in PLANE)) for p in curve.special]
        assert len(places) == len(set(places)), curve
