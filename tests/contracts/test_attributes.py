"""What stands for the standard library's own on hot paths does the same."""

from __future__ import annotations

import pickle
from dataclasses import fields, replace

import pytest

import contfric as cf
from contfric.base.attributes import altered, cached_property
from contfric.events.bifurcation import End, EndReason
from contfric.orbit.index import opening_sign, opening_signs

PARAMS = {"Omega": 0.5, "S": 0.32, "S0": 0.4}


def test_altered_classes_are_those_of_replace(branch) -> None:
    orbit, event, end = branch[3], branch.bifurcations[0], branch.ends[0]
    for one, changes in (
        (orbit, {"residual": 1.0}),
        (event, {"position": 2.0, "located": False}),
        (end, {"reason": EndReason.RANGE}),
        (branch, {"notes": ("something",)}),
        (orbit.system.tests[0], {"surface": "v"}),
    ):
        new, wanted = altered(one, **changes), replace(one, **changes)
        assert type(new) is type(wanted)
        for field in fields(one):
            mine, theirs = getattr(new, field.name), getattr(wanted, field.name)
            assert mine is theirs or mine == theirs, field.name


def test_what_is_kept_of_an_object_is_not_carried_over(branch) -> None:
    orbit = branch[3]
    assert orbit.period == orbit.period
    moved = altered(orbit, vector=orbit.vector * 1.01)
    assert not vars(moved).keys() - {field.name for field in fields(moved)}
    assert moved.period != orbit.period


def test_properties_are_computed_once() -> None:
    class Counted:
        asked = 0

        @cached_property
        def value(self) -> int:
            self.asked += 1
            return self.asked

    one, other = Counted(), Counted()
    assert (one.value, one.value, other.value) == (1, 1, 1)
    assert isinstance(Counted.value, cached_property)


def test_why_a_branch_ends_is_told_when_it_is_read_and_once() -> None:
    told = []

    def text() -> str:
        told.append(1)
        return "because"

    end = End(EndReason.STEP, text)
    copied = altered(end, bifurcation=None)
    assert not told
    assert (end.message, str(end), str(copied), len(told)) == ("because",) * 3 + (2,)
    assert End(EndReason.RANGE).message == ""
    assert replace(end, reason=EndReason.RANGE).message == "because"


def test_ends_are_told_in_another_process_as_in_this_one(branch) -> None:
    fresh = cf.continue_orbit(branch[0], "Omega", (0.4, 0.6))
    sent = pickle.loads(pickle.dumps(fresh))
    assert [str(end) for end in sent.ends] == [str(end) for end in branch.ends]


def test_a_point_is_the_same_orbit_only_for_the_same_question(branch) -> None:
    from contfric.continuation.points import Point

    orbit = branch[3]
    empty = orbit.joints[0]
    point = Point(orbit.joints, orbit.vector[:1], orbit.joints, empty, empty, empty, empty)
    first = point.orbit(orbit, 0)
    assert point.orbit(orbit, 0) is first
    assert point.orbit(replace(orbit, vector=orbit.vector.copy()), 0) is not first
    point.joints = orbit.joints + 1.0
    moved = point.orbit(orbit, 0)
    assert (moved.joints == orbit.joints + 1.0).all()


@pytest.mark.parametrize(
    ("overrides", "held"), [({}, 2), ({"S0": 0.345}, 2), ({"zeta": 0.01, "S": 0.31}, 0)]
)
def test_signs_of_many_orbits_are_those_of_each(overrides, held) -> None:
    orbit = cf.find_orbit("coulomb", {**PARAMS, **overrides})
    diagram = cf.explore(orbit, "Omega", (0.45, 0.55))
    assert sum(len(one.system.holds) for one in diagram.branches) == held
    for one in diagram.branches:
        signs = opening_signs(one[:])
        assert signs == [opening_sign(orbit) for orbit in one]
        assert any(sign is not None for sign in signs)
