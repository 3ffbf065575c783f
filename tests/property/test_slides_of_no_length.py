"""Bridges up to where a slide between two rests has no length: their parameter moves with d^3 or d^2."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest
from flint import arb, arb_mat, ctx

import contfric as cf
from contfric.bvp.system import build_system
from contfric.certify.branch import BranchCertificate, certify_branch
from contfric.certify.equations.short_slide import ShortSlide, ShortSlideChain
from contfric.certify.events import EventCertificate
from contfric.certify.inequalities.along_segments import DURATION
from contfric.certify.tubes.meeting import as_zero_of
from contfric.certify.tubes.tracing import Tracer
from contfric.certify.tubes.tube import orbit_in, solved
from contfric.certify.tubes.vanishing import Vanishing, box_up_to, solution_with
from contfric.models.balls.numbers import Vector
from contfric.orbit.solve import refine

LEFT, RIGHT, REST = ("slide-", "v"), ("slide+", "v"), ("stick", "F-")
HELD, TOUCHED = ("stick", "hold@F-"), ("stick", "hold@touch")

#: Parameters, range of S, itinerary, approximate times and positions at the joints, and the slide.
BRIDGES = {
    "after a stop, Fig. 13": (
        {"S": 0.03936585, "h": 0.05},
        (0.039364, 0.0395),
        (LEFT, REST, RIGHT, LEFT, HELD, RIGHT, REST, RIGHT),
        (12.517148, 17.530806, 20.809679, 25.292235, 29.780833, 30.885776, 30.953122, 33.051031),
        (
            1.7061152,
            -0.90798206,
            -0.90798206,
            1.7980837,
            -1.0454173,
            -1.0454173,
            -1.0454129,
            -1.0454129,
        ),
        5,
    ),
    "after a touch, Fig. 4": (
        {"S": 0.05576677},
        (0.0557651, 0.056),
        (LEFT, TOUCHED, LEFT, REST, RIGHT, LEFT, REST, RIGHT),
        (25.071374, 30.574442, 32.223512, 32.290862, 33.608225, 37.900111, 42.379375, 45.697539),
        (
            1.7962715,
            -0.85701929,
            -0.85701929,
            -0.85702449,
            -0.85702449,
            1.8904849,
            -1.0542384,
            -1.0542384,
        ),
        2,
    ),
    "between two holds, Fig. 4": (
        {"S": 0.02375942},
        (0.0237575, 0.0239),
        (LEFT, TOUCHED, LEFT, REST, RIGHT, LEFT, HELD, RIGHT, TOUCHED, RIGHT),
        (
            25.061181,
            30.524056,
            31.60267,
            32.755881,
            33.497175,
            37.805205,
            42.187585,
            43.931448,
            44.007729,
            45.51325,
        ),
        (
            1.77163,
            -0.87844827,
            -0.87844827,
            -0.90568181,
            -0.90568181,
            1.9181697,
            -1.0236787,
            -1.0236787,
            -1.0236786,
            -1.0236786,
        ),
        7,
    ),
    "up to no friction, Fig. 4": (
        {"S": 2.358977e-06},
        (0.0, 2.6e-6),
        (LEFT, REST, RIGHT, LEFT, HELD, RIGHT, REST, RIGHT),
        (25.13274, 29.478103, 33.35378, 37.699122, 42.044472, 43.427364, 43.49487, 45.92013),
        (
            1.9220589,
            -0.96618452,
            -0.96618452,
            1.9220635,
            -0.96619624,
            -0.96619624,
            -0.96619293,
            -0.96619293,
        ),
        5,
    ),
}
CASES = tuple(BRIDGES)
EVENTS = {CASES[0]: "SS", CASES[1]: "GS", CASES[2]: "GS", CASES[3]: ""}


@functools.cache
def bridge(case: str) -> cf.Branch:
    params, span, itinerary, times, places, _ = BRIDGES[case]
    some = cf.solve_orbit("coulomb", "2s", {"Omega": 0.5, "S": 0.3, "S0": 0.4})
    joints = np.column_stack([times, places, np.zeros(len(times))])
    vector = some.vector.copy()
    for name, value in params.items():
        vector[some.model.index_of(name)] = value
    system = build_system(some.model, itinerary, 2)
    orbit = refine(replace(some, system=system, joints=joints, vector=vector))
    assert orbit.converged
    return cf.continue_orbit(orbit, "S", span)


@functools.cache
def proof(case: str) -> BranchCertificate:
    return certify_branch(bridge(case))


@functools.cache
def events(case: str) -> list[EventCertificate]:
    return [event.certify("S") for event in bridge(case).bifurcations]


@functools.cache
def end_of(case: str) -> tuple[Tracer, Vanishing]:
    branch = bridge(case)
    with ctx.workprec(80):
        tracer = Tracer(branch, events(case), np.inf)
        found = [one for one in tracer.flips if isinstance(one, Vanishing)]
        assert len(found) == 1
        return tracer, found[0]


@pytest.mark.parametrize("case", CASES)
def test_a_bridge_is_proved_up_to_where_a_slide_has_no_length(case: str) -> None:
    found = proof(case)
    assert found.complete, (found.gaps, found.open)
    (ends,) = [piece for piece in found.pieces if piece.ends]
    (name,) = ends.ends
    assert (name.segment, name.what) == (BRIDGES[case][-1], DURATION)
    assert [label.split("_")[0] for label in ends.events] == [EVENTS[case]] * bool(EVENTS[case])
    assert not any(piece.folds for piece in found.pieces)


def on_the_branch(tracer: Tracer, box: Vanishing, share: float) -> Vector:
    """Return balls of the orbit at a share of the reach, by the equations of the chain itself."""
    point = solved(
        tracer.segments, tracer.build, tracer.plain, [x.mid() for x in box.guess(share)], box.plane
    )
    assert point is not None
    zero = orbit_in(tracer.segments, tracer.build, point, box.plane)
    assert zero is not None
    return zero


@pytest.mark.parametrize("case", CASES)
def test_orbits_of_the_chain_are_in_the_box_and_move_as_its_rates_say(case: str) -> None:
    """The parameter between two orbits of the chain is the integral of its rate, d^k times a ball."""
    tracer, box = end_of(case)
    with ctx.workprec(160):
        chain = ShortSlideChain(
            tracer.segments, tracer.build(box.box[-1]), box.place, box.box, arb(0).union(box.reach)
        )
        rows = chain.scaled(chain.regular()[1])
        assert rows is not None
        rate = arb_mat(rows).solve(arb_mat(len(rows), 1, [0] * (len(rows) - 1) + [1]))[
            len(rows) - 1, 0
        ]
        shares, power = (0.1, 0.25, 0.5, 0.75), chain.order + 1
        zeros = [on_the_branch(tracer, box, share) for share in shares]
        assert all(box.surrounds(zero) for zero in zeros)
        lasts = [zero[box.at[1]] - zero[box.at[0]] for zero in zeros]
        for k in range(len(zeros) - 1):
            moved = zeros[k + 1][-1] - zeros[k][-1]
            change = (lasts[k + 1] ** power - lasts[k] ** power) / power
            assert rate.overlaps(moved / change)
            assert abs(float((moved / change / rate).mid()) - 1) < 0.2
        assert power == (3 if EVENTS[case] != "GS" or case == CASES[1] else 2)


def test_the_parameter_of_the_bridge_of_fig_13_moves_with_the_cube() -> None:
    """As printed orbits from d = 0.0025 to 0.03 show."""
    tracer, box = end_of(CASES[0])
    with ctx.workprec(160):
        zero = on_the_branch(tracer, box, 0.02)
        d = (zero[box.at[1]] - zero[box.at[0]]) / 0.5  # phases divided by Omega
        event = events(CASES[0])[0].value
        assert event is not None
        assert abs(float(((event - zero[-1]) / d**3).mid()) - 0.00788) < 1e-4


@pytest.mark.parametrize("case", CASES)
def test_equations_and_their_derivatives(case: str) -> None:
    """Solutions of the chain solve them; the Jacobian is that of difference quotients in 200 bits."""
    tracer, box = end_of(case)
    m = tracer.segments.states + 1
    with ctx.workprec(200):

        def at(x: Vector) -> tuple[Vector, list[Vector]]:
            length = x[box.at[1]] - x[box.at[0]]
            return ShortSlideChain(
                tracer.segments, tracer.build(x[-1]), box.place, x, length
            ).regular()

        zero = [x.mid() for x in on_the_branch(tracer, box, 0.5)]
        assert all(abs(r) < 1e-12 for r in at(zero)[0])
        rng = np.random.default_rng(7)
        x = [
            c + arb(float(e)) for c, e in zip(zero, 0.01 * rng.normal(size=len(zero)), strict=True)
        ]
        _, rows = at(x)
        h = arb(2) ** -80
        touched = range(max(0, box.at[0] - m), min(len(x), box.at[1] + m + 2))
        for k in {*touched, len(x) - 1}:
            other = [c + h * int(j == k) for j, c in enumerate(x)]
            before = [c - h * int(j == k) for j, c in enumerate(x)]
            for row, a, b in zip(rows, at(other)[0], at(before)[0], strict=True):
                assert abs((a - b) / (2 * h) - row[k]) < 1e-18


def is_proved(tracer: Tracer, place: ShortSlide, near: Vector, reach: float) -> bool:
    found = box_up_to(tracer, place, near, reach, None)
    return found is not None and found.piece.proved


def test_what_is_no_such_end_is_not_taken_for_one() -> None:
    """A slide of negative length, one of the wrong kind, and an event at which another rest is left."""
    tracer, box = end_of(CASES[1])
    segments, place, reach = tracer.segments, box.place, float(box.reach)
    near = tracer.point(tracer.branch[-1])
    with ctx.workprec(80):
        beyond = solution_with(tracer, place, near, arb(-0.1 * reach))
        assert beyond is not None and not box.covers(beyond) and not box.surrounds(beyond)
        assert box.covers(near)
        assert not box.covers([x + 1e-2 for x in near])
        assert is_proved(tracer, place, near, reach)
        assert not is_proved(tracer, replace(place, sign=-place.sign), near, reach)
        assert not is_proved(tracer, replace(place, touches=True), near, reach)
        (event,) = (one for one in events(CASES[1]) if one.proved)
        own = event, tracer.system, segments, tracer.build, near
        assert as_zero_of(*own, place) is not None
        slides = [i for i, mode in enumerate(segments.modes) if i and mode != "stick"]
        for other in slides:
            moved = as_zero_of(*own, replace(place, segment=other))
            assert (moved is None) == (other != place.segment)


def test_a_branch_beyond_its_end_is_not_proved() -> None:
    """Its equations have solutions with a slide of negative length, too."""
    tracer, box = end_of(CASES[1])
    branch, place = tracer.branch, box.place
    near, count, scale = tracer.point(branch[-1]), len(branch), 2.0  # times are phases over Omega
    with ctx.workprec(80):
        for d in (1e-5, -1e-5, -1e-3):
            point = solution_with(tracer, place, near, arb(d))
            assert point is not None
            joints = np.array([float(x) for x in point[:-1]]).reshape(branch.joints[-1].shape)
            joints[:, 0] *= scale
            arrays = {
                "joints": np.concatenate([branch.joints[:-1], [joints]]),
                "values": np.append(branch.values[:-1], float(point[-1])),
            }
            changed = Tracer(replace(branch, **arrays), events(CASES[1]), np.inf)
            pieces = changed.step(count - 2, count - 1)[0]
            assert all(piece.proved for piece in pieces) == (d > 0)
