"""Tubes about branches: what they prove, where they stop, and that they do not prove what is not so."""

from __future__ import annotations

import functools
import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx

import contfric as cf
from contfric.base.arrays import FloatArray
from contfric.bvp.margins import EventFunction, Margin
from contfric.bvp.system import build_system
from contfric.certify.branch import certify_branch, cover
from contfric.certify.equations import shortest
from contfric.certify.equations.chain import Chain, segments_of
from contfric.certify.inequalities.along_segments import DURATION, EXIT, RATE, InequalityName
from contfric.certify.tubes import tracing
from contfric.certify.tubes.strand import Strand, in_phases
from contfric.certify.tubes.tracing import Tracer
from contfric.certify.tubes.tube import Box, box_between, solved
from contfric.events.bifurcation import End, EndReason
from contfric.models.balls.build import ball_model
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector, working
from contfric.orbit.solve import refine
from contfric.signature.holds import TOUCH

SCENE = {"Omega": 0.55, "S": 0.32, "S0": 0.4}


@functools.cache
def den_hartog() -> cf.Branch:
    """The branch without sticks, from its end at CS."""
    return cf.continue_orbit(cf.find_orbit("coulomb", SCENE), "Omega", (0.5, 0.6))


def test_a_branch_is_one_curve_up_to_its_ends() -> None:
    branch = den_hartog()
    certificate = branch.certify()
    assert certificate.proved, certificate.why
    assert certificate.covered > 0.9999
    assert certificate.regular > 0.9999
    # its tube holds the CS at which it ends: nothing is left between
    assert not certificate.gaps
    assert certificate.complete and certificate.events == ("CS_s",)
    (last,) = [piece for piece in certificate.pieces if piece.ends]
    assert [name.what for name in last.ends] == ["joint"]
    for piece in certificate.pieces:
        assert piece.start < piece.stop and piece.linked


def test_what_only_says_that_it_ends_is_not_taken_for_an_end() -> None:
    """A branch that is cut in the middle, and says CS: no inequality changes its sign there."""
    branch = den_hartog()
    inner = slice(4, None) if branch.ends[0].reason.name == "CS" else slice(None, -4)
    cut = replace(
        branch,
        values=branch.values[inner],
        joints=branch.joints[inner],
        arc=branch.arc[inner],
        labels=branch.labels[inner],
        bifurcations=(),
    )
    certificate = certify_branch(cut)
    assert certificate.covered == 1.0
    assert not certificate.complete and "no proved event at the end" in certificate.open[0]
    assert not any(piece.ends for piece in certificate.pieces)


def test_an_event_of_another_branch_is_none_of_this_one() -> None:
    """A proved fold of 1a, said to be at the end of 0s: its orbit does not solve the equations of 0s."""
    branch = den_hartog()
    orbit = cf.solve_orbit("coulomb", "1a", {"Omega": 0.5417, "S": 0.32, "S0": 0.4})
    fold = next(b for b in cf.continue_orbit(orbit, "Omega", (0.5416, 0.545)).bifurcations)
    at = next(b.position for b in branch.bifurcations)
    certificate = certify_branch(replace(branch, bifurcations=(replace(fold, position=at),)))
    assert not certificate.events and not certificate.complete


def test_a_fold_is_covered_and_not_taken_for_monotone() -> None:
    orbit = cf.solve_orbit("coulomb", "1a", {"Omega": 0.5417, "S": 0.32, "S0": 0.4})
    branch = cf.continue_orbit(orbit, "Omega", (0.5416, 0.545))
    fold = next(b for b in branch.bifurcations if b.kind == "SN").params["Omega"]
    at = int(np.argmax(branch.values))
    near = slice(at - 2, at + 3)
    cut = replace(
        branch,
        values=branch.values[near],
        joints=branch.joints[near],
        arc=branch.arc[near],
        labels=branch.labels[near],
    )
    certificate = certify_branch(cut)
    assert certificate.proved
    assert certificate.covered == 1.0
    (turned,) = [p for p in certificate.pieces if p.folds]
    assert turned.folds == 1 and turned.events == ("SN_1a",)
    assert max(turned.values) < fold and fold - min(turned.values) < 1e-4
    assert certificate.regular < certificate.covered


@functools.cache
def ends() -> tuple[cf.Branch, Vector, Vector]:
    branch = den_hartog()
    with ctx.workprec(80):
        k = len(branch) // 2
        points = []
        for value in (float(branch.values[k]), float(branch.values[k]) + 1e-4):
            vector = branch.vector.copy()
            vector[0] = value
            orbit = refine(replace(branch[k], vector=vector))
            joints = orbit.joints.copy()
            joints[:, 0] *= value
            points.append([*(arb(float(c)) for c in joints.ravel()), arb(value)])
    return branch, points[0], points[1]


def build(value: arb) -> BallModel:
    orbit = den_hartog()[0]
    return in_phases(ball_model(orbit.model, orbit.params, "Omega", value))


def a_box(first: Vector, last: Vector) -> Box | None:
    with ctx.workprec(80):
        segments = segments_of(den_hartog().system)
        plane = [b - a for a, b in zip(first, last, strict=True)]
        exact = [solved(segments, build, build, point, plane) for point in (first, last)]
        assert exact[0] is not None
        assert exact[1] is not None
        return box_between(segments, build, exact[0], exact[1])


def test_orbits_between_lie_in_the_box() -> None:
    branch, first, last = ends()
    box = a_box(first, last)
    assert box is not None
    assert box.monotone
    for share in np.linspace(0.0, 1.0, 7):
        value = float(first[-1]) + share * 1e-4
        vector = branch.vector.copy()
        vector[0] = value
        orbit = refine(replace(branch[len(branch) // 2], vector=vector))
        joints = orbit.joints.copy()
        joints[:, 0] *= value
        for ball, x in zip(box.all, [*joints.ravel(), value], strict=True):
            assert (ball + arb(0, 1e-12)).contains(arb(float(x)))


def test_what_lies_elsewhere_is_not_in_a_box() -> None:
    _, first, last = ends()
    with ctx.workprec(80):
        holding = a_box(first, last)
        assert holding is not None
        middle = [(a + b) / 2 for a, b in zip(first, last, strict=True)]
        assert holding.holds(middle)
        assert not holding.holds([c + 1e-3 for c in middle])
        assert not holding.holds([2 * b - a for a, b in zip(first, last, strict=True)])


def solved_at(values: FloatArray) -> cf.Branch:
    """Return solutions of the equations of the branch without sticks, admissible or not."""
    branch = den_hartog()
    orbit, joints = branch[int(np.argmin(branch.values))], []
    for value in values:
        vector = branch.vector.copy()
        vector[0] = value
        orbit = refine(replace(orbit, vector=vector))
        assert orbit.converged
        joints.append(orbit.joints)
    return replace(
        branch,
        values=values,
        joints=np.array(joints),
        arc=np.linspace(0.0, 1.0, len(values)),
        labels=branch.labels[: len(values)],
    )


def test_a_branch_beyond_its_end_is_not_proved() -> None:
    """The equations are solved below the CS, where the stops should have stuck."""
    certificate = certify_branch(solved_at(np.linspace(0.5350, 0.5345, 6)))
    assert certificate.covered == 0.0
    assert not certificate.proved
    assert all(piece.exists for piece in certificate.pieces)  # the curve is there
    assert all("joint at F" in gap for gap in certificate.gaps)


def test_a_limit_of_the_parameter_is_no_end_that_inequalities_reach_before_it() -> None:
    """The stops should stick below the CS at 0.53529: a branch that says it ends at 0.5350 is not proved."""
    branch = solved_at(np.linspace(0.5375, 0.5350, 4))
    ends = (End(EndReason.RANGE), End(EndReason.LIMIT))
    certificate = certify_branch(replace(branch, ends=ends, bifurcations=()))
    proved = [piece.values[1] for piece in certificate.pieces if piece.proved]
    assert proved and min(proved) > 0.53529246
    assert not certificate.complete and certificate.covered < 0.9


@pytest.mark.parametrize("seed", range(4))
def test_branches_up_to_the_limits_of_friction(seed: int) -> None:
    """With S0 = S a stick is released with acceleration 0; with S = 0 a stop may be at its limit."""
    rng = np.random.default_rng(seed)
    scene = {
        "Omega": rng.uniform(0.45, 0.6),
        "h": rng.uniform(-0.05, 0.05),
        "S0": rng.uniform(0.4, 0.6),
    }
    limit = scene["S0"]
    orbit = cf.find_orbit("coulomb", scene | {"S": 0.9 * limit})
    branch = cf.continue_orbit(orbit, "S", (0.88 * limit, 1.0))
    assert branch.ends[-1].reason is EndReason.LIMIT
    certificate = branch.certify()
    assert certificate.complete, (certificate.gaps, certificate.open)
    released = {k for k, (mode, _) in enumerate(branch.system.itinerary) if mode == "stick"}
    after = {(k + 1) % len(branch.system.itinerary) for k in released}
    assert {(name.segment, name.what) for name in certificate.pieces[-1].ends} == {
        (k, RATE) for k in after
    }


def test_a_branch_without_damping_up_to_no_friction() -> None:
    """At Omega = 1/2, where all slides of S = 0 come back to where they began."""
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.1, "S0": 0.4})
    certificate = cf.continue_orbit(orbit, "S", (-1.0, 0.11)).certify()
    assert certificate.branch.ends[0].reason is EndReason.LIMIT
    assert certificate.complete, (certificate.gaps, certificate.open)
    assert [name.what for name in certificate.pieces[0].ends] == ["joint"]


@functools.cache
def figure(parameter: str) -> cf.Diagram:
    start = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
    bounds = {"Omega": (0.487, 0.495), "S": (0.043, 0.07)}[parameter]
    return cf.explore(
        cf.solve_orbit("coulomb", "1a", {**start, parameter: bounds[1] - 1e-3}), parameter, bounds
    )


def test_bridges_and_asymmetric_branches_from_event_to_event() -> None:
    branches = figure("Omega").branches
    image = next(b for b in branches if b.mirrored)
    for branch in [*(b for b in branches if not b.mirrored), image]:
        certificate = branch.certify()
        assert certificate.complete, (branch, certificate.gaps, certificate.open)


@pytest.mark.slow
def test_events_of_bridges_with_holds_at_a_touch_solve_the_equations_of_their_branch() -> None:
    """Folds and touches in between, and where a hold that begins at a touch is born or ends."""
    orbit = cf.solve_orbit("coulomb", "2a-14seg", {"Omega": 0.5, "S": 0.06, "S0": 0.4})
    branches = [b for b in cf.explore(orbit, "S", (0.011, 0.0665)).branches if not b.mirrored]
    kinds = set()
    for branch in (b for b in branches if b.system.holds):
        proofs = [event.certify("S") for event in branch.bifurcations]
        with ctx.workprec(80):
            strand = Strand(branch)
            for label, zero, _ in strand.met_by(proofs):
                model = strand.plain(zero[-1])
                residual = Chain(strand.segments, model).residual(zero[:-1])
                assert all(abs(r) < 1e-15 for r in residual), label
                kinds.add(label.split("_")[0])
    assert kinds >= {"SN", "T", "GS", "SS"}
    folded = max(branches, key=lambda b: sum(e.kind == "SN" for e in b.bifurcations))
    certificate = folded.certify()
    assert sum(label.startswith("SN") for label in certificate.events) == 1  # labels are the same
    assert sum(piece.folds for piece in certificate.pieces) == 3
    assert certificate.complete, (certificate.gaps, certificate.open)


@pytest.mark.parametrize(("parameter", "kind"), [("Omega", "BP"), ("S", "PD")])
def test_where_two_turns_become_one(parameter: str, kind: str) -> None:
    """All computed orbits next to the event are in its box, on the side that is proved; others are not."""
    event = next(b for b in figure(parameter).bifurcations if b.kind == kind)
    branch = next(
        b
        for b in figure(parameter).branches
        if EndReason[kind] in {e.reason for e in b.ends}
        or b.ends[0].message.startswith(f"the branch starts here: {kind}")
    )
    proofs = [b.certify(parameter) for b in branch.bifurcations]
    with ctx.workprec(80):
        tracer = Tracer(branch, proofs, float("inf"))
        at = 0 if tracer.flips[0] is not None else -1
        flip = tracer.flips[at]
        assert flip is not None and flip.piece.regular and flip.piece.events == (event.label,)
        assert flip.split.one_sided
        side = float(branch.values[len(branch) // 2]) - event.params[parameter]
        assert (flip.split.slope[-1] > 0) is (side > 0)
        inside = 0
        for k in range(len(branch)):
            point = tracer.point(branch[k])
            first, second = flip.turns.of(point[:-1])
            if (
                1e-4 < abs(flip.amplitude(point)) < 0.99
                and abs(branch.arc[k] - branch.arc[at]) < tracer.far
            ):
                inside += 1
                assert flip.split.holds(first, second, point[-1])
            moved = [first[0] + 1e-2, *first[1:]]
            assert not flip.split.holds(moved, second, point[-1])
            assert not flip.split.holds(first, second, point[-1] + 1e-2)
        assert inside > 0


def test_without_its_event_an_end_is_open() -> None:
    branch = next(b for b in figure("Omega").branches if b.name == "2a" and not b.mirrored)
    bare = replace(branch, bifurcations=tuple(b for b in branch.bifurcations if b.kind != "BP"))
    short = slice(-4, None) if branch.ends[1].reason is EndReason.BP else slice(None, 4)
    bare = replace(
        bare,
        values=branch.values[short],
        joints=branch.joints[short],
        arc=branch.arc[short],
        labels=branch.labels[short],
    )
    certificate = bare.certify()
    assert not certificate.complete and certificate.open


@pytest.mark.parametrize("parameter", ["alpha", "delta"])
def test_what_vanishes_identically_in_the_parameters_is_known_along_a_branch(
    parameter: str,
) -> None:
    """A rate that is 0 where rest is left is that of the surface at which it is, at every parameter."""
    orbit = cf.find_orbit("dead-band")
    value = orbit.params[parameter]
    span = (value * (1 - 1e-3), value * (1 + 1e-3))
    proof = cf.continue_orbit(orbit, parameter, span).certify()
    assert proof.complete, (proof.gaps, proof.open)


def test_a_hold_after_a_touch_begins_with_no_duration() -> None:
    """There S is stationary along the curve of solutions: it moves with the square of the duration."""
    params = {"Omega": 0.396, "S": 0.1010915, "S0": 0.4}
    diagram = cf.explore(cf.find_orbit("coulomb", params), "S", (0.10108, 0.1010926))
    branch = next(one for one in diagram.branches if one.system.half and one.system.holds)
    (k,) = (k for k, (_, exit_) in enumerate(branch.system.itinerary) if exit_ == TOUCH)
    lasts = np.array([orbit.ends[k, 0] - orbit.begins[k, 0] for orbit in branch])
    assert lasts[0] < 1e-8
    ratios = (branch.values[5:9] - branch.values[0]) / lasts[5:9] ** 2
    assert np.ptp(ratios) < 0.1 * abs(np.mean(ratios))
    arrays = {name: getattr(branch, name)[:9] for name in ("values", "joints", "arc", "labels")}
    found = certify_branch(replace(branch, **arrays))
    assert DURATION in {name.what for name in found.pieces[0].ends}
    assert found.pieces[0].events
    assert all(piece.proved and piece.linked and not piece.folds for piece in found.pieces)


def test_a_tube_ends_at_a_tangential_stop() -> None:
    """Where a stop becomes tangential the chain is singular, and the parameter turns on its curve."""
    orbit = cf.solve_orbit("coulomb", "1a-9seg", {"Omega": 0.5, "S": 0.04, "S0": 0.4})
    found = cf.continue_orbit(orbit, "S", (0.03, 0.05)).certify()
    ends = {name.what for piece in found.pieces for name in piece.ends}
    assert "exit" in ends
    assert found.complete, (found.gaps, found.open)
    assert sum(piece.folds for piece in found.pieces) == 1  # that at 0.0356, and not the end
    tracer = Tracer(found.branch, list(found.proofs), np.inf)
    stops = [i for i, mode in enumerate(tracer.segments.modes) if mode != "stick"]
    after = [tracer.segments.modes[(i + 1) % tracer.segments.count] for i in stops]
    # not where the next slide has another acceleration: then the chain is regular at a tangential stop
    singular = [tracer.is_singular(InequalityName(i, "v", EXIT)) for i in stops]
    assert singular == [mode == "stick" for mode in after]
    assert "stick" in after and len(set(after)) > 1


def test_where_equations_are_singular_all_along_few_boxes_are_tried() -> None:
    """A continuum of orbits at one value of the parameter, of second order: no box is to be had."""
    diagram = cf.explore(
        cf.find_orbit("coulomb", {"Omega": 0.52, "S": 0.22, "S0": 0.3}), "Omega", (0.49, 0.54)
    )
    (branch,) = (b for b in diagram.branches if np.ptp(b.values) < 1e-9 and not b.mirrored)
    tracer = Tracer(branch, [], np.inf)
    pieces = [piece for k in range(len(branch) - 1) for piece in tracer.step(k, k + 1)[0]]
    assert tracer.ended == "" and not any(piece.proved for piece in pieces)
    assert tracer.count < 40 * len(branch)


@pytest.mark.parametrize(("start", "end"), [(0.727, 0.7285), (0.7, 0.74), (0.69, 0.74)])
def test_a_doubling_without_excitation_is_held_by_both_tubes(start: float, end: float) -> None:
    """The doubled cycle, from any of its joints, is two turns of the cycle, each in a clock of its own."""
    model = "tests/models/switched.yaml"
    cycle = cf.find_orbit(model, {"A": start})
    diagram = cf.explore(cycle, "A", (start, end))
    (event,) = (b for b in diagram.bifurcations if b.kind == "PD")
    assert len(diagram.branches) == 2
    for branch in diagram.branches:
        found = branch.certify()
        assert found.complete and found.events == (event.label,), (found.gaps, found.open)


@pytest.mark.parametrize("first", range(4))
def test_the_turns_of_a_doubled_cycle_wherever_it_begins(first: int) -> None:
    """Joints to turns and back; the turns end at time 0, where the other one begins."""
    cycle = cf.find_orbit("tests/models/switched.yaml", {"A": 0.7})
    diagram = cf.explore(cycle, "A", (0.7, 0.74))
    branch = next(b for b in diagram.branches if b[0].system.segments == 4)
    proofs = [b.certify("A") for b in branch.bifurcations]
    with working(80):
        (flip,) = (f for f in Tracer(branch, proofs, np.inf).flips if f is not None)
        order = [(first + k) % 4 for k in range(4)]
        wraps = [int(first + k >= 4) for k in range(4)]
        turns = replace(flip.turns, places=tuple(zip(order, map(arb, wraps), strict=True)))
        rng = np.random.default_rng(first)
        period, joints = 12.5, rng.normal(size=(4, 4))
        joints[:, 0] = [-period, *np.sort(rng.uniform(-period, 0, 3))]
        z = [arb(float(c)) for c in joints.ravel()]
        one, other = turns.of(z)
        absolute = joints[order, 0] + period * np.array(wraps)
        lasts = [absolute[2] - absolute[0], absolute[0] + period - absolute[2]]
        assert [float(-one[0]), float(-other[0])] == pytest.approx(lasts)
        assert float(one[4] - one[0]) == pytest.approx(absolute[1] - absolute[0])
        back = turns.joined(one, other)
        assert max(abs(float(a - b)) for a, b in zip(back, z, strict=True)) < 1e-12


@pytest.mark.parametrize("seed", [1, 2])
def test_a_branch_that_starts_near_a_saddle_is_covered_from_where_its_orbits_are_alone(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A heater that hardly reaches its upper level: the period grows without bound, the boxes are few."""
    rng = np.random.default_rng(seed)
    params = {"outside": rng.uniform(0, 10), "tau": rng.uniform(2, 8), "low": rng.uniform(15, 20)}
    params |= {"high": params["low"] + rng.uniform(0.5, 3), "heat": 30.0}
    whole = cf.continue_orbit(cf.find_orbit("thermostat", params), "heat", (5.0, 32.0))
    first = min(k for k, orbit in enumerate(whole) if orbit.period < 18 * params["tau"])
    branch = replace(
        whole,
        values=whole.values[first:],
        joints=whole.joints[first:],
        arc=whole.arc[first:],
        labels=whole.labels[first:],
    )
    monkeypatch.setattr(tracing, "_MOST", 120)  # some more than a box a step
    found = certify_branch(branch)
    alone = min(k for k, point in enumerate(found.points) if point.unique.proved)
    assert alone > 0
    pieces = [piece for piece in found.pieces if piece.start >= branch.arc[alone]]
    assert pieces[0].start == branch.arc[alone]
    assert all(piece.proved and piece.regular for piece in pieces)
    assert all(piece.linked for piece in pieces[1:])
    assert [piece.stop for piece in found.pieces[:-1]] == [p.start for p in found.pieces[1:]]


@pytest.mark.parametrize("seed", [3, 4])
def test_a_period_without_bound_at_a_limit_of_the_parameter_takes_few_boxes(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Orbits next to the limit differ by less than any box is wide; all others are proved."""
    rng = np.random.default_rng(seed)
    params = {"outside": rng.uniform(0, 10), "tau": rng.uniform(2, 8), "low": rng.uniform(15, 20)}
    params |= {"high": params["low"] + rng.uniform(0.5, 3), "heat": 30.0}
    limit = params["high"] - params["outside"]
    branch = cf.continue_orbit(cf.find_orbit("thermostat", params), "heat", (5.0, 32.0))
    assert branch.values[0] == pytest.approx(limit, abs=1e-12)
    monkeypatch.setattr(tracing, "_MOST", 2 * len(branch))
    found = certify_branch(branch)
    assert not found.ended
    away = [piece for piece in found.pieces if min(piece.values) - limit > 1e-13]
    assert all(piece.proved and piece.regular for piece in away)
    assert found.covered > 0.7


@pytest.mark.parametrize("start", [1, 5])
def test_parts_that_are_covered_in_another_order_are_one_curve(start: int) -> None:
    """The same as in the order of the branch, wherever the first printed orbit that is alone is."""
    branch = cf.continue_orbit(cf.solve_orbit("coulomb", "0s", SCENE), "Omega", (0.54, 0.58))
    with working(80):
        tracer = Tracer(branch, [], np.inf)
        tracer.unique = set(range(start, len(branch)))
        pieces = cover(tracer)
    assert all(piece.proved and piece.regular for piece in pieces)
    assert (pieces[0].start, pieces[-1].stop) == (branch.arc[0], branch.arc[-1])
    for before, after in itertools.pairwise(pieces):
        assert after.linked and after.start == before.stop


@pytest.mark.parametrize("regular", [True, False])
def test_after_stretches_without_boxes_only_regular_steps_are_halved(
    regular: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where printed orbits are proved to be alone the equations are not singular: short boxes are tried."""
    branch = cf.continue_orbit(cf.solve_orbit("coulomb", "0s", SCENE), "Omega", (0.54, 0.58))
    longest = 0.3 * (branch.values[3] - branch.values[2])

    def only_short(*given: Any) -> Box | None:
        first, last = given[2:4]
        return box_between(*given) if abs(float(last[-1] - first[-1])) < abs(longest) else None

    monkeypatch.setattr(tracing, "box_between", only_short)
    with working(80):
        tracer = Tracer(branch, [], np.inf)
        tracer.unique = {2, 3} if regular else set()
        tracer.missed = tracing._IN_ROW
        pieces, _ = tracer.step(2, 3)
    assert len(pieces) == (4 if regular else 1)
    assert all(piece.proved is regular for piece in pieces)


def test_a_branch_is_covered_towards_an_end_that_is_not_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Only next to the end, where the equations may be singular, is nothing proved."""
    orbit = cf.solve_orbit("coulomb", "0s", SCENE | {"Omega": 0.57})
    branch = cf.continue_orbit(orbit, "Omega", (0.56, 0.58))
    exact, last = Tracer._exact, len(branch) - 1

    def not_at_ends(self: Tracer, k: int, printed: Vector, plane: Vector) -> Vector | None:
        return None if k in (0, last) else exact(self, k, printed, plane)

    monkeypatch.setattr(Tracer, "_exact", not_at_ends)
    found = certify_branch(branch)
    gaps = [piece for piece in found.pieces if not piece.proved]
    assert [(piece.start, piece.stop) for piece in gaps] == [
        (branch.arc[0], gaps[0].stop),
        (gaps[1].start, branch.arc[-1]),
    ]
    for gap, step in zip(
        gaps, (branch.arc[1] - branch.arc[0], branch.arc[-1] - branch.arc[-2]), strict=True
    ):
        assert gap.stop - gap.start < 1e-3 * step
    proved = [piece for piece in found.pieces if piece.proved]
    assert all(piece.linked for piece in proved[1:])


def test_events_of_branches_without_excitation_solve_their_equations() -> None:
    """Such a cycle has no phase: that of the event is moved to the times of the branch, which ends at 0."""
    diagram = cf.explore(cf.find_orbit("relay-sliding"), "lam", (0.05, 0.06), max_branches=1)
    branch = diagram.branches[0]
    folds = [event for event in branch.bifurcations if event.kind.value == "SN"]
    assert folds
    with working(128):
        strand = Strand(branch)
        found = strand.met_by([fold.certify("lam") for fold in folds])
        assert [label for label, _, _ in found] == [fold.label for fold in folds]
        for (_, zero, _), fold in zip(found, folds, strict=True):
            chain = Chain(strand.segments, strand.plain(zero[-1]))
            assert all(x.contains(0) and x.rad() < 1e-25 for x in chain.residual(zero[:-1]))
            off = [float(x) - y for x, y in zip(zero, fold.orbit.joints.ravel(), strict=False)]
            assert np.abs(off).max() < 1e-6


@pytest.mark.parametrize("turns", [1, 3])
@pytest.mark.parametrize("seed", range(3))
def test_the_shortest_problem_of_a_cycle_without_excitation(seed: int, turns: int) -> None:
    """Its turn ends at time 0, whether it is half of a symmetric orbit or one of several turns."""
    rng = np.random.default_rng(seed)
    orbit = cf.find_orbit("relay-sliding", {"lam": rng.uniform(0.054, 0.08)}).as_whole()
    model, period, cycle = orbit.model, orbit.period, orbit.cycle
    joints = np.concatenate([cycle - [k * period, 0, 0, 0] for k in range(turns)][::-1])
    system = build_system(model, orbit.itinerary * turns, turns)
    last = len(joints) - 1  # of several turns one inequality is looked at in each
    tests = tuple(
        EventFunction(Margin.INTERIOR, k, "switch") for k in range(last % len(cycle), last + 1, 4)
    )
    whole = replace(orbit, system=system, joints=joints)
    short, _ = shortest._shortest(whole, tests)
    assert short.system.half and len(short.joints) == len(cycle) // 2
    chain = Chain(segments_of(short.system), ball_model(model, short.params))
    off = chain.residual([arb(float(c)) for c in short.joints.ravel()])
    assert max(abs(float(c)) for c in off) < 1e-9


def test_touches_of_symmetric_cycles_without_excitation_are_proved() -> None:
    """Of relay feedback with sliding: a slide that touches its limit, and an arc that touches the switch."""
    diagram = cf.explore(cf.find_orbit("relay-sliding"), "lam", (0.049, 0.0556), max_branches=3)
    proofs = {event.label: event.certify("lam") for event in diagram.bifurcations}
    assert {"AS_s", "GS_s"} <= set(proofs)
    for label in ("AS_s", "GS_s"):
        assert proofs[label].proved, proofs[label].why
        assert proofs[label].radius < 1e-25 and proofs[label].error < 1e-10
    for name, events in (("2s, 26seg", {"AS_s", "GS_s"}), ("4s, 28seg", {"GS_s"})):
        (branch,) = [branch for branch in diagram.branches if branch.name == name]
        certificate = branch.certify()
        assert certificate.complete and set(certificate.events) == events
