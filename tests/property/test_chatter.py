"""Chatter: infinitely many impacts and the contact after them, as one segment.

Each number comes a second way: the impacts one after the other in 40 digits, and motions of two masses by
exponentials of matrices, impact by impact, with the last ones left out.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import pairwise
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq
from typed import typed

import contfric as cf
from contfric.errors import ModelError, ParameterError
from contfric.events.bifurcation import EndReason
from contfric.models.check import check_model
from contfric.models.shorthand.chatter import with_chatter
from contfric.simulation.simulate import SimulationEnd, go_on

BALL = """
name: ball
states: [x, v]
parameters: {{a: 1.2, e: 0.5}}
constraints: [a >= 0, e >= 0, e < 1]
period: 2*pi
observables: {{gap: x - a*sin(t)}}
surfaces: {{table: {{observable: gap}}}}
modes: {{flight: {{in: {{table: +}}, field: {{x: v, v: -1}}}}}}
resets: {{table: {{{reset}, chatter: true}}}}
spread: {{x: 6, v: 3}}
"""
IMPACT = "v: (1 + e)*a*cos(t) - e*v"


def ball(folder: Path, reset: str = IMPACT) -> cf.Model:
    return typed(folder, BALL.format(reset=reset))


def impacts_of(a: float, e: float, t: float, v: float) -> list[tuple[mp.mpf, mp.mpf]]:
    """Return (time, speed off the table) after impacts from one on, in 40 digits, until these are slow."""
    t, v, a, e = mp.mpf(t), mp.mpf(v), mp.mpf(a), mp.mpf(e)
    x, found = a * mp.sin(t), []
    while v - a * mp.cos(t) > mp.mpf(10) ** -16:
        found.append((t, v - a * mp.cos(t)))

        def lowered(s: mp.mpf, t: mp.mpf = t, x: mp.mpf = x, v: mp.mpf = v) -> mp.mpf:
            return (x + v * s - s * s / 2 - a * mp.sin(t + s)) / s

        s = 2 * (v - a * mp.cos(t)) * mp.mpf("0.01")
        while lowered(s) > 0:
            s *= mp.mpf("1.2")
        s = mp.findroot(lowered, (s / mp.mpf("1.2"), s), solver="anderson")
        t, x, v = t + s, x + v * s - s * s / 2, v - s
        v = (1 + e) * a * mp.cos(t) - e * v
    return found


@pytest.mark.parametrize("seed", range(12))
def test_the_limit_of_impacts_in_40_digits(seed: int, tmp_path: Path) -> None:
    mp.mp.dps = 40
    draw, model = np.random.default_rng(seed), ball(tmp_path)
    a, e = float(draw.uniform(0.2, 0.9)), float(draw.uniform(0.05, 0.85))
    t, speed = float(draw.uniform(0.0, 6.0)), float(draw.uniform(0.01, 0.3))
    v = a * np.cos(t) + speed
    rests = impacts_of(a, e, t, v)[-1][0] - mp.mpf(t)
    view = model.view(model.vector({"a": a, "e": e}))
    start = np.array([a * np.sin(t), v])
    times, heights = view.stationary("chatter", "table_lift", t, start, float(rests) + 0.5)
    assert abs(times[0] - float(rests)) < 2e-13 * (1.0 + float(rests))
    assert heights[0] == pytest.approx(-1.0 + a * np.sin(t + float(rests)), abs=1e-12)
    behind = view.state("chatter", t, start, float(rests) + 0.25)
    end = t + float(rests) + 0.25
    assert behind == pytest.approx([a * np.sin(end), a * np.cos(end)], abs=1e-12)
    share = float(draw.uniform(0.0, 1.0))  # without derivatives the state is that in flight
    inside = view.state("chatter", t, start, share * float(rests))
    assert inside[0] - a * np.sin(t + share * float(rests)) > -1e-13


def moved(matrix: np.ndarray, state: np.ndarray, time: float) -> np.ndarray:
    return np.asarray(expm(matrix * time) @ state)


def two_masses(p: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return the matrices of flight and contact of the bundled pair of frames, on (q, v, cos, sin)."""
    w, F, m, k, z = (p[name] for name in ("w", "F", "m", "k", "zeta"))
    flight = np.zeros((6, 6))
    flight[0, 2] = flight[1, 3] = 1.0
    flight[2] = [-1.0, 0.0, -2.0 * z, 0.0, F, 0.0]
    flight[3] = [0.0, -k / m, 0.0, -2.0 * z, F, 0.0]
    flight[4, 5], flight[5, 4] = -w, w
    contact = flight.copy()
    contact[2] = contact[3] = (flight[2] + m * flight[3]) / (1.0 + m)
    return flight, contact


def _height(
    watched: Callable[[np.ndarray], float], matrix: np.ndarray, state: np.ndarray, time: float
) -> float:
    return float(watched(moved(matrix, state, time)))


def one_period(p: dict[str, float], t: float, y: np.ndarray) -> np.ndarray:
    """Return the state of two masses a period later: impact by impact, then contact, then flight."""
    flight, contact = two_masses(p)
    w, m, e, d = (p[name] for name in ("w", "m", "e", "d"))
    state, end, rests = np.array([*y, np.cos(w * t), np.sin(w * t)]), t + 2.0 * np.pi / w, False
    released = False
    apart = np.array([-1.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    while t < end:
        matrix = contact if rests else flight
        watched = (
            (lambda s: apart @ flight @ flight @ s) if rests else (lambda s: d + apart @ s)
        )  # the force, or the gap
        fast = abs(apart @ flight @ state)
        step = min(0.02, 0.02 * (fast if not rests and fast > 0.0 else 1.0) + 1e-12)
        after = 0.05 if released else 0.0  # off the wall by the third power of time
        side = -1.0 if rests else 1.0
        while t + after < end:
            after, before = min(after + step, end - t), after
            if before > 0.0 and side * watched(moved(matrix, state, after)) < 0.0:
                height = partial(_height, watched, matrix, state)
                after = brentq(height, before, after, xtol=1e-15)
                break
            step = min(0.02, 1.3 * step)
        else:
            return moved(matrix, state, end - t)[:4]
        state, t = moved(matrix, state, after), t + after
        released, rests = rests, False
        if released:
            continue
        change = -(1.0 + e) * (state[3] - state[2]) / (1.0 + 1.0 / m)
        state[2] -= change
        state[3] += change / m
        if apart @ flight @ state < 1e-8:
            assert apart @ flight @ flight @ state < 0.0
            mean = (state[2] + m * state[3]) / (1.0 + m)
            state[2] = state[3] = mean
            rests = True
    return state[:4]


@pytest.mark.parametrize("seed", range(3))
def test_multipliers_of_chatter_by_differences_of_a_simulated_period(seed: int) -> None:
    draw = np.random.default_rng(seed)
    p = {
        "w": float(draw.uniform(0.25, 0.4)),
        "e": float(draw.uniform(0.1, 0.3)),
        "d": 0.0,
        "F": 0.5,
    }
    orbit = cf.find_orbit("pounding", p)
    assert "chatter" in str(orbit.signature) and orbit.admissible
    i = next(k for k, (mode, _) in enumerate(orbit.itinerary) if mode == "free")
    middle = 0.5 * (orbit.begins[i, 0] + orbit.ends[i, 0])
    state = orbit.flow.state(
        "free", orbit.begins[i, 0], orbit.begins[i, 1:], middle - orbit.begins[i, 0]
    )
    p = dict(orbit.params)
    assert one_period(p, middle, state) == pytest.approx(state, abs=1e-8)
    step = 1e-4
    map_ = np.array(
        [
            (one_period(p, middle, state + s) - one_period(p, middle, state - s)) / (2.0 * step)
            for s in step * np.eye(4)
        ]
    ).T
    expected = sorted(np.linalg.eigvals(map_), key=abs)
    for one, other in zip(sorted(orbit.multipliers, key=abs), expected, strict=True):
        assert abs(one - other) < 1e-6
    assert np.count_nonzero(orbit.multipliers) <= 2  # contact keeps two states of four


def test_a_branch_goes_to_where_the_chatter_is_not_complete_any_more() -> None:
    orbit = cf.find_orbit("bouncing-ball", {"a": 1.2, "e": 0.5})
    assert [d for d in orbit.signature.segments if "impact" not in d] == ["chatter", "flight"]
    diagram = cf.explore(orbit, "a", (1.05, 1.8))
    (branch,) = diagram.branches
    (event,) = diagram.bifurcations
    assert branch.ends[1].reason is EndReason.AS and "incomplete chatter" in str(branch.ends[1])
    a = event.params["a"]
    # the impacts in 40 digits: complete below, and thrown off above
    mp.mp.dps = 40
    for shift, complete in ((-1e-7, True), (1e-7, False)):
        found = _flown(a + shift, 0.5)
        assert bool(found < 2.0 * np.pi + np.arcsin(1.0 / (a + shift))) is complete


def _flown(a: float, e: float) -> float:
    """Return when the impacts after one release end; a time beyond the next release if they do not."""
    a_, t = mp.mpf(a), mp.asin(1 / mp.mpf(a))
    x, v = a_ * mp.sin(t), a_ * mp.cos(t)

    def gap(s: mp.mpf) -> mp.mpf:
        return x + v * s - s * s / 2 - a_ * mp.sin(t + s)

    s = mp.mpf("0.1")
    while gap(s) > 0:
        s += mp.mpf("0.05")
    s = mp.findroot(gap, (s - mp.mpf("0.05"), s), solver="anderson")
    v = v - s
    t = t + s
    v = (1 + mp.mpf(e)) * a_ * mp.cos(t) - mp.mpf(e) * v
    release = 2 * mp.pi + mp.asin(1 / a_)
    e_ = mp.mpf(e)
    while t < release:
        speed, x = v - a_ * mp.cos(t), a_ * mp.sin(t)
        if speed < mp.mpf(10) ** -16:
            return float(t)
        s = 2 * speed * mp.mpf("0.01")

        def lowered(s: mp.mpf, t: mp.mpf = t, x: mp.mpf = x, v: mp.mpf = v) -> mp.mpf:
            return (x + v * s - s * s / 2 - a_ * mp.sin(t + s)) / s

        while lowered(s) > 0 and s < 3:
            s *= mp.mpf("1.2")
        if s >= 3:
            break
        s = mp.findroot(lowered, (s / mp.mpf("1.2"), s), solver="anderson")
        t, v = t + s, v - s
        v = (1 + e_) * a_ * mp.cos(t) - e_ * v
    return float("inf")


def test_indices_are_not_summed_where_chatter_is_not_complete_any_more() -> None:
    """Branches with any number of impacts come together there: all of them are never in a diagram."""
    draw = np.random.default_rng(15)
    params = {"a": draw.uniform(1.3, 1.5), "e": draw.uniform(0.4, 0.48)}
    orbit = cf.find_orbit("bouncing-ball", params, state=[3.0, 0.0])
    diagram = cf.explore(orbit, "a", (1.25, 1.75), max_periods=1)
    lost = [
        k for k, node in enumerate(diagram.nodes) if "table_lift" in str(node.bifurcation.tests)
    ]
    assert len(lost) == 1
    assert "incomplete chatter" in str(diagram.loose_ends[0])
    checked = diagram.verify(1)
    assert checked.passed, str(checked)
    assert all(b.below is None and b.above is None for b in checked.balances if b.event in lost)


@pytest.mark.parametrize("e", [0.2, 0.5])
def test_quantities_and_gradients_of_chatter(e: float) -> None:
    def orbit(a: float, e: float) -> cf.Orbit:
        return cf.find_orbit("bouncing-ball", {"a": a, "e": e})

    here, step = orbit(1.2, e), 1e-4
    t0 = float(np.arcsin(1.0 / 1.2))
    first = here.begins[0, 0] % (2.0 * np.pi)
    flown = (
        1.0 * (first - t0) + 1.2 * np.cos(t0) * (first - t0) ** 2 / 2.0 - (first - t0) ** 3 / 6.0
    )
    mp.mp.dps = 40
    total, times = flown, impacts_of(1.2, e, first, float(here.begins[0, 2]))
    for (t, speed), (after, _) in pairwise(times):
        s, v = after - t, speed + 1.2 * mp.cos(t)
        total += float(1.2 * mp.sin(t) * s + v * s * s / 2 - s**3 / 6)
    total += -1.2 * (np.cos(2.0 * np.pi + t0) - np.cos(float(times[-1][0])))
    assert here.quantity("mean(x)") == pytest.approx(total / (2.0 * np.pi), abs=1e-12)
    assert here.quantity("min(x)") == pytest.approx(-1.2, abs=1e-12)
    for name in ("mean(x)", "rms(v)", "sticking"):
        slopes = here.gradient(name)
        by_a = (orbit(1.2 + step, e).quantity(name) - orbit(1.2 - step, e).quantity(name)) / (
            2 * step
        )
        by_e = (orbit(1.2, e + step).quantity(name) - orbit(1.2, e - step).quantity(name)) / (
            2 * step
        )
        assert slopes["a"] == pytest.approx(by_a, abs=1e-6)
        assert slopes["e"] == pytest.approx(by_e, abs=1e-6)


def test_without_restitution_a_mass_rests_at_once(tmp_path: Path) -> None:
    orbit = cf.find_orbit(ball(tmp_path), {"a": 1.3, "e": 0.0})
    assert str(orbit.signature) == "chatter -> flight -> impact@table"
    assert orbit.quantity("sticking") == pytest.approx(
        float(orbit.ends[0, 0] - orbit.begins[0, 0]) / (2.0 * np.pi)
    )


def test_a_forced_oscillator_rests_at_its_stop_on_either_side_of_a_section() -> None:
    """Its mode has a section at v = 0, on which it rests."""
    p = {"w": 0.25, "e": 0.4, "d": 0.2}
    orbit = cf.find_orbit("impact", p)
    assert orbit.admissible and np.all(orbit.multipliers == 0.0)
    release = orbit.ends[[mode for mode, _ in orbit.itinerary].index("chatter")]
    assert np.cos(0.25 * release[0]) == pytest.approx(0.2, abs=1e-12)  # A cos(w t) = k d
    assert release[1:] == pytest.approx([0.2, 0.0], abs=1e-12)
    assert str(orbit.signature).startswith("chatter -> down")


def test_chatter_is_derived_where_a_simulation_meets_it() -> None:
    plain = cf.load_model("bouncing-ball")
    assert not plain.chatters
    assert cf.simulate(plain, {"a": 1.2, "e": 0.5}, periods=20).end is SimulationEnd.CHATTER
    resting = with_chatter(plain)
    assert resting is not None
    assert cf.simulate(resting, {"a": 1.2, "e": 0.5}, periods=20).end is SimulationEnd.TIME
    assert {d.name for d in resting.domains} == {d.name for d in plain.domains} | {"chatter"}
    assert check_model(resting).ok


@pytest.mark.parametrize(
    ("reset", "why"),
    [
        ("v: (1 + e)*a*cos(t) - e*v + 0.1", "moves a state that rests"),
        ("x: x + 0.1, v: (1 + e)*a*cos(t) - e*v", "takes states off the wall|moves a state"),
        ("v: v", "does not change the rate|rests|runs into"),
    ],
)
def test_what_is_no_impact_is_refused_in_one_line(reset: str, why: str, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=why) as error:
        ball(tmp_path, reset)
    assert "\n" not in str(error.value).strip()


GEAR = """
name: gear
states: [x, v]
parameters: {w: 0.5, A: 1.0, beta: 0.1, d: 0.5, e: 0.3}
constraints: [w > 0, e >= 0, e < 1]
period: 2*pi/w
surfaces: {right: {observable: x, level: d}, left: {observable: x, level: -d}}
modes: {free: {in: {right: -, left: +}, field: {x: v, v: A*cos(w*t) - beta*v}}}
resets: {right: {v: -e*v}, left: {v: -e*v}}
symmetry: x -> -x, v -> -v, t -> t + T/2
spread: {x: 0.5, v: 1}
"""


def test_a_pair_of_gears_rests_on_both_flanks(tmp_path: Path) -> None:
    orbit = cf.find_orbit(typed(tmp_path, GEAR), {})
    assert orbit.symmetric and orbit.admissible
    kinds = [mode for mode, _ in orbit.itinerary]
    assert sorted(kinds) == ["chatter_left", "chatter_right", "free", "free"]
    for (mode, _), end in zip(orbit.itinerary, orbit.ends, strict=True):
        if mode.startswith("chatter"):  # let go where the force changes its sign: cos(w t) = 0
            assert abs(np.cos(0.5 * end[0])) < 1e-12 and abs(end[2]) < 1e-13
    diagram = cf.explore(orbit, "w", (0.4, 0.6))
    assert [str(b.name) for b in diagram.branches] == [orbit.name]


def test_exponents_and_basins_of_chatter() -> None:
    model = with_chatter(cf.load_model("pounding"))
    assert model is not None
    params = {"w": 0.3, "e": 0.2, "d": 0.0, "F": 0.5}
    orbit = cf.find_orbit(model, params)
    found = cf.lyapunov_exponent(model, params, periods=300)
    moduli = np.sort(np.abs(orbit.multipliers))[::-1]
    assert found.exponents[:2] == pytest.approx(np.log(moduli[:2]) / orbit.period, abs=1e-9)
    assert np.all(np.isneginf(found.exponents[2:]))
    ball_ = with_chatter(cf.load_model("bouncing-ball"))
    assert ball_ is not None
    basins = cf.basins(ball_, {"x": [1.5, 2.0, 3.0], "v": [-1.0, 0.0, 1.0]}, {"a": 1.2, "e": 0.5})
    assert "1a, 2seg, 1imp 100.0%" in repr(basins)


def test_proofs_are_not_offered_for_chatter() -> None:
    orbit = cf.find_orbit("bouncing-ball", {"a": 1.2, "e": 0.5})
    with pytest.raises(ParameterError, match="infinitely many impacts"):
        orbit.certify()


CAPSULE = """
name: capsule
states: [z, w, q]
parameters: {Om: 3.0, d: 0.5, r: 0.6, g: 0.1}
period: 2*pi/Om
surfaces: {top: {observable: z, level: d}, bottom: {observable: z, level: -d}}
modes:
  free: {in: {top: -, bottom: +}, field: {z: w, w: cos(Om*t) - g - 0.05*w - 0.2*q, q: 0.6*w - 1.5*q}}
resets: {top: {w: -r*w, chatter: true}, bottom: {w: -r*w, chatter: true}}
spread: {z: 0.5, w: 1, q: 1}
"""


@pytest.mark.parametrize("seed", [0, 1, 4, 5, 6, 7, 13, 14])
def test_flights_between_two_walls_of_one_observable(seed: int, tmp_path: Path) -> None:
    model, draw = typed(tmp_path, CAPSULE), np.random.default_rng(seed)
    p = {"Om": float(draw.uniform(2.5, 3.2)), "g": float(draw.uniform(0.05, 0.25))}
    p["r"] = float(draw.uniform(0.1, 0.65))
    walk = cf.simulate(model, p, state=[0.1, 0.0, 0.0], periods=1000, events=10**6)
    assert walk.end is SimulationEnd.TIME
    period = 2.0 * np.pi / p["Om"]
    clock = walk.times + walk.cycles * period
    rests = [
        k for k, (mode, _) in enumerate(walk.itinerary) if mode.startswith("chatter") and k > 0
    ]
    assert rests and np.max(np.abs(walk.states[:, 0])) < 0.5 + 1e-12
    # a simulation that is cut in the flights of a chatter goes on in them
    soon = [
        k for k in rests if clock[k] - clock[k - 1] < 2.0 * period
    ]  # others are chaotic for long
    for k in soon[:8]:
        cut = clock[k - 1] + 0.02 * float(draw.uniform()) * (clock[k] - clock[k - 1])
        first = cf.simulate(model, p, state=[0.1, 0.0, 0.0], periods=cut / period, events=10**6)
        assert first.last[3].startswith("free")
        later = go_on(first, (clock[k] - cut) / period + 0.01)
        again = next(
            i for i, (mode, _) in enumerate(later.itinerary) if mode == walk.itinerary[k][0]
        )
        own = later.times[again] + later.cycles[again] * period
        assert own % period == pytest.approx(clock[k] % period, abs=1e-9)


FOLLOWER = """
name: follower
states: [x, v]
parameters: {{W: 1.0}}
period: 2*pi/W
surfaces: {{cam: {{observable: x - cos(W*t)}}}}
modes: {{off: {{in: {{cam: +}}, field: {{x: v, v: -{k}*x - {c}*v - {pre}}}}}}}
resets: {{cam: {{v: -(1 + {e})*W*sin(W*t) - {e}*v, chatter: true}}}}
spread: {{x: 2, v: 2}}
"""


@pytest.mark.parametrize("seed", range(4))
def test_where_flights_shrink_to_nothing_the_mass_rests_for_ever(seed: int, tmp_path: Path) -> None:
    draw = np.random.default_rng(seed)
    k, c = float(draw.uniform(0.1, 0.5)), float(draw.uniform(0.0, 0.2))
    pre, e = float(draw.uniform(0.4, 0.7)), float(draw.uniform(0.2, 0.5))
    phase = np.linspace(0.0, 2.0 * np.pi, 200_001)

    def pressed(w: float) -> float:  # the least force of a follower that stays on x = cos(w t)
        force = pre + (k - w * w) * np.cos(phase) - c * w * np.sin(phase)
        return float(force.min())

    leaves = brentq(pressed, 0.3, 2.0)
    orbit = cf.find_orbit(
        typed(tmp_path, FOLLOWER.format(k=k, c=c, pre=pre, e=e)),
        {"W": 1.05 * leaves},
        state=[1.1, 0.0],
    )
    for step in (
        0.01,
        0.0031,
        0.002,
    ):  # it ends there whatever its steps, and does not fold before it
        branch = cf.continue_orbit(orbit, "W", (0.5 * leaves, 1.06 * leaves), max_step=step)
        assert branch.ends[0].reason is EndReason.REST
        assert not [b for b in branch.bifurcations if b.kind is cf.Kind.SN]
        # the height of a flight falls with the square of the distance: at 1e-8 the place is known to 1e-4
        assert branch.values[0] == pytest.approx(leaves, rel=1e-4) and branch.values[0] > leaves


STOPPED = """
name: stopped{number}
states: [x, v]
parameters: {{w: 0.8, e: 0.5, d: 0.3, z: 0.05, b: 0.0}}
period: 2*pi/w
surfaces: {{stop: {{observable: x, level: d}}}}
field: {{x: v, v: -2*z*v - x + b + cos(w*t)}}
modes: {{flight: {{in: {{stop: -}}}}}}
resets: {{stop: {{v: -e*v{chatter}}}}}
"""


def test_impacts_that_do_not_come_to_rest_are_those_without_chatter(tmp_path: Path) -> None:
    """Event by event, to the first chatter; and that begins no later than where impacts go on to rest."""
    for number, chatter in enumerate(("", ", chatter: true")):
        text = STOPPED.format(number=number, chatter=chatter)
        (tmp_path / f"{number}.yaml").write_text(text, encoding="utf-8")
    draw, counted = np.random.default_rng(3), [0, 0]
    for _ in range(40):
        p = {
            "w": float(draw.uniform(0.15, 1.6)),
            "e": float(draw.uniform(0.1, 0.9)),
            "d": float(draw.uniform(0.0, 1.0)),
            "z": float(draw.uniform(0.0, 0.2)),
            "b": float(draw.uniform(-0.5, 1.0)),
        }
        start = [p["d"] - 0.2, float(draw.uniform(-1.0, 1.0))]
        plain, found = (
            cf.simulate(tmp_path / f"{number}.yaml", p, state=start, periods=60)
            for number in (0, 1)
        )
        times, expected = (
            [
                c * 2.0 * np.pi / p["w"] + t
                for c, t, surface in zip(s.cycles, s.times, s.exits, strict=True)
                if surface == "stop"
            ]
            for s in (found, plain)
        )
        modes = [mode for mode, surface in found.itinerary if surface in ("stop", "stop_lift")]
        rests = modes.index("chatter") if "chatter" in modes else len(times)
        counted["chatter" in modes] += 1
        assert times[:rests] == expected[:rests]
        if "chatter" not in modes:
            assert found.end is plain.end is SimulationEnd.TIME and len(times) == len(expected)
            continue
        bounced = [y[1] for y, s in zip(plain.states, plain.exits, strict=True) if s == "stop"]
        assert plain.end is SimulationEnd.CHATTER
        # all impacts from its first on are slower than twice the one before, until they are too short
        slow = bounced[max(rests - 1, 0) :]
        assert all(b < 2.0 * a for a, b in pairwise(slow) if a > 1e-6)
    assert min(counted) > 5
