"""Equilibria, their branches and events against closed forms, scipy, and cycles that are solved for."""

from __future__ import annotations

import math

import numpy as np
import pytest
import yaml
from scipy.optimize import brentq, fsolve

import contfric as cf
from contfric.models.reading.files import from_data


def typed(text: str) -> cf.Model:
    return from_data({"autonomous": True, **yaml.safe_load(text)})


BLOCK = """
name: block
states: [x, v]
parameters: {S: 0.3, S0: 0.4}
surfaces:
  v: {observable: v, level: 0}
  F+: {observable: x, level: S0}
  F-: {observable: x, level: -S0}
field: {x: v, v: -x - S*sign(v)}
modes:
  forward: {in: {v: "+"}}
  backward: {in: {v: "-"}}
  stick: {in: {v: 0, F+: "-", F-: "+"}, field: {x: 0, v: 0}}
"""

FOCUS = """
name: focus
states: [x, y]
parameters: {mu: 0.5, a: 0.2, c: 1.0}
surfaces: {y: {observable: y, level: 0, sliding: filippov}}
modes:
  focus: {in: {y: "+"}, field: {x: a*x - (y - mu), y: x + a*(y - mu)}}
  push: {in: {y: "-"}, field: {x: c, y: 1}}
"""

DAMPED_BELT = """
name: damped-belt
states: [x, v]
parameters: {c: 0.5, vb: 0.5, Fs: 1.0, delta: 3.0}
constraints: [vb > 0]
define: {friction: Fs/(1 + delta*abs(v - vb))*sign(v - vb)}
observables: {load: x + c*vb}
surfaces:
  belt: {observable: v, level: vb}
  stop: {observable: v, level: 0}
  load+: {observable: load, level: Fs}
  load-: {observable: load, level: -Fs}
field: {x: v, v: -x - c*v - friction}
modes:
  ahead: {in: {belt: "+"}}
  rise: {in: {belt: "-", stop: "+"}}
  fall: {in: {stop: "-"}}
  stick: {in: {belt: 0, load+: "-", load-: "+"}, field: {x: vb, v: 0}}
"""


def smooth(name: str, states: str, parameters: str, section: str, field: str) -> cf.Model:
    """A smooth model with a section, so that its cycles are orbits."""
    return typed(
        f"name: {name}\nstates: [{states}]\nparameters: {{{parameters}}}\nobservables: {{cut: "
        f"{section}}}\nsurfaces: {{cut: {{observable: cut, level: 0}}}}\nfield: {{{field}}}\n"
        'modes: {up: {in: {cut: "+"}}, down: {in: {cut: "-"}}}\n'
    )


# ------------------------------------------------------------------------------------ finding


def test_rest_of_a_block_on_a_belt() -> None:
    """The spring carries the friction at the speed of the belt: x = Fs / (1 + delta vb)."""
    for vb in (0.05, 0.3, 2.0):
        found = cf.find_equilibria("belt", {"vb": vb, "Fs": 0.7, "delta": 2.0})
        (rest,) = found
        assert np.allclose(rest.state, [0.7 / (1 + 2.0 * vb), 0.0], rtol=0, atol=1e-14)
        slope = 0.7 * 2.0 / (1 + 2.0 * vb) ** 2  # friction that falls is negative damping
        exact = np.roots([1.0, -slope, 1.0])
        assert np.allclose(np.sort_complex(rest.eigenvalues), np.sort_complex(exact), atol=1e-13)
        assert rest.stable is False
        assert [e.mode for e in found.virtual] == ["ahead"]


def test_bristles_rest_as_the_law_of_steady_sliding_says() -> None:
    params = {"vb": 0.3, "sigma0": 200.0, "sigma1": 2.0}
    (rest,) = cf.find_equilibria("belt-lugre", params)
    g = 1.0 / (1 + 3.0 * 0.3)
    assert np.allclose(rest.state, [g, 0.0, -g / 200.0], rtol=1e-12, atol=1e-15)


def test_a_mass_that_sticks_rests_anywhere_within_its_limits() -> None:
    found = cf.find_equilibria(typed(BLOCK))
    assert not list(found)
    (rest,) = found.sets
    assert rest.dimension == 1 and rest.pseudo and found.complete["stick"]
    ends = {surface: state.tolist() for surface, state in rest.ends}
    assert ends == {"F+": pytest.approx([0.4, 0.0]), "F-": pytest.approx([-0.4, 0.0])}
    assert not found.points  # where slides would rest is inside of that set


def test_two_masses_that_stick_rest_in_a_plane() -> None:
    model = typed(
        """
name: blocks
states: [x, y]
parameters: {S: 1.0}
observables: {one: x - 2*y, two: y + 3}
surfaces:
  a: {observable: one, level: S}
  b: {observable: one, level: -S}
  c: {observable: two, level: S}
  d: {observable: two, level: -S}
modes:
  rest: {in: {a: "-", b: "+", c: "-", d: "+"}, field: {x: 0, y: 0}}
  else1: {in: {a: "+"}, field: {x: -1, y: 0}}
  else2: {in: {b: "-"}, field: {x: 1, y: 0}}
  else3: {in: {a: "-", b: "+", c: "+"}, field: {x: 0, y: -1}}
  else4: {in: {a: "-", b: "+", d: "-"}, field: {x: 0, y: 1}}
"""
    )
    (rest,) = cf.find_equilibria(model).sets
    assert rest.dimension == 2
    assert np.allclose(rest.state[1], -3.0, atol=0.99) and abs(rest.state @ [1, -2]) < 1.0


def test_equilibria_along_a_curve_end_where_it_leaves_the_region() -> None:
    """x' = 0 wherever z = x^2: the parabola is cut by the surface at z = 1, that is at x = +-1."""
    model = typed(
        """
name: parabola
states: [x, z]
parameters: {S: 1.0}
surfaces: {top: {observable: z, level: S}}
modes:
  below: {in: {top: "-"}, field: {x: (x - 2)*(z - x**2), z: x**2 - z}}
  above: {in: {top: "+"}, field: {x: 0, z: -1}}
"""
    )
    (rest,) = cf.find_equilibria(model, starts=30).sets
    ends = sorted(state[0] for _, state in rest.ends)
    assert ends == pytest.approx([-1.0, 1.0], abs=1e-9)
    assert rest.eigenvalues.shape == (1,)


def test_sliding_rests_with_the_zeros_of_the_plant() -> None:
    """On the switching surface of a relay the state obeys the plant's zeros: s^2 + 2 sigma rho s + rho^2."""
    for sigma, rho in ((-1.0, 1.0), (0.5, 2.0), (0.2, 0.7)):
        params = {"sigma": sigma, "rho": rho}
        (rest,) = cf.find_equilibria("relay-sliding", params)
        assert rest.pseudo and rest.mode == "slide" and np.allclose(rest.state, 0.0, atol=1e-15)
        exact = np.sort_complex(np.roots([1.0, 2 * sigma * rho, rho**2]))
        # a double eigenvalue is known to the root of rounding only
        assert np.allclose(np.sort_complex(rest.eigenvalues), exact, atol=1e-7)
        assert rest.stable is (sigma > 0)


def test_all_equilibria_of_a_cubic_are_found() -> None:
    model = smooth("cubic", "x, v", "h: 0.1", "v", "x: v, v: -0.1*v + x - x**3 + h")
    found = cf.find_equilibria(model)
    exact = np.sort(np.roots([-1.0, 0.0, 1.0, 0.1]).real)
    assert np.allclose([e.state[0] for e in found], exact, atol=1e-13)
    assert found.complete == {"up": False}
    assert [e.stable for e in found] == [True, False, True]


def test_equilibria_agree_with_scipy_and_numpy() -> None:
    model = smooth(
        "wild", "x, y, z", "p: 0.3", "x", "x: y - sin(z) + p, y: x*y - 0.5 - y, z: tanh(x) - z"
    )

    def field(u):
        x, y, z = u
        return [y - math.sin(z) + 0.3, x * y - 0.5 - y, math.tanh(x) - z]

    found = list(cf.find_equilibria(model))
    assert found
    for e in found:
        assert np.allclose(fsolve(field, e.state + 1e-3, xtol=1e-13), e.state, atol=1e-10)
        x, y, z = e.state
        jac = np.array([[0, 1, -math.cos(z)], [y, x - 1, 0], [1 / math.cosh(x) ** 2, 0, -1]])
        exact = np.sort_complex(np.linalg.eigvals(jac))
        assert np.allclose(np.sort_complex(e.eigenvalues), exact, atol=1e-12)


def test_a_model_whose_excitation_is_switched_off_rests() -> None:
    """Popp's block without force: x = a0 - a1 + a2, at the slope of friction there."""
    (rest,) = cf.find_equilibria("popp", {"F": 0.0})
    assert np.allclose(rest.state, [1.5 - 1.5 + 0.45, 0.0], atol=1e-14)
    with pytest.raises(cf.ParameterError, match="excited"):
        cf.find_equilibria("popp")
    with pytest.raises(cf.ParameterError, match="excited"):
        cf.continue_equilibrium(rest, "F", (0.0, 0.1))


def test_what_is_held_beyond_kinetic_friction_does_not_attract() -> None:
    """A load w relaxes to W while the mass sticks: held for |w| < S0, driven back for |w| < S."""
    model = typed(
        BLOCK.replace("[x, v]", "[x, v, w]")
        .replace("S0: 0.4", "S0: 0.4, W: 0.1")
        .replace("observable: x,", "observable: w,")
        .replace("v: -x - S*sign(v)", "v: -w - S*sign(v), w: W - w")
        .replace("{x: 0, v: 0}", "{x: w - x, v: 0, w: W - w}")
    )
    for force, stable in ((0.1, True), (0.35, False), (-0.25, True), (-0.39, False)):
        (rest,) = [e for e in cf.find_equilibria(model, {"W": force}) if e.mode == "stick"]
        assert np.allclose(rest.eigenvalues, -1.0) and rest.stable is stable
    branch = cf.continue_equilibrium(rest, "W", (-0.399, 0.399))
    assert branch.stable.tolist() == (np.abs(branch.values) < 0.3).tolist()


def test_sliding_of_a_relay_is_degenerate_at_its_hopf_point() -> None:
    """Its zero dynamics are linear: eigenvalues -sigma rho +- sqrt(...), and no cycle is told."""
    (rest,) = cf.find_equilibria("relay-sliding", {"sigma": 0.5})
    (event,) = cf.continue_equilibrium(rest, "sigma", (-0.9, 0.9)).events
    assert isinstance(event, cf.HopfPoint) and event.label == "H0"
    assert abs(event.value) < 1e-14 and event.frequency == pytest.approx(1.0)


# ------------------------------------------------------------------------------ smooth events


def test_folds_of_a_cubic() -> None:
    """mu x - x^3 + h = 0 folds at x = -+sqrt(mu/3), h = +-2 (mu/3)^(3/2)."""
    model = smooth("cubic", "x, v", "h: 0.0, mu: 1.0", "v", "x: v, v: -0.1*v + mu*x - x**3 + h")
    start = cf.find_equilibria(model, {"h": -0.5})[0]
    branch = cf.continue_equilibrium(start, "h", (-0.6, 0.6))
    folds = branch.of_kind("SN")
    x, h = math.sqrt(1 / 3), 2 * (1 / 3) ** 1.5
    assert [f.value for f in folds] == pytest.approx([h, -h], abs=1e-14)
    assert [f.equilibrium.state[0] for f in folds] == pytest.approx([-x, x], abs=1e-10)
    assert [(f.stable_before, f.stable_after) for f in folds] == [(True, False), (False, True)]
    assert branch.values[[0, -1]].tolist() == [-0.6, 0.6]
    assert len(branch.events) == 2
    for e in list(branch)[::10]:
        assert abs(e.state[0] - e.state[0] ** 3 + e.params["h"]) < 1e-12


def test_an_isola_closes() -> None:
    """x^2 + p^2 = 1: folds at p = +-1, each once."""
    model = smooth("isola", "x, v", "p: 0.0", "v", "x: v, v: -0.3*v + x**2 + p**2 - 1")
    branch = cf.continue_equilibrium(cf.find_equilibria(model)[0], "p", (-3.0, 3.0))
    assert {end.name for end in branch.ends} == {"CLOSED"}
    assert sorted(e.value for e in branch.of_kind("SN")) == pytest.approx([-1.0, 1.0], abs=1e-13)
    assert np.allclose(branch.state("x") ** 2 + branch.values**2, 1.0, atol=1e-12)
    turn = np.unwrap(np.arctan2(branch.values, branch.state("x")))
    assert abs(turn[-1] - turn[0]) == pytest.approx(2 * math.pi, abs=0.15)


def test_a_pitchfork_is_a_branch_point() -> None:
    model = smooth("fork", "x, v", "mu: -0.5", "v", "x: v, v: -0.1*v + mu*x - x**3")
    straight = cf.continue_equilibrium(cf.find_equilibria(model)[0], "mu", (-1.0, 1.0))
    (event,) = straight.events
    assert event.kind == "BP" and abs(event.value) < 1e-10
    assert (event.stable_before, event.stable_after) == (True, False)
    (bent,) = [e for e in cf.find_equilibria(model, {"mu": 0.5}) if e.state[0] > 0.1]
    arc = cf.continue_equilibrium(bent, "mu", (-1.0, 1.0))
    (vertex,) = arc.events
    assert vertex.kind == "BP" and abs(vertex.value) < 1e-9
    whole = cf.explore_equilibria(model, "mu", (-1.0, 1.0), values=4)
    assert len(whole) == 2 and [e.label for e in whole.events] == ["BP"]
    assert arc.values.min() == pytest.approx(0.0, abs=1e-6)  # a parabola over its vertex


def test_popp_begins_to_swing_where_its_friction_falls_fast_enough() -> None:
    """The slope at rest is a1 - 3 a2. To third order v' = -x + slope v + 3 a2 v^2 - a2 v^3; the quadratic
    term alone is reversible, so that Re c1 = -(3/8) a2 |q_v|^2 with <q, q> = 1, twice the amplitude squared.
    """
    (rest,) = cf.find_equilibria("popp", {"F": 0.0, "a2": 0.6})
    branch = cf.continue_equilibrium(rest, "a2", (0.3, 0.8))
    (event,) = branch.events
    assert isinstance(event, cf.HopfPoint)
    assert event.value == pytest.approx(0.5, abs=1e-14) and event.frequency == pytest.approx(1.0)
    assert event.lyapunov == pytest.approx(-0.75 * 0.5, abs=1e-13)
    assert event.centre.rate == pytest.approx(-1.5, abs=1e-13)  # half of the slope's -3
    assert event.label == "H-" and "supercritical" in event.meaning
    with pytest.raises(cf.ConvergenceError, match="excitation"):
        event.cycle()


def test_the_first_coefficient_is_that_of_the_planar_formula() -> None:
    """J. Guckenheimer, P. Holmes, Nonlinear Oscillations, Dynamical Systems ..., Springer 1983, eq. 3.4.11.

    For x' = -w y + f, y' = w x + g:  16 a = f_xxx + f_xyy + g_xxy + g_yyy
    + (f_xy (f_xx + f_yy) - g_xy (g_xx + g_yy) - f_xx g_xx + f_yy g_yy) / w.
    With <q, q> = 1, q = (1, -i)/sqrt(2): |z|^2 is half of the squared radius, so Re c1 = 2 a.
    """
    rng = np.random.default_rng(7)
    names = ["x**2", "x*y", "y**2", "x**3", "x**2*y", "x*y**2", "y**3"]
    for _ in range(2):
        w, f, g = rng.uniform(0.5, 2.0), *rng.uniform(-1, 1, (2, 7))
        texts = [" + ".join(f"({c})*{n}" for c, n in zip(k, names, strict=True)) for k in (f, g)]
        model = smooth(
            "planar",
            "x, y",
            f"mu: -0.1, w: {w}",
            "y",
            f'x: "mu*x - w*y + {texts[0]}", y: "w*x + mu*y + {texts[1]}"',
        )
        at = next(e for e in cf.find_equilibria(model) if np.max(np.abs(e.state)) < 1e-12)
        (event,) = cf.continue_equilibrium(at, "mu", (-0.2, 0.2)).of_kind("H")
        fxx, fxy, fyy, fxxx, _, fxyy, _ = f * [2, 1, 2, 6, 2, 2, 6]
        gxx, gxy, gyy, _, gxxy, _, gyyy = g * [2, 1, 2, 6, 2, 2, 6]
        cross = fxy * (fxx + fyy) - gxy * (gxx + gyy) - fxx * gxx + fyy * gyy
        a = (fxxx + fxyy + gxxy + gyyy + cross / w) / 16
        assert event.lyapunov * w == pytest.approx(2 * a, rel=1e-11)


def test_sliding_swings_as_its_field_within_the_surface_does() -> None:
    """Fields that press on z = x^2 from both sides and carry van der Pol's along: l1 = -1/4 at mu = 0."""
    model = typed(
        """
name: curved
states: [x, v, z]
parameters: {mu: -0.5}
observables: {h: z - x**2}
surfaces: {h: {observable: h, level: 0, sliding: filippov}}
modes:
  above: {in: {h: "+"}, field: {x: v, v: (mu - x**2)*v - x, z: 2*x*v - 3}}
  below: {in: {h: "-"}, field: {x: v, v: (mu - x**2)*v - x, z: 2*x*v + 2}}
"""
    )
    (rest,) = cf.find_equilibria(model)
    assert rest.pseudo and rest.eigenvalues.shape == (2,) and rest.stable
    (event,) = cf.continue_equilibrium(rest, "mu", (-1.0, 1.0)).events
    assert event.label == "H-" and abs(event.value) < 1e-14
    assert event.lyapunov == pytest.approx(-0.25, abs=1e-12)


# ---------------------------------------------------------------------------- cycles that are born


def test_cycles_have_the_size_of_the_normal_form() -> None:
    """Solved for at the parameter of the normal form, a cycle has its amplitude but for O(a^3).

    Van der Pol, and Lorenz's equations, whose Hopf point is at r = sigma (sigma + b + 3)/(sigma - b - 1),
    where unstable cycles are born (subcritical).
    """
    pol = smooth("pol", "x, v", "mu: -0.5", "v", "x: v, v: (mu - x**2)*v - x")
    lorenz = smooth(
        "lorenz",
        "x, y, z",
        "r: 20.0, s: 10.0, b: 2.6666666666666665",
        "y - x",
        "x: s*(y - x), y: x*(r - z) - y, z: x*y - b*z",
    )
    for model, parameter, bounds, index, scale in (
        (pol, "mu", (-1.0, 1.0), 0, 1.0),
        (lorenz, "r", (15.0, 30.0), 1, 10.0),
    ):
        points = list(cf.find_equilibria(model, starts=400)) or []
        rest = max(points, key=lambda e: e.state[0])
        (event,) = cf.continue_equilibrium(rest, parameter, bounds).of_kind("H")
        if model is lorenz:
            assert event.value == pytest.approx(10 * (10 + 8 / 3 + 3) / (10 - 8 / 3 - 1), rel=1e-12)
            assert event.lyapunov > 0
        errors = []
        for a in (0.02 * scale, 0.01 * scale):
            orbit = event.cycle(a)
            middle = event.equilibrium.state + event.centre.drift * (
                orbit.params[parameter] - event.value
            )
            t = np.linspace(0, 1, 400, endpoint=False) * orbit.period
            states = np.array([orbit.state(float(orbit.joints[0, 0] + s)) for s in t])
            # the first harmonic of one state is 2 a |q_k|
            wave = np.exp(-2j * math.pi * np.arange(400) / 400)
            first = 2 * abs(np.mean((states[:, index] - middle[index]) * wave))
            errors.append(abs(first / (2 * a * abs(event.centre.vector[index])) - 1))
            assert orbit.period == pytest.approx(2 * math.pi / event.frequency, rel=0.01)
            assert bool(max(abs(orbit.multipliers)) > 1) is (event.lyapunov > 0)
        assert errors[0] < 0.02
        assert errors[1] < 0.4 * errors[0] or errors[1] < 1e-6  # of second order in a


def test_a_belt_begins_to_swing_where_friction_falls_faster_than_damping() -> None:
    """c = Fs delta / (1 + delta vb)^2; friction is convex there, so the cycle is unstable, and meets the
    stick-slip cycle where it touches the belt."""
    model = typed(DAMPED_BELT)
    (rest,) = cf.find_equilibria(model)
    (event,) = cf.continue_equilibrium(rest, "c", (0.1, 2.0)).events
    assert event.value == pytest.approx(3.0 / 2.5**2, abs=1e-14)
    assert event.label == "H+" and (event.stable_before, event.stable_after) == (False, True)
    # v' = -x + slope v + k2 v^2 + k3 v^3 with k3 = Fs delta^3/(1 + delta vb)^4: Re c1 = (3/8) k3 * 2
    assert event.lyapunov == pytest.approx(0.75 * 27 / 2.5**4, rel=1e-12)
    orbit = event.cycle()
    assert not orbit.stable and orbit.params["c"] > event.value
    diagram = cf.explore(orbit, "c", (0.1, 0.7))
    ends = {end.reason.name for branch in diagram.branches for end in branch.ends}
    assert "POINT" in ends and "RANGE" in ends
    assert not diagram.loose_ends
    assert [b.kind.value for b in diagram.bifurcations].count("GS") == 1
    assert len(diagram.branches) == 2


def test_a_smooth_cycle_ends_at_its_hopf_point() -> None:
    model = smooth("pol", "x, v", "mu: -0.5", "v", "x: v, v: (mu - x**2)*v - x")
    (event,) = cf.continue_equilibrium(cf.find_equilibria(model)[0], "mu", (-1, 1)).events
    branch = cf.continue_orbit(event.cycle(), "mu", (-1.0, 1.0))
    assert [end.reason.name for end in branch.ends] == ["POINT", "RANGE"]
    assert branch.params["mu"].min() == pytest.approx(0.0, abs=1e-9)


# -------------------------------------------------------------------------- boundary equilibria


@pytest.mark.parametrize("c", [-1.0, 0.0, 0.1, 0.5, 1.0, 3.0])
def test_the_product_tells_persistence_from_a_fold(c: float) -> None:
    """C N^-1 E = (a - c)/(1 + a^2) for N = [[a, -1], [1, a]], E = (c, 1).

    The pseudo-equilibrium is at x = mu (1 + a c)/(c - a).
    """
    model, a = typed(FOCUS), 0.2
    focus = next(e for e in cf.find_equilibria(model, {"c": c}) if not e.pseudo)
    branch = cf.continue_equilibrium(focus, "mu", (-1.0, 1.0))
    (event,) = branch.events
    assert event.kind == "BE" and event.surface in ("y", "slide-", "slide+")
    assert abs(event.value) < 1e-13
    assert event.product == pytest.approx((c - a) / (1 + a**2), rel=1e-9)
    assert event.unfolding.name == ("PERSISTENCE" if c > a else "FOLD")
    assert bool(branch.values[0] < 0) is (c > a)  # beyond, or back
    assert set(branch.modes) == {"focus", "slide"}
    sliding = [e for e in branch if e.pseudo]
    for e in sliding[::20]:
        assert e.state[0] == pytest.approx(e.params["mu"] * (1 + a * c) / (c - a), abs=1e-12)
    assert all(branch.admissible)


def test_continuous_fields_persist_or_fold_by_their_determinants() -> None:
    for slope, kind in ((0.5, "PERSISTENCE"), (2.0, "FOLD")):
        model = typed(
            f"""
name: kinked
states: [x]
parameters: {{mu: -0.5}}
observables: {{z: x}}
kinks: [z]
surfaces: {{far: {{observable: x, level: 50}}}}
modes:
  all: {{in: {{far: "-"}}, field: {{x: mu - x - {slope}*abs(x)}}}}
  beyond: {{in: {{far: "+"}}, field: {{x: -1}}}}
"""
        )
        start = next(e for e in cf.find_equilibria(model, {"mu": 0.5}) if e.state[0] > 0)
        branch = cf.continue_equilibrium(start, "mu", (-1.0, 1.0))
        (event,) = branch.events
        assert event.kind == "BE" and event.surface == "z" and event.unfolding.name == kind
        assert event.product == pytest.approx((1 - slope) / (1 + slope), rel=1e-12)


@pytest.mark.slow
def test_a_cycle_is_born_at_a_boundary_focus() -> None:
    """Fields that are affine at the point: the cycle's size is proportional to mu."""
    model = typed(FOCUS)
    branch = cf.continue_equilibrium(cf.find_equilibria(model)[0], "mu", (-1.0, 1.0))
    (event,) = branch.events
    assert (event.stable_before, event.stable_after) == (True, False)
    orbit = event.cycle()
    assert orbit.stable and orbit.params["mu"] > 0
    half = event.cycle(distance=0.5 * orbit.params["mu"])
    sizes = [np.max(np.abs(o.joints[:, 1:])) for o in (orbit, half)]
    assert sizes[0] / sizes[1] == pytest.approx(2.0, rel=0.1)
    grown = cf.continue_orbit(orbit, "mu", (0.005, 1.0))
    assert grown.params["mu"].max() == pytest.approx(1.0)
    # the slide leaves where the focus is tangent to the surface: x = a mu
    leaves = min(grown[-1].joints[:, 1], key=lambda x: abs(x - 0.2))
    assert leaves == pytest.approx(0.2, abs=1e-12)


def test_a_virtual_equilibrium_becomes_admissible() -> None:
    model = typed(FOCUS)
    virtual = next(e for e in cf.find_equilibria(model, {"mu": -0.5}).virtual if e.mode == "focus")
    branch = cf.continue_equilibrium(virtual, "mu", (-1.0, 1.0))
    assert (
        branch.admissible.tolist() == (branch.values > 0).tolist()
        or abs(np.count_nonzero(branch.admissible) - np.count_nonzero(branch.values > 0)) <= 1
    )
    assert [e.kind.value for e in branch.events] == ["BE"]


# ----------------------------------------------------------------------------------- messages


def test_what_cannot_be_continued_is_said() -> None:
    found = cf.find_equilibria(typed(BLOCK))
    with pytest.raises(cf.ParameterError, match="a set of them"):
        cf.continue_equilibrium(found.sets[0], "S", (0.1, 0.3))
    rest = cf.find_equilibria("belt")[0]
    with pytest.raises(cf.ParameterError, match="no parameter 'vd'"):
        cf.continue_equilibrium(rest, "vd", (0.1, 0.3))
    with pytest.raises(cf.ParameterError, match="outside of the range"):
        cf.continue_equilibrium(rest, "vb", (0.3, 0.5))
    with pytest.raises(cf.ParameterError, match="not declared by formulas"):
        cf.find_equilibria("coulomb")


def test_a_cycle_needs_no_section_of_the_model() -> None:
    model = typed(
        "name: bare\nstates: [x, v]\nparameters: {mu: -0.5}\nsurfaces: {far: {observable: x, level: 9}}\n"
        'field: {x: v, v: (mu - x**2)*v - x}\nmodes: {near: {in: {far: "-"}}, far: {in: {far: "+"}, '
        "field: {x: -1, v: 0}}}\n"
    )
    (event,) = cf.continue_equilibrium(cf.find_equilibria(model)[0], "mu", (-1, 1)).events
    cycle = event.cycle()
    assert cycle.x_max == pytest.approx(
        2.0 * math.sqrt(cycle.params["mu"]), rel=1e-2
    )  # to first order
    linear = smooth("linear", "x, v", "c: 0.1", "v", "x: v, v: -c*v - x")
    (event,) = cf.continue_equilibrium(cf.find_equilibria(linear)[0], "c", (-1, 1)).events
    assert event.lyapunov == 0.0 and event.label == "H0"
    with pytest.raises(cf.ConvergenceError, match="neither side nor size"):
        event.cycle()


def test_neutral_saddles_are_no_hopf_points() -> None:
    """Eigenvalues +-1 sum to zero without a pair on the imaginary axis."""
    model = smooth("saddle", "x, v", "c: 0.1", "v", "x: v, v: -c*v + x")
    assert not cf.continue_equilibrium(cf.find_equilibria(model)[0], "c", (-1, 1)).events


def test_pairs_that_cross_together_are_seen() -> None:
    """Two oscillators side by side: both pairs cross at mu = 0, one on each side of it where they differ."""
    for apart in (0.0, 1e-3):
        model = smooth(
            "two",
            "x, v, y, w",
            f"mu: -0.5, d: {apart}",
            "v",
            "x: v, v: (mu - x**2)*v - x, y: w, w: (mu - d - y**2)*w - 2*y",
        )
        (rest,) = cf.find_equilibria(model)
        events = cf.continue_equilibrium(rest, "mu", (-1, 1)).events
        assert [e.value for e in events] == pytest.approx([0.0, apart], abs=1e-12)
        assert [e.label for e in events] == ["H-", "H-"]
        if apart:
            assert [e.frequency for e in events] == pytest.approx([1.0, math.sqrt(2.0)])
            assert events[0].lyapunov == pytest.approx(-0.25)


def test_events_lie_where_a_root_search_by_eigenvalues_has_them() -> None:
    model = smooth(
        "three", "x, y, z", "p: 0.3", "x", "x: y, y: z, z: -p*z - y - x + 0.3*x**2 + 0.2*p*x + 0.1"
    )
    start = cf.find_equilibria(model)[0]
    branch = cf.continue_equilibrium(start, "p", (0.05, 3.0))

    def largest_pair(p: float) -> float:
        e = cf.find_equilibria(model, {"p": p}, starts=30)[0]
        complex_ones = e.eigenvalues[np.abs(e.eigenvalues.imag) > 1e-9]
        return float(np.max(complex_ones.real))

    for event in branch.of_kind("H"):
        width = 1e-3
        exact = brentq(largest_pair, event.value - width, event.value + width, xtol=1e-13)
        assert event.value == pytest.approx(exact, abs=1e-10)
    assert branch.of_kind("H")
