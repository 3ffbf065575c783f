"""Cycles inside of one mode, and angles that rest where they are cut: against scipy and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from typed import typed

import contfric as cf

#: Van der Pol's oscillator, braked beyond a line.
BRAKED = """
name: braked
states: [x, v]
parameters: {{mu: {mu}, d: {d}, c: 1.0}}
autonomous: true
surfaces: {{brake: {{observable: "{a}*x + {b}*v", level: d, sliding: filippov}}}}
modes:
  free: {{in: {{brake: -}}, field: {{x: v, v: mu*(1 - x**2)*v - x}}}}
  brakes: {{in: {{brake: +}}, field: {{x: v, v: mu*(1 - x**2)*v - x - c*v}}}}
spread: {{x: 2, v: 2}}
"""


def highest(mu: float, a: float, b: float) -> tuple[float, float]:
    """Return the period of van der Pol's cycle and the largest a x + b v on it, by scipy."""

    def field(_, y):
        return [y[1], mu * (1 - y[0] ** 2) * y[1] - y[0]]

    def turns(_, y):
        return y[1]

    def peaks(_, y):
        return a * field(_, y)[0] + b * field(_, y)[1]

    turns.direction = peaks.direction = -1
    run = solve_ivp(
        field, (0, 200), [2.0, 0.0], "DOP853", events=(turns, peaks), rtol=1e-13, atol=1e-13
    )
    times, at = run.t_events[0], run.y_events[1][-3:]
    return times[-1] - times[-2], float(np.max(at @ [a, b]))


@pytest.mark.parametrize("seed", range(3))
def test_a_cycle_inside_of_one_mode_touches_the_surface_of_another(tmp_path, seed: int) -> None:
    """It needs no surface of its own, and the diagram is one from either side of the grazing."""
    draw = np.random.default_rng(seed)
    mu, (a, b) = round(draw.uniform(0.2, 0.9), 3), draw.uniform(0.3, 1.0, 2).round(3)
    period, top = highest(mu, a, b)
    model = typed(tmp_path, BRAKED.format(mu=mu, a=a, b=b, d=round(1.3 * top, 3)))
    orbit = cf.find_orbit(model)
    assert [exit_ for _, exit_ in orbit.itinerary] == ["section", "section"]
    assert orbit.period == pytest.approx(period, rel=1e-9)
    found = []
    for start in (orbit, cf.find_orbit(model, {"d": 0.9 * top})):
        diagram = cf.explore(start, "d", (0.8 * top, 1.5 * top))
        (graze,) = (b for b in diagram.bifurcations if b.kind.name == "GS")
        assert graze.params["d"] == pytest.approx(top, rel=1e-9)
        assert not diagram.loose_ends
        ends = [v for branch in diagram.branches for v in (branch.values[0], branch.values[-1])]
        assert (min(ends), max(ends)) == (0.8 * top, 1.5 * top)
        found.append(sorted((b.params["d"], b.kind.name) for b in diagram.bifurcations))
    assert [kind for _, kind in found[0]] == [kind for _, kind in found[1]]
    assert [d for d, _ in found[0]] == pytest.approx([d for d, _ in found[1]], rel=1e-9)


def test_a_cycle_within_a_sliding_surface_begins_to_leave_it(tmp_path) -> None:
    """Where |v| of the cycle exceeds the pull of the switch, a slide ends on both sides at once."""
    model = typed(
        tmp_path,
        """
name: held
states: [x, v, z]
parameters: {mu: 0.5, k: 3.0}
autonomous: true
surfaces: {s: {observable: z, sliding: filippov}}
modes:
  up: {in: {s: +}, field: {x: v, v: mu*(1 - x**2)*v - x, z: -k + v - z}}
  down: {in: {s: -}, field: {x: v, v: mu*(1 - x**2)*v - x, z: k + v - z}}
symmetry: x -> -x, v -> -v, z -> -z
""",
    )
    _, fastest = highest(0.5, 0.0, 1.0)
    for k in (3.0, 2.0):  # from a slide that never ends, and from the other side
        diagram = cf.explore(cf.find_orbit(model, {"k": k}), "k", (1.5, 3.5))
        assert not diagram.loose_ends
        assert {b.kind.name for b in diagram.bifurcations} == {"AS"}
        assert all(b.params["k"] == pytest.approx(fastest, rel=1e-9) for b in diagram.bifurcations)
        ends = [v for branch in diagram.branches for v in (branch.values[0], branch.values[-1])]
        assert min(ends) == 1.5 and max(ends) == 3.5


def test_a_hopf_cycle_may_lie_within_a_sliding_surface(tmp_path) -> None:
    """A cubic oscillator that a third state follows by sliding: x = 2 sqrt(mu) cos t to second order."""
    model = typed(
        tmp_path,
        """
name: slaved
states: [x, v, z]
parameters: {mu: -0.1, k: 3.0}
autonomous: true
surfaces: {s: {observable: z, sliding: filippov}}
modes:
  up: {in: {s: +}, field: {x: v, v: (mu - x**2)*v - x, z: -k + v - z}}
  down: {in: {s: -}, field: {x: v, v: (mu - x**2)*v - x, z: k + v - z}}
""",
    )
    (rest,) = [e for e in cf.find_equilibria(model) if e.admissible]
    (hopf,) = cf.continue_equilibrium(rest, "mu", (-0.5, 0.5)).events
    cycle = hopf.cycle(0.05)
    assert hopf.label == "H-" and {mode for mode, _ in cycle.itinerary} == {"slide", "slide-"}
    assert cycle.x_max == pytest.approx(2 * math.sqrt(cycle.params["mu"]), rel=1e-4)


@pytest.mark.parametrize("seed", range(3))
def test_a_hopf_cycle_needs_no_section(tmp_path, seed: int) -> None:
    """Of x' = mu x - w y - s x r^2 the cycle is a circle of radius sqrt(mu/s), until it meets the wall."""
    draw = np.random.default_rng(seed)
    w, s, wall = draw.uniform(0.7, 2.0), draw.uniform(0.5, 2.0), draw.uniform(0.6, 1.2)
    model = typed(
        tmp_path,
        f"""
name: normal_form
states: [x, y]
parameters: {{mu: -0.1, w: {w}, s: {s}, wall: {wall}}}
autonomous: true
define: {{r2: x**2 + y**2}}
surfaces: {{wall: {{observable: x + y, level: wall}}}}
modes:
  inner: {{in: {{wall: -}}, field: {{x: mu*x - w*y - s*x*r2, y: w*x + mu*y - s*y*r2}}}}
  outer: {{in: {{wall: +}}, field: {{x: mu*x - w*y - s*x*r2 + wall - x - y, y: w*x + mu*y - s*y*r2}}}}
""",
    )
    (rest,) = [e for e in cf.find_equilibria(model) if e.admissible]
    (hopf,) = cf.continue_equilibrium(rest, "mu", (-1.0, 1.0)).events
    assert hopf.label == "H-"
    cycle = hopf.cycle()
    radius = np.hypot(*cycle.joints[:, 1:].T)
    assert radius == pytest.approx(math.sqrt(cycle.params["mu"] / s), rel=1e-9)
    touch = s * wall**2 / 2  # the circle reaches x + y = wall
    diagram = cf.explore(cycle, "mu", (-1.0, 1.1 * touch))
    assert [b.params["mu"] for b in diagram.bifurcations] == pytest.approx([touch], rel=1e-9)
    assert not diagram.loose_ends


def test_a_coefficient_that_vanishes_with_the_parameter_has_no_sign(tmp_path) -> None:
    """All cycles of the linear oscillator at mu = 0: rounding made one of the two sorts of them."""
    model = typed(tmp_path, BRAKED.format(mu=-0.5, a=1.0, b=0.0, d=3.0))
    (rest,) = [e for e in cf.find_equilibria(model) if e.admissible]
    (hopf,) = cf.continue_equilibrium(rest, "mu", (-1.0, 1.0)).events
    assert hopf.label == "H0" and hopf.lyapunov == 0.0
    with pytest.raises(cf.ConvergenceError, match="Lyapunov coefficient is 0"):
        hopf.cycle()


@pytest.mark.parametrize("g", [0.2, 0.5, 0.9])
def test_a_kicked_rotor_rests_where_its_angle_was_cut(tmp_path, g: float) -> None:
    """At theta = pi kicks of K sin(theta) do nothing; trace and determinant tell where it doubles."""
    model = typed(
        tmp_path,
        f"""
name: kicked
states: [th, p]
parameters: {{K: 2.5, g: {g}, Ts: 1.0}}
period: Ts
angles: [th]
field: {{th: p, p: -g*p}}
resets: {{tick: {{p: p + K*sin(th)}}}}
spread: {{th: 3, p: 4}}
""",
    )
    orbit = cf.find_orbit(model, state=(2.9, 0.1))
    assert str(orbit.signature) == "smooth -> reset@tick" and orbit.stable
    assert abs(math.remainder(orbit.joints[0, 1] - math.pi, math.tau)) < 1e-12
    left, drift = math.exp(-g), (1 - math.exp(-g)) / g
    kick = 2 * (1 + left) / drift
    assert np.prod(orbit.multipliers).real == pytest.approx(left, rel=1e-10)
    assert np.sum(orbit.multipliers).real == pytest.approx(1 + left - 2.5 * drift, rel=1e-10)
    branch = cf.continue_orbit(orbit, "K", (2.0, 1.1 * kick))
    (doubling,) = branch.bifurcations
    assert doubling.kind.name == "PD" and doubling.params["K"] == pytest.approx(kick, rel=1e-11)
    assert [end.reason.name for end in branch.ends] == ["RANGE", "RANGE"]


def firing(tau: float, b: float, at: tuple[float, float], turns: int) -> float:
    """Return the period of Wilson and Cowan's populations with Heaviside rates, by exponentials."""
    heights = ([1.0, -b, 0.05], [1.0, -0.25, -0.3])
    y, when = np.array(at), []
    sides = [bool(h[:2] @ y + h[2] > 0) for h in map(np.array, heights)]
    time = 0.0
    for _ in range(4 * turns):
        goal = np.array(sides, dtype=float)

        def above(t, h, y=y, goal=goal):
            """Return the height over a surface a time later."""
            decay = np.exp(-np.divide.outer(t, [1.0, tau]))
            return (goal + (y - goal) * decay) @ h[:2] + h[2]

        hits = []
        grid = np.geomspace(1e-9, 10.0, 400)
        for k, h in enumerate(map(np.array, heights)):
            for i in np.flatnonzero(np.diff(np.sign(above(grid, h))))[:1]:
                hits.append((brentq(above, *grid[i : i + 2], args=(h,), xtol=1e-15), k))
        lasts, k = min(hits)
        y = goal + (y - goal) * np.exp([-lasts, -lasts / tau])
        time += lasts
        sides[k] = not sides[k]
        if k == 0 and sides[0]:
            when.append(time)
    return when[-1] - when[-2]


@pytest.mark.parametrize(("tau", "b"), [(0.6, 2.0), (0.75, 2.2), (0.9, 1.8)])
def test_what_drives_off_its_surface_is_crossed_by_what_slides_on_another(tmp_path, tau, b) -> None:
    """A population that excites itself never slides; where the other one slides, the two may cross."""
    model = typed(
        tmp_path,
        f"""
name: populations
states: [u, v]
parameters: {{a: 1.0, b: {b}, c: 1.0, d: 0.25, th1: -0.05, th2: 0.3, tau: {tau}}}
autonomous: true
observables: {{e: a*u - b*v - th1, i: c*u - d*v - th2}}
surfaces:
  E: {{observable: e, sliding: filippov}}
  I: {{observable: i, sliding: filippov}}
modes:
  on_on: {{in: {{E: +, I: +}}, field: {{u: -u + 1, v: (-v + 1)/tau}}}}
  on_off: {{in: {{E: +, I: -}}, field: {{u: -u + 1, v: -v/tau}}}}
  off_on: {{in: {{E: -, I: +}}, field: {{u: -u, v: (-v + 1)/tau}}}}
  off_off: {{in: {{E: -, I: -}}, field: {{u: -u, v: -v/tau}}}}
""",
    )
    assert {mode.name for mode in model.modes if mode.sliding} == {
        "slide_I_on_on_on_off",
        "slide_I_off_on_off_off",
    }
    orbit = cf.find_orbit(model, state=(0.4, 0.2))
    assert len(orbit.itinerary) == 4
    assert orbit.period == pytest.approx(firing(tau, b, (0.4, 0.2), 600), rel=1e-9)
