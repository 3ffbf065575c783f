"""The LuGre oscillator: its solution against scipy's, its orbits against each other and simulation."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import contfric as cf
from contfric.bvp.system import build_system
from contfric.continuation.half_branch import first_point
from contfric.continuation.locating.smooth import smooth_events
from contfric.continuation.points import settings_of
from contfric.continuation.step import Step
from contfric.continuation.trace import trace_side
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine

#: Integrated models from end to end: minutes of processor time, run by `make test-all`.
pytestmark = pytest.mark.slow

WHERE = {"Omega": 0.5, "S0": 0.4}
#: Events of the symmetric branch of Fig. 17 between S = 0.374 and S = 0.378 (docs/gallery/fig17.md).
FOLDS = (0.3750595439839, 0.3757051387250)
BREAKING = 0.3757014023946
GALLERY = Path(__file__).parents[2] / "docs" / "gallery"
NONE, NOTHING = np.empty(0, dtype=np.int64), np.empty((0, 0))


@pytest.fixture(scope="module")
def model():
    return cf.load_model("lugre")


@pytest.fixture(scope="module")
def orbit(model):
    return cf.find_orbit(model, {**WHERE, "S": 0.38})


def advance(model, t, y, dt, p):
    out = np.empty(3)
    model.flow.flow(0, t, np.array(y), dt, p, NONE, out, NOTHING)
    return out


def by_pieces(field, level, t, y, dt, **options):
    """Integrate with scipy; in each piece the side of ``v = level`` is held: ``field(t, y, side)``."""
    side, end, y = math.copysign(1.0, y[1] - level), t + dt, np.array(y)

    def meets(t, y, side):
        return y[1] - level

    meets.terminal = True
    while True:
        meets.direction = -side
        found = solve_ivp(field, (t, end), y, events=meets, args=(side,), **options)
        t, y = float(found.t[-1]), found.y[:, -1]
        if found.status == 0:
            return y
        side, y[1] = -side, level


def lugre_by_scipy(t0, y0, dt, omega, s, s0, sigma0=1000.0, vs=0.05):
    """Integrate the oscillator with scipy's explicit method of order 8."""

    def field(t, y, sign):
        x, v, z = y
        g = s + (s0 - s) * math.exp(-sign * v / vs)
        return [v, math.cos(omega * t) - x - sigma0 * z, v - sigma0 * sign * v / g * z]

    options = {"method": "DOP853", "rtol": 1e-12, "atol": [1e-12, 1e-12, 1e-15]}
    return by_pieces(field, 0.0, t0, y0, dt, **options)


def test_motion_through_many_kinks_is_that_of_scipy(model):
    start, dt = [1.2, -0.3, 0.0], 5.0  # a slide, a stop and micro-oscillations
    p = model.vector({**WHERE, "S": 0.3})
    mine = advance(model, 4.0, start, dt, p)
    theirs = lugre_by_scipy(4.0, start, dt, 0.5, 0.3, 0.4)
    assert np.abs((mine - theirs) / [1.0, 1.0, 1e-3]).max() < 2e-9


def test_derivatives_pass_kinks(model):
    which = np.array([model.index_of("S"), model.index_of("Omega")], dtype=np.int64)
    params = {**WHERE, "S": 0.3}
    p, start = model.vector(params), np.array([1.2, -0.3, 0.0])
    out, jac = np.empty(3), np.empty((3, 7))
    model.flow.flow(0, 4.0, start, 5.0, p, which, out, jac)
    for column, (name, h) in enumerate((("t", 1e-6), (0, 1e-6), (1, 1e-6), (2, 1e-9), ("dt", 1e-6),
                                        ("S", 1e-6), ("Omega", 1e-6))):  # fmt: skip
        ends = []
        for side in (h, -h):
            y = start.copy()
            if isinstance(name, int):
                y[name] += side
            q = model.vector({**params, name: params[name] + side}) if name in params else p
            t, dt = 4.0 + side * (name == "t"), 5.0 + side * (name == "dt")
            ends.append(advance(model, t, y, dt, q))
        difference = (ends[0] - ends[1]) / (2.0 * h)
        assert jac[:, column] == pytest.approx(difference, abs=3e-6 * np.abs(jac[:, column]).max())


def test_hits_of_a_kink_follow_each_other(model, orbit):
    stops = orbit.stops
    assert len(stops) == 6
    assert stops[:3] == pytest.approx(-stops[3:], abs=1e-12)
    c = [o.name for o in model.observables].index("v")
    times, values = np.empty(64), np.empty(64)
    start = orbit.begins[0]
    span = float(orbit.ends[0, 0] - start[0])
    found = model.flow.stationary(
        0, c, start[0], start[1:].copy(), span, orbit.vector, times, values
    )
    assert found >= 3
    for tau, value in zip(times[:found], values[:found], strict=True):
        h = 1e-5
        around = [
            advance(model, start[0], start[1:], tau + side, orbit.vector)[1] for side in (-h, h)
        ]
        assert advance(model, start[0], start[1:], tau, orbit.vector)[1] == pytest.approx(
            value, abs=1e-10
        )
        assert (around[0] - value) * (around[1] - value) > 0.0


def test_multipliers_are_those_of_the_stroboscopic_map(model, orbit):
    period, y = 4.0 * math.pi, orbit.state(1.0)
    columns = []
    for j, h in enumerate((1e-6, 1e-6, 1e-9)):
        unit = np.eye(3)[j] * h
        ends = [advance(model, 1.0, y + side * unit, period, orbit.vector) for side in (1, -1)]
        columns.append((ends[0] - ends[1]) / (2.0 * h))
    mine = orbit.multipliers[:2]
    theirs = np.linalg.eigvals(np.column_stack(columns))
    theirs = theirs[np.argsort(-np.abs(theirs))][:2]
    for e in (1, 2):  # what does not depend on their order
        assert np.sum(mine**e) == pytest.approx(np.sum(theirs**e), abs=1e-6)


@pytest.mark.slow
def test_events_do_not_depend_on_where_orbits_are_cut(model, orbit):
    other = cf.find_orbit(model, {**WHERE, "S": 0.38, "phi0": 2.1})
    for start, max_step in ((orbit, 0.002), (other, 0.001)):
        branch = cf.continue_orbit(start, "S", (0.374, 0.385), max_step=max_step)
        found = {kind: [] for kind in cf.Kind}
        for event in branch.bifurcations:
            found[event.kind].append(event.params["S"])
        assert sorted(found[cf.Kind.SN]) == pytest.approx(FOLDS, abs=1e-11)
        assert found[cf.Kind.BP] == pytest.approx([BREAKING], abs=1e-12)
        assert len(branch.bifurcations) == 3


@pytest.mark.parametrize(("offset", "symmetric"), [(1e-6, True), (-1e-6, False)])
def test_simulation_settles_on_what_the_symmetry_breaking_says(model, orbit, offset, symmetric):
    """Symmetric orbits are stable in a window of 3.7e-6 between the branch point and a fold."""
    branch = cf.continue_orbit(orbit, "S", (0.374, 0.385), max_step=0.002)
    breaking = next(b for b in branch.bifurcations if b.kind is cf.Kind.BP)
    at = {**WHERE, "S": BREAKING + offset}
    beside = refine(replace(breaking.orbit, vector=model.vector(at)))
    assert beside.converged
    assert beside.stable == symmetric
    shift = np.array([1e-8, 0.0, 0.0])
    settled = cf.find_orbit(model, at, state=beside.state(0.0) + shift, longest=20_000)
    assert settled.stable
    assert settled.symmetric == symmetric
    assert (settled.asymmetry < 1e-9) == symmetric


#: An asymmetric orbit of Fig. 18 next to where it becomes symmetric: a start for Newton's method.
NEAR_TIP = 0.490259010970
TIP_JOINTS = (
    (7.835843029157, -1.320997426700, 0.066705858841, 3.41548991398e-4),
    (14.243869364818, 1.320998633584, -0.066718099958, -3.41543633732e-4),
)
#: The branch point there, 8e-8 next to a fold of the symmetric branch, and the doubling 4e-7 before it.
TIP, DOUBLING = 0.490256250422, 0.490256687616


@pytest.fixture(scope="module")
def tip(model):
    other = cf.find_orbit(model, {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    vector = model.vector({"Omega": NEAR_TIP, "S": 0.32, "S0": 0.4})
    found = refine(replace(other, joints=np.array(TIP_JOINTS), vector=vector), damped=False)
    assert found.converged and not other.symmetric
    assert 1e-6 < found.mirror_distance < 1e-4
    return found


@pytest.mark.parametrize("max_step", [0.01, 0.001, 3e-4, 1e-4])
def test_an_asymmetric_branch_ends_at_a_tip_beside_a_fold(tip, max_step):
    """It does not go on along the symmetric branch, whatever the steps are."""
    settings = settings_of(tip, "Omega", (0.46, 0.56), max_step, True, 400)
    start = first_point(tip, settings)
    side = trace_side(tip, start if start.slope < 0.0 else start.reversed(), settings)
    assert side.end.reason is cf.EndReason.BP
    event = side.end.bifurcation
    assert event.params["Omega"] == pytest.approx(TIP, abs=2e-12)
    assert event.accuracy < 1e-7 and event.orbit.symmetric
    (doubling,) = side.bifurcations
    assert doubling.kind is cf.Kind.PD
    assert doubling.params["Omega"] == pytest.approx(DOUBLING, abs=1e-11)
    assert doubling.accuracy < 1e-7


PLANE = ("Omega", "S")


@pytest.fixture(scope="module")
def symmetric(orbit):
    """The symmetric branch of Fig. 17 about its folds, with the step that the model declares."""
    return cf.continue_orbit(orbit, "S", (0.374, 0.385))


def test_the_models_own_step_finds_the_folds(model, symmetric):
    assert model.max_step == 0.001
    found = {kind: [] for kind in cf.Kind}
    for event in symmetric.bifurcations:
        found[event.kind].append(event.params["S"])
    assert sorted(found[cf.Kind.SN]) == pytest.approx(FOLDS, abs=1e-11)
    assert found[cf.Kind.BP] == pytest.approx([BREAKING], abs=1e-12)


@pytest.mark.slow
def test_a_step_that_leaps_over_folds_is_taken_back(orbit):
    """Two sheets are 8e-5 apart where steps are 2e-2: between the ends of a leap no branch is found."""
    branch = cf.continue_orbit(orbit, "S", (0.36, 0.385), max_step=0.01)
    folds = [b.params["S"] for b in branch.bifurcations if b.kind is cf.Kind.SN]
    assert sorted(folds) == pytest.approx(FOLDS, abs=1e-11)
    assert len(branch.bifurcations) == 3
    assert all(b.located for b in branch.bifurcations)


#: Orbits of four periods on two sheets, 2e-5 apart where both are (S = 0.32).
SHEETS = {
    0.490310037732409: [
        [7.83502754982629, -1.3209512803985, 0.0667262718926827, 0.000341539942939076],
        [14.2423869996125, 1.32096887176635, -0.0669386378117495, -0.000341447196490157],
    ],
    0.490264850409885: [
        [7.83574969810305, -1.32099389560562, 0.066705186722161, 0.000341549277563862],
        [14.2436997091289, 1.32099616892822, -0.0667449231321863, -0.000341531882206899],
    ],
}


def test_a_step_to_another_sheet_that_is_solved_everywhere_is_taken_back(model):
    """Newton fails nowhere between: a multiplier jumps from -1528 to 63 where the trials change the sheet."""
    system = build_system(model, (("second", "phase"), ("first", "phase")), 4)
    ends, arc = [], 0.0
    for value, joints in SHEETS.items():
        vector = model.vector({**WHERE, "S": 0.32, "Omega": value})
        orbit = refine(Orbit(system, np.array(joints), vector, np.inf), damped=False)
        settings = settings_of(orbit, "Omega", (0.46, 0.56), None, True, 20_000, None)
        point = first_point(orbit, settings)
        ends.append(replace(point if point.slope < 0.0 else point.reversed(), arc=arc))
        arc += 1.16e-3
    before, after = ends
    assert before.mu[0].real < -1000.0 and after.mu[0].real > 10.0
    found = smooth_events(Step(orbit, before, after, after, settings))
    assert [point.lost for _, point in found] == [True]


def at(orbit, **changed):
    vector = orbit.model.vector({**orbit.params, **changed})
    return refine(replace(orbit, vector=vector), damped=False)


def test_symmetry_breaking_beside_a_touch_is_located_to_rounding(symmetric):
    """The multiplier passes -1 at 4e6 a unit of S: within 3e-13 of the point it must change sides."""
    (event,) = (b for b in symmetric.bifurcations if b.kind is cf.Kind.BP)
    sides = [at(event.orbit, S=event.params["S"] + d) for d in (-3e-13, 3e-13)]
    below, above = (np.min(o.turn_multipliers.real) + 1.0 for o in sides)
    assert below < 0.0 < above
    assert above - below < 1e-5


def test_curve_of_the_symmetry_breaking_beside_a_touch(symmetric):
    """Its points by orbits alone: 1e-9 below them the multiplier is beyond -1, 1e-9 above it is not."""
    (event,) = (b for b in symmetric.bifurcations if b.kind is cf.Kind.BP)
    ranges = {"Omega": (0.498, 0.502), "S": (0.36, 0.39)}
    curve = cf.continue_bifurcation(event, PLANE, ranges, max_step=0.05, max_points=8)
    assert len(curve) > 8
    assert np.all(np.diff(curve.values, axis=0) > 0.0)
    for k in (0, len(curve) // 4, -1):
        s = float(curve.values[k, 1])
        below, above = (at(curve[k], S=s + d).turn_multipliers for d in (-1e-9, 1e-9))
        assert np.min(below.real) < -1.0 < np.min(above.real)


@pytest.mark.slow
def test_fold_curve_is_where_runs_in_one_parameter_turn(model, symmetric):
    """Orbits are simulated above the fold, away from the curve, and continued down to it."""
    event = min(
        (b for b in symmetric.bifurcations if b.kind is cf.Kind.SN), key=lambda b: b.params["S"]
    )
    ranges = {"Omega": (0.496, 0.504), "S": (0.35, 0.39)}
    curve = cf.continue_bifurcation(event, PLANE, ranges, max_step=0.05, max_points=6)
    assert len(curve) > 6
    for k in (0, -1):
        omega, s = curve.values[k]
        start = cf.find_orbit(model, {"Omega": omega, "S": s + 0.002, "S0": 0.4})
        branch = cf.continue_orbit(start, "S", (s - 0.001, s + 0.003))
        found = [b.params["S"] for b in branch.bifurcations if b.kind is cf.Kind.SN]
        assert min(found) == pytest.approx(s, abs=1e-11)


def belt_by_scipy(t0, y0, dt, p):
    """Integrate the block on the belt with scipy's Radau method."""

    def field(t, y, side):
        x, v, z = y
        slip = v - p["vb"]
        dz = slip - p["sigma0"] * side * slip * (1.0 + p["delta"] * side * slip) / p["Fs"] * z
        return [v, -x - p["sigma0"] * z - p["sigma1"] * dz, dz]

    options = {"method": "Radau", "rtol": 1e-9, "atol": [1e-11, 1e-11, 1e-14]}
    return by_pieces(field, p["vb"], t0, y0, dt, **options)


def test_stick_slip_on_a_belt_is_that_of_scipy():
    """One cycle of `belt-lugre` from its stop, by another integrator, ends where it began."""
    orbit = cf.find_orbit("belt-lugre")
    page = (GALLERY / "belt.md").read_text(encoding="utf-8")
    period, largest, smallest = re.findall(r"^\| 1e3 \| (\S+) \| (\S+) \| (\S+) \|$", page, re.M)[0]
    assert orbit.period == pytest.approx(float(period), abs=1e-9)
    assert orbit.x_max == pytest.approx(float(largest), abs=1e-8)
    assert orbit.x_min == pytest.approx(float(smallest), abs=1e-8)
    start = orbit.joints[0]
    there = belt_by_scipy(start[0], start[1:], orbit.period, orbit.params)
    assert np.abs((there - start[1:]) / [1.0, 1.0, 1e-3]).max() < 2e-7


def printed(page, low, high, orbits):
    """Return the events of a page's table in a range: (kind, value) of those of one kind of orbits."""
    text = (GALLERY / f"{page}.md").read_text(encoding="utf-8")
    rows = re.findall(rf"^\| (\w\w)_{orbits}, 2seg \| (\d\.\d+) \|", text, re.M)
    return sorted((float(value), kind) for kind, value in rows if low < float(value) < high)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("page", "params", "parameter", "bounds", "orbits"),
    [
        ("fig17", {"Omega": 0.5, "S": 0.352}, "S", (0.35, 0.377), "0a"),
        ("fig18", {"S": 0.32, "Omega": 0.4033}, "Omega", (0.403, 0.406), "0s"),
        ("fig18", {"S": 0.32, "Omega": 0.541}, "Omega", (0.54, 0.556), "0a"),
    ],
    ids=["meander", "loop", "main"],
)
def test_tables_of_the_gallery_are_computed_anew(model, page, params, parameter, bounds, orbits):
    """A short run with the model's own step finds what is printed there, and nothing else."""
    orbit = cf.find_orbit(model, {**params, "S0": 0.4})
    branch = cf.continue_orbit(orbit, parameter, bounds)
    assert branch.name == f"{orbits}, 2seg"
    found = sorted(
        (b.params[parameter], b.kind.value)
        for b in branch.bifurcations
        if b.orbit.symmetric == (orbits == "0s")  # an asymmetric branch begins at a symmetric orbit
    )
    known = printed(page, *bounds, orbits)
    assert len(known) >= 2
    assert [kind for _, kind in found] == [kind for _, kind in known]
    for (value, _), (shown, _) in zip(found, known, strict=True):
        assert value == pytest.approx(shown, abs=5.5e-10)


def test_a_doubled_orbit_ends_where_it_is_one_run_twice(model):
    """Its joints are those of one half only: that it has become the simpler orbit is seen by running it."""
    orbit = cf.find_orbit(model, {"Omega": 0.552, "S": 0.32}, periods=2)
    branch = cf.continue_orbit(orbit, "Omega", (0.5505, 0.556))
    assert [end.reason.name for end in branch.ends] == ["PD", "PD"]
    found = sorted(end.bifurcation.params["Omega"] for end in branch.ends)
    assert found == pytest.approx((0.55144831386, 0.55430837389), abs=1e-9)
    for point in branch[1:-1:20]:
        half = 0.5 * point.period
        there = [point.state(float(joint[0]) + half) - joint[1:] for joint in point.cycle]
        assert np.max(np.abs(there)) > 1e-6
    steps = np.linalg.norm(np.diff(branch.joints.reshape(len(branch), -1), axis=0), axis=1)
    assert np.max(steps) < 1.0  # and the ends are rotated as the points next to them
