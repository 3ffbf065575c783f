"""Branch points need no declared symmetry: where two curves of orbits cross, both are followed."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.leaving.crossings import whole_branch
from contfric.atlas.matching import on_branch
from contfric.continuation.ends.at_vertices import stalled_at
from contfric.continuation.half_branch import first_point
from contfric.continuation.points import MOST_POINTS, settings_of
from contfric.continuation.singular_points.crossing import LOCATED, _ChainProblem, crossing_near
from contfric.continuation.singular_points.switching import leave_along
from contfric.events.bifurcation import EndReason

MODEL = Path(__file__).parents[1] / "models" / "crossing.yaml"
#: The state z of the model obeys z' = mu z + q z^2 - c z^3 + e, whatever the oscillator does, and shifts
#: the displacement by z / 10.
BOUNDS = (-0.4, 0.5)


@cache
def symmetric_diagram() -> cf.Diagram:
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.25, "S0": 0.35})
    return cf.explore(orbit, "Omega", (0.3, 0.8))


def outline(diagram: cf.Diagram, shift: float) -> list[list[tuple[str, float, float, float]]]:
    """Return the ends of all branches, without what depends on where they were computed from."""
    found = []
    for branch in diagram.branches:
        ends = [
            (end.reason.name, *(round(float(v), 6) for v in (value, high - shift, low - shift)))
            for end, value, high, low in zip(
                branch.ends,
                branch.values[[0, -1]],
                branch.x_max[[0, -1]],
                branch.x_min[[0, -1]],
                strict=True,
            )
        ]
        found.append(sorted(ends))
    return sorted(found)


@pytest.mark.parametrize("start", [0.5, 0.38])
def test_a_hidden_symmetry_gives_the_diagram_of_the_declared_one(start: float) -> None:
    shift = float(np.random.default_rng(int(100 * start)).uniform(-0.1, 0.1))
    params = {"Sp": 0.25 - shift, "Sm": 0.25 + shift, "Sp0": 0.35 - shift, "Sm0": 0.35 + shift}
    orbit = cf.find_orbit(MODEL, params | {"Omega": start})
    diagram = cf.explore(orbit, "Omega", (0.3, 0.8))
    wanted = symmetric_diagram()
    assert diagram.loose_ends == () == diagram.notes
    assert outline(diagram, shift) == outline(wanted, 0.0)
    assert {b.kind for b in diagram.bifurcations} == {b.kind for b in wanted.bifurcations}
    for event in wanted.bifurcations:
        same = [b for b in diagram.bifurcations if b.kind is event.kind]
        gaps = [abs(b.params["Omega"] - event.params["Omega"]) for b in same]
        twice = 1 if event.symmetric else 2
        assert sum(gap < 1e-9 for gap in gaps) == twice, event


def symmetric_place() -> float:
    """Return where the pitchfork is that the model with its symmetry declared has."""
    events = symmetric_diagram().bifurcations
    return next(float(b.params["Omega"]) for b in events if b.kind is cf.Kind.BP)


@pytest.mark.parametrize("seed", [1, *(pytest.param(k, marks=pytest.mark.slow) for k in (0, 2, 3))])
def test_no_step_passes_the_vertex_of_a_pitchfork(seed: int) -> None:
    """Next to it the sign of a slope is rounding: one curve in eight went on along the mirror branch."""
    rng = np.random.default_rng([31, seed])
    shift = float(rng.uniform(-0.1, 0.1))
    params = {"Sp": 0.25 - shift, "Sm": 0.25 + shift, "Sp0": 0.35 - shift, "Sm0": 0.35 + shift}
    orbit = cf.find_orbit(MODEL, params | {"Omega": float(rng.uniform(0.425, 0.435))})
    assert min(abs(orbit.multipliers - 1.0)) > 1e-3
    for _ in range(12):
        low, step = float(rng.uniform(0.3, 0.41)), float(10.0 ** rng.uniform(-2.3, -1.0))
        branch = cf.continue_orbit(orbit, "Omega", (low, 0.8), max_step=step)
        kinds = sorted(b.kind.name for b in branch.bifurcations if b.kind is not cf.Kind.T)
        assert kinds == ["BP", "SS"], (low, step)
        place = next(b for b in branch.bifurcations if b.kind is cf.Kind.BP).params["Omega"]
        assert place == pytest.approx(symmetric_place(), abs=1e-9)


@pytest.mark.parametrize(
    "terms, place, branches",
    [
        ({"q": -1.0}, 0.3, 2),
        ({"q": 0.5, "c": 0.3}, 0.4, 2),
        ({"c": 1.0}, 0.4, 3),
        ({"c": -0.5}, -0.3, 3),
    ],
    ids=["transcritical", "next to a fold", "pitchfork", "subcritical"],
)
def test_both_curves_through_a_branch_point_are_found_from_each(
    terms: dict[str, float], place: float, branches: int
) -> None:
    q, c = terms.get("q", 0.0), terms.get("c", 0.0)
    roots = np.roots([-c, q, place]) if c else np.array([-place / q])
    for z in [0.0, *np.real(roots[np.isreal(roots)])]:
        diagram = cf.explore(orbit_at(float(z), {"mu": place, **terms}), "mu", BOUNDS)
        assert len(diagram.branches) == branches and not diagram.loose_ends
        (event,) = [b for b in diagram.bifurcations if b.kind is cf.Kind.BP]
        assert abs(event.params["mu"]) < 1e-12
        assert np.min(np.abs(event.orbit.multipliers - 1.0)) < 1e-9
        folds = [b for b in diagram.bifurcations if b.kind is cf.Kind.SN]
        wanted = [-(q**2) / (4.0 * c)] if q and c else []
        assert np.allclose([b.params["mu"] for b in folds], wanted, atol=1e-10)
        tips = [end for b in diagram.branches for end in b.ends if end.reason is EndReason.BP]
        assert len(tips) == (2 if branches == 3 else 0)
        assert not any("symmetric" in str(end) for end in tips)


def orbit_at(z: float, params: dict[str, float]) -> cf.Orbit:
    """Return the orbit with a value of z, stable or not: that of z = 0, moved."""
    orbit = cf.find_orbit(MODEL, {"mu": -1.0})
    joints = orbit.joints.copy()
    joints[:, 1] += 0.1 * z
    joints[:, 3] = z
    vector = orbit.model.vector({**orbit.params, **params})
    moved = cf.Orbit(orbit.system, joints, vector, np.inf)
    assert moved.violations() == []
    return moved


@pytest.mark.parametrize("imperfection", [1e-3, -1e-4])
def test_an_imperfect_pitchfork_has_a_fold_and_no_branch_point(imperfection: float) -> None:
    fold = 3.0 * abs(0.5 * imperfection) ** (2 / 3)  # of mu z - z^3 + e
    outer = np.roots([-1.0, 0.0, 0.4, imperfection])
    far = float(np.min(outer.real) if imperfection > 0.0 else np.max(outer.real))
    terms = {"mu": 0.4, "c": 1.0, "e": imperfection}
    branch = cf.continue_orbit(orbit_at(far, terms), "mu", BOUNDS)
    (event,) = branch.bifurcations
    assert event.kind is cf.Kind.SN and abs(event.params["mu"] - fold) < 1e-9
    settings = settings_of(event.orbit, "mu", BOUNDS, None, True, 100)
    assert crossing_near(event.orbit, settings, np.inf) is None


@pytest.mark.parametrize(
    "terms, mu, text",
    [
        ({"c": 1.0}, -1e-5, "a branch point is at mu"),
        ({"c": 1.0, "e": 1e-3}, -0.3, "no multiplier is at"),
        ({"e": -1e-9, "q": 1.0}, 2.1 * 1e-9**0.5, "a multiplier is at +1 ("),
    ],
)
def test_a_stalled_branch_says_whether_a_multiplier_is_at_one(
    terms: dict[str, float], mu: float, text: str
) -> None:
    q, c, e = (terms.get(name, 0.0) for name in "qce")
    roots = np.roots(np.trim_zeros([-c, q, mu, e], "f"))
    orbit = orbit_at(float(np.min(roots[np.isreal(roots)].real)), {"mu": mu, **terms})
    settings = settings_of(orbit, "mu", BOUNDS, None, True, 100)
    tip = first_point(orbit, settings)
    assert tip is not None
    message, event = stalled_at(orbit, tip, settings)
    assert message.startswith(EndReason.STEP.value) and text in message
    assert event is None  # the curve of the orbit passes there, or there is none


@pytest.mark.parametrize("signature", ["2s", "1a"])
def test_second_derivatives_from_several_joints_at_once(signature: str) -> None:
    """Those of each unknown moved alone, with an even and an odd number of segments."""
    orbit = cf.solve_orbit("coulomb", signature, {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    active = orbit.model.index_of("Omega")
    problem = _ChainProblem(orbit.system, orbit.vector, active, 0.3)
    x = np.append(orbit.joints.ravel(), orbit.vector[active] / 0.3)
    psi = np.random.default_rng(3).normal(size=len(x) - 1)
    plain = np.empty((len(x), len(x)))
    for k in range(len(x)):
        step = np.zeros(len(x))
        step[k] = 1e-5
        plain[k] = psi @ (problem.at(x + step)[1] - problem.at(x - step)[1]) / 2e-5
    found = problem.hessian(x, psi)
    assert np.allclose(found, 0.5 * (plain + plain.T), atol=1e-6 * np.abs(plain).max())


def test_a_range_beyond_a_limit_of_the_model_has_one_step_for_all_branches() -> None:
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.2, "S0": 0.4})
    asked = settings_of(orbit, "S", (0.1, 2.0), None, True, MOST_POINTS)
    assert (asked.high, asked.width) == (0.4, 1.9)  # kinetic friction is at most the static limit
    first, other = cf.continue_orbit(orbit, "S", (0.1, 2.0)), whole_branch(orbit, asked)
    assert np.array_equal(other.values, first.values)
    assert np.array_equal(other.joints, first.joints)


@pytest.mark.parametrize("seed", range(8))
def test_four_arms_leave_a_branch_point_where_the_curves_make_a_small_angle(seed: int) -> None:
    """A step that ended at the point went on along the other curve, and one curve was taken for the other."""
    rng = np.random.default_rng([62, seed])
    centre = {"vb": 0.2368, "k": 1.3167, "beta": 1.176, "S": 0.645}
    moved = {name: value * (1.0 + rng.uniform(-0.003, 0.003)) for name, value in centre.items()}
    step = (None, 0.01, 0.02)[seed % 3]
    diagram = cf.explore(cf.find_orbit("two-blocks", moved), "vb", (0.2, 0.29), max_step=step)
    (event,) = [b for b in diagram.bifurcations if b.kind is cf.Kind.BP]
    settings = settings_of(event.orbit, "vb", diagram.range, None, True, 100)
    crossing = crossing_near(event.orbit, settings, LOCATED)
    assert crossing is not None
    for distance in (1e-2, 1e-3, 1e-4):
        curves = []
        for direction in crossing.directions:
            arms = [
                leave_along(crossing.orbit, settings, way, distance)
                for way in (direction, direction.reversed())
            ]
            orbits = [arm.point.orbit(crossing.orbit, 0) for arm in arms if arm is not None]
            assert len(orbits) == 2
            curves.append(
                [{i for i, b in enumerate(diagram.branches) if on_branch(o, b)} for o in orbits]
            )
        assert all(one == other and len(one) == 1 for one, other in curves), distance
        assert curves[0] != curves[1], distance
