"""Hybrid systems of the textbooks, typed by their equations, against closed forms and other programs.

Resets to other places, through a surface and to other modes; modes with memory; clocks; angles; sliding that
is derived. References are closed forms next to each test, or scipy's integrator along the equations
as they are written here.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from by_scipy import after, misses
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq, fsolve

import contfric as cf


@cache
def diagram(model: str, parameter: str, low: float, high: float, *params, state=None, time=0.0):
    orbit = cf.find_orbit(model, dict(params), state=state, time=time)
    return cf.explore(orbit, parameter, (low, high), max_periods=2)


def exponential(matrix: np.ndarray):
    """exp(matrix t) as a function of t, by eigenvalues: a hundredth of the time of scipy's expm."""
    rates, vectors = np.linalg.eig(matrix)
    inverse = np.linalg.inv(vectors)
    return lambda t: ((vectors * np.exp(rates * t)) @ inverse).real


def values(found: cf.Diagram, kind: str) -> list[float]:
    events = [e.bifurcation for e in found.events if e.bifurcation.kind.value == kind]
    return sorted(b.params[found.parameter] for b in events)


def closes(orbit: cf.Orbit, fields: dict, within: float = 1e-8) -> None:
    """Each segment, along the equations of its mode by scipy, ends at the next joint."""
    assert orbit.converged and orbit.admissible
    assert misses(orbit.as_whole(), fields.__getitem__) < within


# ----------------------------------------------------------------------- resets to another place


def test_rimless_wheel() -> None:
    """Energy of a step: w-^2 = w+^2 + 4 sin(alpha) sin(slope), and w+ = cos(2 alpha) w-."""
    alpha = 0.3
    found = diagram("rimless-wheel", "slope", 0.001, 0.25)
    (branch,) = found.branches
    for orbit in list(branch)[::20]:
        slope = orbit.params["slope"]
        arrives = math.sqrt(4 * math.sin(alpha) * math.sin(slope) / (1 - math.cos(2 * alpha) ** 2))
        grown = math.exp(orbit.period)  # what an error becomes upright
        assert orbit.ends[0, 2] == pytest.approx(arrives, rel=1e-12 * grown)
        exact = math.cos(2 * alpha) ** 2
        assert orbit.multipliers[0].real == pytest.approx(exact, rel=1e-12 * grown)
        leaves = math.cos(2 * alpha) * arrives

        def speed(theta, leaves=leaves, slope=slope):
            return 1 / math.sqrt(leaves**2 + 2 * (math.cos(slope - alpha) - math.cos(theta)))

        upright = leaves**2 - 2 * (1 - math.cos(slope - alpha))
        if upright > 0.01:  # far from the rest upright, where steps take for ever
            lasts, _ = quad(speed, slope - alpha, slope + alpha, epsabs=1e-12)
            assert orbit.period == pytest.approx(lasts, rel=1e-9)


def test_rimless_wheel_stops_where_it_cannot_pass_upright() -> None:
    alpha = 0.3

    def spare(slope: float) -> float:
        arrives = 4 * math.sin(alpha) * math.sin(slope) / (1 - math.cos(2 * alpha) ** 2)
        return math.cos(2 * alpha) ** 2 * arrives - 2 * (1 - math.cos(slope - alpha))

    (branch,) = diagram("rimless-wheel", "slope", 0.001, 0.25).branches
    assert min(branch.values) == pytest.approx(brentq(spare, 1e-3, 0.2), abs=1e-6)
    assert cf.EndReason.PERIOD in {end.reason for end in branch.ends}


def test_integrate_and_fire_locks_between_two_folds() -> None:
    """One firing a period at phase phi: I = 1 / (1 - e^-T) - A cos(phi - atan W) / sqrt(1 + W^2)."""
    A, W = 0.3, 4.0
    middle = 1 / (1 - math.exp(-2 * math.pi / W))
    half = A / math.hypot(1, W)
    folds = values(diagram("integrate-and-fire", "I", 1.0, 1.6), "SN")
    assert folds == pytest.approx([middle - half, middle + half], abs=1e-9)


def test_bouncing_ball_folds_and_doubles() -> None:
    """A bounce a period: a cos = pi (1 - e) / (1 + e); it doubles at a sin = 2 (1 + e^2) / (1 + e)^2."""
    for e in (0.6, 0.8):
        fold = math.pi * (1 - e) / (1 + e)
        doubles = math.hypot(fold, 2 * (1 + e**2) / (1 + e) ** 2)
        a = 0.5 * (fold + doubles)
        phase = math.acos(fold / a)
        found = diagram(
            "bouncing-ball",
            "a",
            0.9 * fold,
            1.02 * doubles,
            *(("a", a), ("e", e)),
            state=(a * math.sin(phase) + 1e-9, math.pi),
            time=phase,
        )
        assert values(found, "SN")[0] == pytest.approx(fold, abs=1e-9)
        assert min(values(found, "PD")) == pytest.approx(doubles, abs=1e-9)


# ---------------------------------------------------------------------------- through a surface


def test_rocking_block() -> None:
    """Half a period of the symmetric orbit by exponentials; an impact scales areas by r^2."""
    a, W, r = 0.4, 2.0, 0.85
    orbit = cf.find_orbit("rocking-block", {"a": a, "W": W, "r": r})
    assert np.prod(orbit.multipliers).real == pytest.approx(r**4, rel=1e-9)
    force = a / (1 + W**2)  # theta = 1 + force cos(W t) + p cosh + q sinh

    def gap(z):
        t0, rate = z
        p = -1 - force * math.cos(W * t0)
        q = rate + W * force * math.sin(W * t0)
        tau = math.pi / W
        ends = 1 - force * math.cos(W * t0) + p * math.cosh(tau) + q * math.sinh(tau)
        leaves = W * force * math.sin(W * t0) + p * math.sinh(tau) + q * math.cosh(tau)
        return [ends, r * leaves + rate]

    right = next(i for i, (mode, _) in enumerate(orbit.as_whole().itinerary) if mode == "right")
    begin = orbit.as_whole().begins[right]
    solved = fsolve(gap, [begin[0], begin[2]], xtol=1e-13)
    assert begin[2] == pytest.approx(solved[1], abs=1e-10)
    assert math.remainder(begin[0] - solved[0], 2 * math.pi / W) == pytest.approx(0, abs=1e-10)


# ------------------------------------------------------------------------------ modes with memory


def test_thermostat_period() -> None:
    """tau log((o + H - l) / (o + H - h)) to heat, tau log((h - o) / (l - o)) to cool."""
    (branch,) = diagram("thermostat", "outside", 2.0, 18.0).branches
    for orbit in list(branch)[::10]:
        out, heat, tau, low, high = (
            orbit.params[name] for name in ("outside", "heat", "tau", "low", "high")
        )
        heats = math.log((out + heat - low) / (out + heat - high))
        cools = math.log((high - out) / (low - out))
        assert orbit.period == pytest.approx(tau * (heats + cools), rel=1e-12)
        assert orbit.stable
        assert orbit.signature.segments == ("heating:temp0", "idle:temp0")


@pytest.mark.parametrize("h", [0.02, 0.2, 1.1])
def test_relay_with_hysteresis(h: float) -> None:
    zeta, K = 0.3, 1.0
    passed = exponential(np.array([[0.0, 1.0], [-1.0, -2 * zeta]]))

    def half(v: float) -> tuple[float, float]:
        start = np.array([-h - K, v])  # just switched on, at -h, on its way back

        def place(t: float) -> float:
            return float((passed(t) @ start)[0] + K - h)

        times = np.linspace(1e-3, 12.0, 4000)
        first = next(i for i, t in enumerate(times) if place(t) > 0)
        ends = brentq(place, times[first - 1], times[first], xtol=1e-14)
        return ends, -float((passed(ends) @ start)[1])

    v = brentq(lambda v: half(v)[1] - v, -3.0, -1e-3, xtol=1e-13)
    orbit = cf.find_orbit("relay", {"h": h}, state=[-0.5, -3.0])
    assert orbit.period == pytest.approx(2 * half(v)[0], rel=1e-10)
    slope = (half(v + 1e-5)[1] - half(v - 1e-5)[1]) / 2e-5
    assert orbit.multipliers[0].real == pytest.approx(slope**2, rel=1e-5)


def test_the_mode_is_part_of_the_state() -> None:
    """From one state between the levels motion goes on as the mode says in which it starts."""
    up, down = (
        cf.simulate("relay", state=[0.0, 0.0], domain=d, events=1) for d in ("up:x0", "down:x0")
    )
    assert up.states[0, 0] == pytest.approx(0.2) and down.states[0, 0] == pytest.approx(-0.2)


# ----------------------------------------------------------------------------------------- clocks


def buck_map(E: float, p: dict[str, float]):
    """The state a period of the ramp later, by matrix exponentials; the switch is sought on a fine grid."""
    R, L, C, gain, ref, low, high, T = (
        p[n] for n in ("R", "L", "C", "gain", "ref", "low", "high", "Ts")
    )
    passed = exponential(np.array([[-1 / (R * C), 1 / C], [-1 / L, 0.0]]))
    rests = {True: np.array([E, E / R]), False: np.zeros(2)}

    def after(y, on, t):
        return rests[on] + passed(t) @ (y - rests[on])

    def excess(y, t):
        return gain * (y[0] - ref) - low - (high - low) * t / T

    def step(y):
        t, on = 0.0, excess(y, 0.0) < 0
        while True:
            grid = np.linspace(t, T, 60)[1:]
            flips = [s for s in grid if (excess(after(y, on, s - t), s) < 0) != on]
            if not flips:
                return after(y, on, T - t)
            left = flips[0] - (grid[1] - grid[0])
            root = brentq(
                lambda s, y=y, on=on, t=t: excess(after(y, on, s - t), s),
                left,
                flips[0],
                xtol=1e-18,
            )
            y, t, on = after(y, on, root - t), root, not on

    return step


@pytest.mark.parametrize(("turns", "low", "high"), [(1, 24.0, 25.0), (2, 31.0, 31.3)])
def test_buck_converter_doubles(turns: int, low: float, high: float) -> None:
    p = cf.load_model("buck").defaults
    found = diagram("buck", "E", 15.0, 32.0)

    def critical(E: float) -> float:
        """det(M + 1) of the orbit of so many periods of the ramp."""
        step = buck_map(E, p)

        def several(y):
            for _ in range(turns):
                y = step(y)
            return y

        def slopes(y):
            h = np.diag([1e-5, 1e-6])
            return np.array([(several(y + d) - several(y - d)) / (2 * np.max(d)) for d in h]).T

        branch = next(b for b in found.branches if b[0].signature.resets == turns)
        near = min(branch, key=lambda o: abs(o.params["E"] - E))
        i = next(k for k, (_, exit_) in enumerate(near.itinerary) if exit_ == "tick")
        y = near.ends[i, 1:3].copy()
        for _ in range(8):
            y = y - np.linalg.solve(slopes(y) - np.eye(2), several(y) - y)
        return float(np.linalg.det(slopes(y) + np.eye(2)))

    at = brentq(critical, low, high, xtol=1e-6)
    assert min(abs(v - at) for v in values(found, "PD")) < 2e-5  # slopes are differences


# ----------------------------------------------------------------------------------------- angles


def test_a_pendulum_rotates_and_oscillates() -> None:
    p = {"W": 0.67, "c": 0.3, "mu": 0.1}

    def fields(A):
        def field(sign):
            def rates(t, y):
                torque = A * math.cos(p["W"] * t) - math.sin(y[0]) - p["c"] * y[1]
                return [y[1], torque - sign * p["mu"] if sign else 0.0]

            return rates

        return {"forward": field(1), "backward": field(-1), "slide": field(0)}

    oscillates, turns = (cf.find_orbit("pendulum", {**p, "A": A}) for A in (0.5, 1.5))
    closes(oscillates, fields(0.5))
    closes(turns, fields(1.5))
    assert oscillates.signature.resets == 0 < turns.signature.resets
    for i, (_, exit_) in enumerate(turns.itinerary):  # after a joint at pi it goes on at -pi
        if exit_ == "theta+":
            assert turns.ends[i, 1] == pytest.approx(math.pi, abs=1e-12)
            assert turns.begins[(i + 1) % len(turns.itinerary), 1] == pytest.approx(
                -math.pi, abs=1e-12
            )


# -------------------------------------------------------------------------------- derived sliding


@pytest.mark.slow
def test_derived_sliding_is_that_of_dry_friction(tmp_path) -> None:
    path = tmp_path / "derived.yaml"
    path.write_text(
        "name: derived\nstates: [x, v]\nparameters: {Omega: 0.47, S: 0.3}\nperiod: 2*pi/Omega\nsurfaces: "
        "{v: {observable: v, sliding: filippov}}\nfield: {x: v, v: cos(Omega*t) - x - S*sign(v)}\nmodes: "
        "{forward: {in: {v: +}}, backward: {in: {v: -}}}\nspread: {x: 2, v: 1}\n",
        encoding="utf-8",
    )
    for S in (0.2, 0.3, 0.4):
        orbit = cf.find_orbit(path, {"S": S})
        typed = cf.find_orbit("coulomb", {"Omega": 0.47, "S": S, "S0": S})
        assert orbit.x_max == pytest.approx(typed.x_max, abs=1e-9)
        assert orbit.signature.stops == typed.as_whole().signature.stops
    assert cf.check_model(path).ok


def test_relay_feedback_slides() -> None:
    """On x = 0 the relay's mean is u = y / k: y' = z - 2 sigma rho y, z' = -rho^2 y."""
    model = cf.load_model("relay-sliding")
    p = model.defaults
    flow = model.view(model.vector({}))
    rng = np.random.default_rng(1)
    for y, z in rng.uniform(-0.9, 0.9, (20, 2)):
        rates = flow.jacobian("slide", 0.0, np.array([0.0, y, z]), 0.0)[:, 4]
        wanted = [0.0, z - 2 * p["sigma"] * p["rho"] * y, -(p["rho"] ** 2) * y]
        assert np.allclose(rates, wanted, atol=1e-12)

    def field(sign):
        def rates(t, s):
            x, y, z = s
            w, zeta, lam, k = p["w"], p["zeta"], p["lam"], p["k"]
            u = sign if sign else y / k
            return [
                -(2 * zeta * w + lam) * x + y - k * u,
                -(2 * zeta * w * lam + w**2) * x + z - 2 * k * p["sigma"] * p["rho"] * u,
                -lam * w**2 * x - k * p["rho"] ** 2 * u,
            ]

        return rates

    closes(cf.find_orbit(model), {"plus": field(1), "minus": field(-1), "slide": field(0)})


@pytest.mark.slow
def test_normal_force() -> None:
    p = {"W": 0.5, "mu": 0.3, "n": 0.4, "phi": 1.0}

    def field(sign):
        def rates(t, y):
            friction = p["mu"] * (1 + p["n"] * math.cos(p["W"] * t + p["phi"]))
            return [y[1], math.cos(p["W"] * t) - y[0] - sign * friction] if sign else [0.0, 0.0]

        return rates

    orbit = cf.find_orbit("normal-force", p)
    closes(orbit, {"forward": field(1), "backward": field(-1), "slide": field(0)})
    for i, (mode, _) in enumerate(orbit.itinerary):
        if mode != "slide":
            continue
        t, x, _ = orbit.ends[i]  # it is released where the load is the friction
        friction = p["mu"] * (1 + p["n"] * math.cos(p["W"] * t + p["phi"]))
        assert abs(math.cos(p["W"] * t) - x) == pytest.approx(friction, abs=1e-11)


# ---------------------------------------------------------------- out of a slide, through a surface


@pytest.mark.slow
def test_jenkins_element() -> None:
    p = cf.load_model("jenkins").defaults

    def field(slips):
        def rates(t, y):
            x, v, z = y
            pull = p["F"] * math.cos(p["W"] * t) - 2 * p["zeta"] * v - p["k"] * x - p["kt"] * z
            return [v, pull, 0.0 if slips else v]

        return rates

    fields = {m: field(m.startswith("slip")) for m in ("stick+", "stick-", "slip+", "slip-")}
    orbit = cf.find_orbit("jenkins")
    assert {mode for mode, _ in orbit.as_whole().itinerary} == {
        "stick+",
        "slip+",
        "slip-",
    }  # sticks are one
    closes(orbit, fields)


def test_gear_pair_parts_at_a_grazing() -> None:
    """The driven gears are linear; they part where the least displacement is that of the contact."""
    found = diagram("gear-pair", "W", 0.8, 1.5)
    p = cf.load_model("gear-pair").defaults

    def least(W: float) -> float:
        def rates(t, y):
            mesh = 1 + p["kappa"] * math.cos(W * t)
            return [y[1], p["load"] - 2 * p["zeta"] * y[1] - mesh * (y[0] - 1)]

        T = 2 * math.pi / W

        def end(y):
            return after(rates, y, (0, T))

        at = end(np.zeros(2))
        jac = np.array([end(row) - at for row in np.eye(2)]).T  # affine: exact
        start = np.linalg.solve(np.eye(2) - jac, at)
        way = solve_ivp(
            rates,
            (0, T),
            start,
            method="DOP853",
            rtol=1e-12,
            atol=1e-13,
            events=lambda t, y: y[1],
        )
        return min(y[0] for y in way.y_events[0]) - 1

    grazings = values(found, "GS")
    at = brentq(least, 1.0, 1.2, xtol=1e-9)
    assert min(abs(v - at) for v in grazings) < 1e-7


# ---------------------------------------------------------------------------- legs change roles


def test_compass_gait() -> None:
    """Segments by scipy, the strike by angular momentum, the time of a step as published (0.734 s)."""
    model = cf.load_model("compass-gait")
    p = model.defaults
    a, b, m, mH, g = (p[n] for n in ("a", "b", "m", "mH", "g"))
    length = a + b

    def rates(t, y):
        ns, s, wns, ws = y
        c, sine = math.cos(s - ns), math.sin(s - ns)
        inertia = np.array(
            [
                [m * b**2, -m * length * b * c],
                [-m * length * b * c, mH * length**2 + m * (length**2 + a**2)],
            ]
        )
        spin = m * length * b * sine
        push = [-spin * ws**2 - m * b * g * math.sin(ns)]
        push += [spin * wns**2 + (mH * length + m * (a + length)) * g * math.sin(s)]
        return [wns, ws, *np.linalg.solve(inertia, push)]

    def momenta(hip, foot, legs, rates_of_legs):
        """Of all about the foot that stands, and of the leg that swings about the hip."""
        (th_st, th_sw), (w_st, w_sw) = legs, rates_of_legs

        def place(angle, rate, r):  # of a point at a distance r up the leg that stands
            return (
                np.array([-r * math.sin(angle), r * math.cos(angle)]),
                rate * np.array([-r * math.cos(angle), -r * math.sin(angle)]),
            )

        stands, v_stands = place(th_st, w_st, a)
        top, v_top = place(th_st, w_st, length)
        back, v_back = place(th_sw, w_sw, b)
        swings, v_swings = top - back, v_top - v_back

        def moment(x, v, mass, about):
            r = x - about
            return mass * (r[0] * v[1] - r[1] * v[0])

        whole = sum(
            moment(x, v, mass, foot)
            for x, v, mass in ((stands, v_stands, m), (top, v_top, mH), (swings, v_swings, m))
        )
        return (
            whole,
            moment(swings, v_swings, m, top if hip else foot),
            (stands, v_stands, top, v_top),
        )

    orbit = cf.find_orbit(model, state=[-0.2942, 0.1894, 0.2146, -1.0506])
    closes(orbit, {"early": rates, "scuff": rates, "late": rates})
    assert orbit.period == pytest.approx(0.734, abs=5e-4)
    i = next(k for k, (_, exit_) in enumerate(orbit.itinerary) if exit_ == "strike")
    ns, s, wns, ws = orbit.ends[i, 1:]
    after = orbit.begins[(i + 1) % len(orbit.itinerary), 1:]
    assert after[:2] == pytest.approx([s, ns], abs=1e-14)
    # about the foot that strikes: at the end of the swing leg, seen from the one that stood
    struck = np.array(
        [
            -length * math.sin(s) + length * math.sin(ns),
            length * math.cos(s) - length * math.cos(ns),
        ]
    )
    whole, _, (leg, v_leg, top, _) = momenta(False, struck, (s, ns), (ws, wns))
    r = leg - top
    leaves = m * (r[0] * v_leg[1] - r[1] * v_leg[0])
    again, swings, _ = momenta(True, np.zeros(2), (after[1], after[0]), (after[3], after[2]))
    assert again == pytest.approx(whole, rel=1e-10)
    assert swings == pytest.approx(leaves, rel=1e-10)


def test_compass_gait_doubles() -> None:
    """The published cascade begins at about 4.4 degrees."""
    found = diagram("compass-gait", "slope", 0.05, 0.08, state=(-0.2942, 0.1894, 0.2146, -1.0506))
    (doubles,) = values(found, "PD")
    assert math.degrees(doubles) == pytest.approx(4.4, abs=0.05)
