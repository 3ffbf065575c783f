"""Where a branch turns, where it becomes symmetric, and what leaves there: the decisions one by one."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.exploration import Exploration
from contfric.atlas.follow import _through
from contfric.atlas.matching import same_kind, telling_kind
from contfric.base.tally import tally
from contfric.bvp.system import Margin
from contfric.continuation.ends.at_vertices import left_at
from contfric.continuation.half_branch import first_point
from contfric.continuation.locating import smooth
from contfric.continuation.points import Point, settings_of
from contfric.continuation.singular_points.folds import _is_idle
from contfric.continuation.singular_points.switching import (
    LEAVE,
    leave_along,
    null_direction,
    overshoots,
)
from contfric.continuation.singular_points.vertices import passed_vertex
from contfric.continuation.step import Step
from contfric.continuation.trace import trace_side
from contfric.events import sliding_kinds as kinds
from contfric.events.doubling_point import moved, opening, refined_opening
from contfric.simulation.simulate import tables

FIG05 = {"Omega": 0.5, "S": 0.32, "S0": 0.4, "h": 0.0}
#: The branch point of 2s (docs/numerics.md, 40 digits).
BRANCH_POINT = 0.48874064302956684


@cache
def asymmetric() -> cf.Branch:
    """Return the branch 2a of Fig. 5, which ends at the branch point of 2s."""
    orbit = cf.solve_orbit("coulomb", "2a", FIG05 | {"Omega": 0.4895})
    return cf.continue_orbit(orbit, "Omega", (0.45, 0.52))


@cache
def symmetric() -> cf.Branch:
    orbit = cf.solve_orbit("coulomb", "2s", FIG05)
    return cf.continue_orbit(orbit, "Omega", (0.45, 0.52))


@pytest.mark.parametrize(
    "rate, outward, kind",
    [
        (1e-2, False, "CS"),
        (1e-9, True, "CS"),
        (0.0, True, "CS"),
        (0.0, False, "SS"),
        (-1e-9, False, "SS"),
        (-1e-2, True, "SS"),
    ],
)
def test_a_load_that_stands_still_at_a_stop_is_told_by_its_bend(
    rate: float, outward: bool, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At its minimum it grows after the stop, which is left; at its maximum it is held."""
    (event,) = [b for b in asymmetric().bifurcations if b.tests and b.kind is not cf.Kind.T]
    (test, *_) = event.tests
    assert test.margin is Margin.JOINT and event.orbit.system.holds == ()
    assert kinds.kind_of_margin(event.orbit.system, test, event.orbit) is event.kind
    monkeypatch.setattr(kinds, "outward_rate", lambda *_: rate)
    monkeypatch.setattr(kinds, "bends_outward", lambda *_: outward)
    assert kinds.kind_of_margin(event.orbit.system, test, event.orbit).value == kind


def point(value: float, multiplier: float) -> Point:
    """Return a point of which only parameter and multipliers matter."""
    nothing = np.zeros((2, 3))
    mu = np.array([multiplier, 0.0], dtype=np.complex128)
    return Point(
        nothing,
        np.array([value]),
        nothing,
        np.zeros(1),
        np.zeros(4),
        np.zeros(0, dtype=np.int64),
        mu,
    )


@pytest.mark.parametrize(
    "before, after, multiplier, idle",
    [
        (1e-4, 1e-16, 0.7, True),  # it comes to a stand at the end of the branch
        (1e-4, -1e-9, 0.7, True),
        (1e-4, 1e-5, 0.7, False),  # it turns: a fold, whatever the multipliers
        (-1e-4, -1e-5, np.inf, False),
        (1e-4, 1e-16, 1.0 + 1e-6, False),  # at a multiplier 1 it is one
        (1e-4, 1e-16, np.nan, False),  # nothing is known
    ],
)
def test_a_parameter_that_turns_is_a_fold(
    before: float, after: float, multiplier: float, idle: bool
) -> None:
    orbit = asymmetric()[0]
    settings = settings_of(orbit, "Omega", (0.4, 0.6), None, True, 100)
    here, far = point(0.5, multiplier), 2.0
    first, last = point(0.5 + before, far), point(0.5 + after, far)
    step = Step(orbit, first, last, last, settings)
    assert _is_idle(step, here) is idle
    without = replace(settings, stability=False)  # nothing is dropped that nothing speaks against
    assert not _is_idle(replace(step, settings=without), here)


def test_a_vertex_left_behind_is_found_between_the_two_orbits() -> None:
    branch, orbit = asymmetric(), symmetric()[0]
    settings = settings_of(orbit, "Omega", (0.45, 0.52), None, True, 100)
    near = int(np.argmin(np.abs(branch.values - BRANCH_POINT)))
    k = near + 5 if near + 5 < len(branch) else near - 5
    side = np.sign(branch.values[k] - BRANCH_POINT)
    before = first_point(branch[k], settings)
    assert before is not None
    values = symmetric().values
    beyond = values[side * (values - BRANCH_POINT) < -1e-4]
    there = cf.solve_orbit("coulomb", "2s", FIG05 | {"Omega": float(beyond[len(beyond) // 2])})
    found = left_at(before, there.as_whole(), settings)
    assert found is not None and found.value == pytest.approx(BRANCH_POINT, abs=1e-10)
    # on the same side of the branch point there is none
    same = cf.solve_orbit("coulomb", "2s", FIG05 | {"Omega": BRANCH_POINT + side * 1e-3})
    assert left_at(before, same.as_whole(), settings) is None


@pytest.mark.parametrize(
    "sizes, wanted",
    [
        ((1e-2, 5e-5, 3e-6, 1e-7, 3e-8, 5e-10), (4, -np.inf)),  # gone little by little
        ((5e-5, 5e-6, -5e-6, -5e-5), (0, 1.0)),  # its sign is not known at the points between
        ((5e-5, 5e-6, 5e-6, 5e-5), None),
        ((3e-8, 5e-10, 1e-13), None),  # symmetric from the first point on
    ],
)
def test_short_steps_do_not_hide_that_orbits_become_symmetric(
    sizes: tuple[float, ...], wanted: tuple[int, float] | None
) -> None:
    orbit = cf.solve_orbit("coulomb", "2a", FIG05 | {"Omega": 0.4895})
    n = len(orbit.joints) // 2
    rng = np.random.default_rng(len(sizes))
    middle = np.tile(rng.standard_normal((n, 3)), (2, 1))
    middle[n:, 1:] *= -1.0
    odd = np.tile(rng.standard_normal((n, 3)), (2, 1))  # of the same sign in both halves
    odd /= 2.0 * np.linalg.norm(odd[:n, 1:])
    points = np.array([middle + size * odd for size in sizes])
    assert passed_vertex(orbit.system, points) == wanted
    # what is asked for may be the last steps only: those before serve the comparison
    assert passed_vertex(orbit.system, points, len(points) - 2) == wanted
    assert passed_vertex(orbit.system, points[::-1][:2]) is None


@pytest.mark.parametrize("seed", range(6))
def test_a_vertex_that_is_met_already_is_not_left_by_rounding(seed: int) -> None:
    """Two values that are rounding have a secant that leads anywhere."""
    branch = symmetric()
    (event,) = [b for b in branch.bifurcations if b.kind is cf.Kind.BP]
    active = event.orbit.model.index_of("Omega")
    shift = 10.0 ** -(8.0 + seed) * (-1.0) ** seed
    beside = moved(event.orbit, active, event.params["Omega"] + shift)
    found = refined_opening(beside, active)
    assert found is not None
    assert float(found.vector[active]) == pytest.approx(BRANCH_POINT, abs=1e-12)
    assert abs(opening(found)) < 1e-12


@pytest.mark.parametrize("step", [0.01, 0.1, 0.5, 1.0])
def test_no_step_leaps_over_a_vertex(step: float) -> None:
    """A branch that becomes symmetric ends there, and does not go on along its mirror image."""
    orbit = cf.solve_orbit("coulomb", "2a", FIG05 | {"Omega": 0.4895})
    branch = cf.continue_orbit(orbit, "Omega", (0.45, 0.52), max_step=step)
    (end,) = [e for e in branch.ends if e.reason is cf.EndReason.BP]
    assert end.bifurcation is not None
    assert end.bifurcation.params["Omega"] == pytest.approx(BRANCH_POINT, abs=1e-11)
    inner = slice(1, -1)
    sides = np.sign(
        branch.x_max[inner] + branch.x_min[inner]
    )  # of the other sign on the mirror branch
    assert np.all(sides == sides[0])


def test_a_start_behind_a_doubling_or_a_touch_leaps() -> None:
    """The pair that leaves the bang-bang oscillator's branch point at A = 69.852 doubles at 73.128."""
    branch = cf.continue_orbit(cf.find_orbit("bang-bang", {"A": 64.0}), "A", (62.0, 75.0))
    (event,) = [b for b in branch.bifurcations if b.kind is cf.Kind.BP]
    orbit = event.orbit.as_whole()
    settings = settings_of(orbit, "A", (62.0, 75.0), None, True, 5000)
    # what is integrated rounds to 1e-13: next to the vertex Newton's method has to know that
    along = null_direction(orbit)
    start = leave_along(orbit, settings, along, LEAVE)
    assert start is not None and not overshoots(orbit, settings, start, LEAVE, along)
    side = trace_side(orbit, start.point, settings)
    (doubling, *_) = [b for b in side.bifurcations if b.kind is cf.Kind.PD]
    for k in (20, side.count - 20):
        point = first_point(side.rows.point(k).orbit(orbit, 3), settings)
        assert point is not None
        behind = any(b.position < side.rows.arc[k] for b in side.bifurcations)
        assert overshoots(orbit, settings, start._replace(point=point), LEAVE, along) is behind
    assert point.value > doubling.params["A"]


def test_an_event_of_an_integrated_flow_is_bracketed_to_its_rounding_and_no_further(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    solves: list[int] = []
    locate = smooth.locate_change

    def counted(*given: Any) -> Point | None:
        before = int(tally()[0])
        found = locate(*given)
        solves.append(int(tally()[0]) - before)
        return found

    monkeypatch.setattr(smooth, "locate_change", counted)
    branch = cf.continue_orbit(cf.find_orbit("bang-bang", {"A": 20.0}), "A", (19.0, 24.0))
    (event,) = [b for b in branch.bifurcations if b.kind is cf.Kind.BP]
    assert solves and max(solves) <= 14  # 17 to 36 down to the resolution of the arithmetic
    best = refined_opening(event.orbit, event.orbit.model.index_of("A"))
    assert best is not None
    assert best.params["A"] == pytest.approx(
        event.params["A"], abs=5.0 * max(event.accuracy, 1e-12)
    )


@pytest.mark.parametrize("distance", [1e-3, 1e-4, 1e-5])
def test_newton_settles_at_the_rounding_of_an_integrated_flow(distance: float) -> None:
    """Next to this vertex corrections are 1e-13 divided by the distance to it, and fall no further."""
    branch = cf.continue_orbit(cf.find_orbit("bang-bang", {"A": 20.0}), "A", (19.0, 24.0))
    (event,) = [b for b in branch.bifurcations if b.kind is cf.Kind.BP]
    orbit = event.orbit.as_whole()
    settings = settings_of(orbit, "A", (19.0, 24.0), None, True, 5000)
    start = leave_along(orbit, settings, null_direction(orbit), distance)
    assert start is not None
    there = start.point.orbit(orbit, 3)
    apart = np.linalg.norm(there.joints - orbit.joints) / len(orbit.joints) ** 0.5
    assert apart == pytest.approx(distance, rel=1e-2)
    assert abs(start.point.value - event.params["A"]) < 1e-6 + distance**2


def test_what_is_run_through_twice_is_continued_once() -> None:
    orbit = symmetric()[0]
    settings = settings_of(orbit, "Omega", (0.45, 0.52), None, True, 1000)
    state = Exploration(settings, 4, 1, 10, True, None)
    twice = orbit.doubled()
    assert twice.periods == 2 * orbit.periods
    branch = _through(state, twice)
    assert branch is not None and branch.system.periods == orbit.periods


def test_a_wall_takes_the_mass_off_rest_and_leaves_it_where_it_is() -> None:
    model = cf.load_model("impact-friction")
    names = [s.name for s in model.surfaces]
    for kept in tables(model).kept:  # whatever mode they are met in
        stays = {
            met: {n for k, n in enumerate(names) if kept[i] >> k & 1} for i, met in enumerate(names)
        }
        assert "v" not in stays["wall"] and {"F+", "F-"} <= stays["wall"]
        assert stays["v"] == set(names)


def test_one_event_has_one_name_where_nothing_jumps() -> None:
    assert telling_kind([cf.Kind.CS, cf.Kind.SS, cf.Kind.GS]) is cf.Kind.GS
    assert telling_kind([cf.Kind.PD]) is cf.Kind.PD
    (jump,) = [b for b in asymmetric().bifurcations if b.tests and b.kind is not cf.Kind.T]
    other = replace(jump, kind=cf.Kind.GS)
    assert same_kind(jump, jump) and same_kind(jump, other)  # the solution tells them apart
    grazes = cf.continue_orbit(cf.find_orbit("belt", {"vb": 0.5}), "vb", (0.4, 0.7)).bifurcations
    (here,) = [b for b in grazes if b.kind is cf.Kind.SS]
    assert same_kind(here, replace(here, kind=cf.Kind.GS))
    assert not same_kind(here, replace(here, kind=cf.Kind.SN))


def test_a_surface_far_away_is_found_by_a_simulation() -> None:
    """A stick of hundreds of units of time ends where the spring is as strong as friction."""
    orbit = cf.find_orbit("belt", {"vb": 0.005})
    (i,) = [k for k, (mode, _) in enumerate(orbit.itinerary) if mode == "stick"]
    begin, end = orbit.begins[i], orbit.ends[i]
    assert end[1] == pytest.approx(1.0, abs=1e-12)
    assert end[0] - begin[0] == pytest.approx((1.0 - begin[1]) / 0.005, rel=1e-12)
    assert end[0] - begin[0] > 100.0
