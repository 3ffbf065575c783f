"""Models typed by textbook equations: a paced heart cell, an accelerator, controllers, a rotor that rubs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from by_scipy import after, met
from scipy.linalg import expm
from scipy.optimize import fsolve

import contfric as cf

#: Mitchell and Schaeffer's cell (2003), paced by jumps of the voltage.
CELL = """
name: cell
states: [V, h]
parameters: {tin: 0.3, tout: 6.0, topen: 120.0, tclose: 150.0, vgate: 0.13, stim: 0.2, BCL: 280.0}
period: BCL
define: {current: h*V**2*(1 - V)/tin - V/tout}
surfaces: {gate: {observable: V, level: vgate}}
modes:
  open: {in: {gate: -}, field: {V: current, h: (1 - h)/topen}}
  close: {in: {gate: +}, field: {V: current, h: -h/tclose}}
resets: {tick: {V: V + stim}}
spread: {V: [0, 1], h: [0, 1]}
"""

#: A wall that moves, and one that does not; some speed is lost at the first one.
ACCELERATOR = """
name: accelerator
states: [x, v]
parameters: {eps: 0.1, L: 1.0, alpha: 0.8, w: 1.0}
period: 2*pi/w
surfaces:
  moving: {observable: x - eps*cos(w*t)}
  fixed: {observable: x, level: L}
field: {x: v, v: 0}
modes: {flight: {in: {moving: +, fixed: -}}}
resets:
  moving: {v: -alpha*v - (1 + alpha)*eps*w*sin(w*t)}
  fixed: {v: -v}
"""

#: A position controller with an integral, and friction at rest above that of motion: it hunts.
HUNTING = """
name: hunting
states: [ie, x, v]
parameters: {Kp: 1.0, Ki: 0.3, Kd: 0.5, Fs: 0.4, Fc: 0.25}
autonomous: true
define: {u: -Kp*x - Kd*v - Ki*ie}
observables: {load: u}
surfaces:
  v: {observable: v}
  F+: {observable: load, level: Fs}
  F-: {observable: load, level: -Fs}
modes:
  forward: {in: {v: +}, field: {ie: x, x: v, v: u - Fc}}
  backward: {in: {v: -}, field: {ie: x, x: v, v: u + Fc}}
  stick: {in: {v: 0, F+: -, F-: +}, field: {ie: x, x: 0, v: 0}}
symmetry: ie -> -ie, x -> -x, v -> -v
"""

#: A sliding surface with an integral of the error, and an actuator with a lag.
LAGGED = """
name: lagged
states: [e, de, s, u]
parameters: {k: 2.0, K: 3.0, lam: 1.5, li: 0.5, tau: 0.1, d: 0.5, w: 1.0}
EXCITED
define: {sigma: de + lam*e + li*s}
surfaces: {sig: {observable: sigma}}
field: {e: de, de: u + FORCE - k*sin(e), s: e, u: (-K*sign(sigma) - u)/tau}
"""

#: A rotor in a stator (Chu and Zhang 1998): its radius is no coordinate.
ROTOR = """
name: rotor
states: [x, y, vx, vy]
parameters: {zeta: 0.1, beta: 10.0, mu: 0.1, u: 0.8, W: 1.2, d: 1.0, g: 0.3}
period: 2*pi/W
define:
  r: sqrt(x**2 + y**2)
  Fn: where(r > d, beta*(r - d), 0)
observables: {radius: r}
surfaces: {rub: {observable: radius, level: d}}
field:
  x: vx
  y: vy
  vx: -2*zeta*vx - x + u*W**2*cos(W*t) - Fn*(x - mu*y)/r
  vy: -2*zeta*vy - y + u*W**2*sin(W*t) - g - Fn*(mu*x + y)/r
modes: {free: {in: {rub: -}}, rubs: {in: {rub: +}}}
"""


def typed(folder: Path, text: str) -> cf.Model:
    path = folder / "model.yaml"
    path.write_text(text)
    return cf.load_model(path)


def beat(start: np.ndarray, p: dict[str, float]) -> np.ndarray:
    """Return the state after the next tick by scipy."""

    def rate(t: float, y: np.ndarray, opens: bool) -> list[float]:
        V, h = y
        gate = (1.0 - h) / p["topen"] if opens else -h / p["tclose"]
        return [h * V**2 * (1.0 - V) / p["tin"] - V / p["tout"], gate]

    def gate(t: float, y: np.ndarray, opens: bool) -> float:
        return float(y[0] - p["vgate"])

    t, fired = met(rate, start, gate, -1.0, (0.0, p["BCL"]), atol=1e-14, args=(False,))
    rest = after(rate, fired, (t, p["BCL"]), atol=1e-14, args=(True,))
    return np.add(rest, [p["stim"], 0.0])


def test_beats_of_a_heart_alternate(tmp_path: Path) -> None:
    """The period doubling is where the slope of the map from beat to beat is -1."""
    model = typed(tmp_path, CELL + "units: {t: 60.0}\n")
    branch = cf.continue_orbit(cf.find_orbit(model), "BCL", (272.0, 285.0))
    [doubling] = [b for b in branch.bifurcations if b.kind is cf.Kind.PD]
    p = doubling.params
    start = next(b[1:3] for b in doubling.orbit.begins if abs(b[1] - p["stim"]) < 1e-4)
    assert beat(start, p) == pytest.approx(start, abs=1e-10)
    columns = [beat(start + 1e-5 * e, p) - beat(start - 1e-5 * e, p) for e in np.eye(2)]
    slopes = np.linalg.eigvals(np.array(columns).T / 2e-5)
    assert np.min(slopes.real) == pytest.approx(-1.0, abs=1e-6)


def test_a_doubling_that_nothing_leaves_is_told(tmp_path: Path) -> None:
    """In milliseconds the branch is not found; the diagram says so, and not that it is complete."""
    orbit = cf.find_orbit(typed(tmp_path, CELL))
    diagram = cf.explore(orbit, "BCL", (272.0, 285.0))
    [doubling] = [b for b in diagram.bifurcations if b.kind is cf.Kind.PD]
    left = any(branch.system.periods == 2 for branch in diagram.branches)
    told = [note for note in diagram.notes if "the branch that leaves there was not found" in note]
    assert left != bool(told)
    assert all(doubling.label in note for note in told)


def test_no_note_tells_of_longer_periods_than_were_asked_for(tmp_path: Path) -> None:
    orbit = cf.find_orbit(typed(tmp_path, CELL + "units: {t: 60.0}\n"))
    diagram = cf.explore(orbit, "BCL", (272.0, 285.0), max_periods=1)
    assert [b.kind for b in diagram.bifurcations] == [cf.Kind.PD]
    assert diagram.notes == ()


def test_an_accelerator_has_a_fold_in_closed_form(tmp_path: Path) -> None:
    """Its ball returns after a period: 2 (L - eps cos(phi)) = v T; it gets back what it loses at the wall."""
    model = typed(tmp_path, ACCELERATOR)
    p = model.defaults
    T, eps, L = 2 * np.pi, p["eps"], p["L"]

    def speed(phi: float) -> float:
        return float(2.0 * (L - eps * np.cos(phi)) / T)

    def lost(phi: float, alpha: float) -> float:
        return float((1.0 - alpha) * speed(phi) + (1.0 + alpha) * eps * np.sin(phi))

    orbit = cf.find_orbit(model, state=[0.5, 1.0])
    at = next(b for b in orbit.begins if abs(b[1] - eps * np.cos(b[0])) < 1e-9)
    assert at[2] == pytest.approx(speed(at[0]), abs=1e-11)
    assert lost(at[0], p["alpha"]) == pytest.approx(0.0, abs=1e-11)

    def fold(z: np.ndarray) -> list[float]:
        phi, alpha = z
        slope = (1.0 - alpha) * 2.0 * eps * np.sin(phi) / T + (1.0 + alpha) * eps * np.cos(phi)
        return [lost(phi, alpha), slope]

    branch = cf.continue_orbit(orbit, "alpha", (0.5, 0.95))
    [found] = branch.bifurcations
    assert found.kind is cf.Kind.SN
    expected = fsolve(fold, [-1.4, 0.5], xtol=1e-14)
    assert found.params["alpha"] == pytest.approx(expected[1], abs=1e-10)


@pytest.mark.parametrize("Ki", [0.15, 0.3, 0.45])
def test_a_controller_with_an_integral_hunts(tmp_path: Path, Ki: float) -> None:
    """Half a cycle by scipy: from the end of a stick to the next one, where signs are changed."""
    model = typed(tmp_path, HUNTING)
    p = {**model.defaults, "Ki": Ki}
    orbit = cf.find_orbit(model, {"Ki": Ki}, state=[0.0, 1.0, 0.0])
    released = next(
        e for (m, _), e in zip(orbit.itinerary, orbit.ends, strict=True) if m == "stick"
    )
    load = -p["Kp"] * released[2] - Ki * released[1]
    assert abs(load) == pytest.approx(p["Fs"], abs=1e-12)
    sense = np.sign(load)

    def slip(t: float, y: np.ndarray) -> list[float]:
        u = -p["Kp"] * y[1] - p["Kd"] * y[2] - Ki * y[0]
        return [y[1], y[2], u - sense * p["Fc"]]

    def stop(t: float, y: np.ndarray) -> float:
        return float(y[2]) if t > 0.05 else float(sense)

    t, (integral, x, _) = met(slip, released[1:], stop, max_step=0.2, atol=1e-14)
    # at rest the integral grows by x until the load is at the other limit
    rest = (sense * p["Fs"] - p["Kp"] * x) / (Ki * x) - integral / x
    assert rest > 0.0
    assert [integral + x * rest, x] == pytest.approx((-released[1:3]).tolist(), abs=1e-9)
    assert orbit.period == pytest.approx(2.0 * (t + rest), abs=1e-8)


@pytest.mark.parametrize(
    ("excited", "force"),
    [("period: 2*pi/w", "d*sin(w*t)"), ("autonomous: true", "d")],
)
def test_switching_that_quickens_without_an_end_is_told(
    tmp_path: Path, excited: str, force: str
) -> None:
    """With a lag the surface and its rate come to 0 together: no simulation gets to the end of a period."""
    model = typed(tmp_path, LAGGED.replace("EXCITED", excited).replace("FORCE", force))
    with pytest.raises(cf.ConvergenceError, match=r"switches at 'sig' faster and faster"):
        cf.find_orbit(model)


def test_what_grows_beyond_its_levels_is_said_to_grow(tmp_path: Path) -> None:
    """A loop that diverges loses its dead zone in rounding; that is no mode that is missing."""
    model = typed(
        tmp_path,
        """
name: servo
states: [th, om, i, q]
parameters: {b: 0.1, Ke: 0.5, R: 1.0, L: 0.2, Kp: 3.0, Ki: 1.0, dz: 0.3, a: 1.0, w: 0.5}
period: 2*pi/w
define:
  e: a*sin(w*t) - th
  volt: Kp*e + Ki*q
surfaces: {up: {observable: volt, level: dz}, dn: {observable: volt, level: -dz}}
field: {th: om, om: i - b*om, i: "(volt - max(-dz, min(dz, volt)) - R*i - Ke*om)/L", q: e}
""",
    )
    with pytest.raises(cf.ConvergenceError, match="grows without bound"):
        cf.find_orbit(model)


def test_a_rotor_rubs(tmp_path: Path) -> None:
    """The radius bounds the modes, and `where` decides the force by the same condition."""
    model = typed(tmp_path, ROTOR)
    assert cf.check_model(model).ok
    orbit = cf.find_orbit(model)
    p = model.defaults

    def field(t: float, y: np.ndarray) -> list[float]:
        x, z, vx, vz = y
        r = np.hypot(x, z)
        n = p["beta"] * (r - p["d"]) if r > p["d"] else 0.0
        drive = p["u"] * p["W"] ** 2
        return [
            vx,
            vz,
            -2 * p["zeta"] * vx - x + drive * np.cos(p["W"] * t) - n * (x - p["mu"] * z) / r,
            -2 * p["zeta"] * vz
            - z
            + drive * np.sin(p["W"] * t)
            - p["g"]
            - n * (p["mu"] * x + z) / r,
        ]

    t, *y = orbit.begins[0]
    assert after(field, y, (t, t + orbit.period)) == pytest.approx(y, abs=1e-8)


def test_impacts_that_lose_ever_less_are_told(tmp_path: Path) -> None:
    """Restitution exp(-v/vc): speeds go down like 1/n, and so do the flights."""
    model = typed(
        tmp_path,
        """
name: ball
states: [x, v]
parameters: {A: 0.5, g: 1.0, vc: 2.0}
period: 2*pi
define: {rel: v - A*cos(t), e: exp(-abs(rel)/vc)}
surfaces: {table: {observable: x - A*sin(t)}}
modes: {flight: {in: {table: +}, field: {x: v, v: -g}}}
resets: {table: {v: A*cos(t) - e*rel}}
""",
    )
    with pytest.raises(cf.ConvergenceError, match="whose restitution comes to 1"):
        cf.find_orbit(model)


#: A heater that is on for a share of each period, which a controller sets at the tick, between two limits.
SAMPLED = """
name: sampled
states: [x, q, d]
parameters: {a: 1.0, K: 3.0, r: 1.0, kp: 0.8, ki: 0.5, Ts: 0.5}
period: Ts
define: {u: kp*(r - x) + ki*q}
observables: {wanted: u}
surfaces:
  off: {observable: "mod(t, Ts) - d*Ts"}
  full: {observable: wanted, level: 0.98}
  least: {observable: wanted, level: 0.02}
field: {x: -a*x, q: r - x, d: 0}
modes:
  on: {in: {off: -}, field: {x: -a*x + K, q: r - x, d: 0}}
MODES
resets: {tick: {d: "max(0.02, min(0.98, u))", to: on}}
spread: {x: [0, 3], q: [-1, 1], d: [0, 1]}
"""
LIMITS = """  more: {in: {off: +, full: +}}
  rest: {in: {off: +, full: -, least: +}}
  less: {in: {off: +, least: -}}
"""


def after_a_tick(z: np.ndarray, d: float, p: dict[str, float]) -> np.ndarray:
    """Return temperature and integral a period later, in closed form."""
    (x, q), a, K = z, p["a"], p["K"]
    on, rest = d * p["Ts"], (1.0 - d) * p["Ts"]
    warm = K / a + (x - K / a) * np.exp(-a * on)
    q += p["r"] * on - K / a * on - (x - K / a) * (1.0 - np.exp(-a * on)) / a
    return np.array(
        [warm * np.exp(-a * rest), q + p["r"] * rest - warm * (1.0 - np.exp(-a * rest)) / a]
    )


def test_a_limit_inside_of_another_one_is_a_corner_of_a_reset(tmp_path: Path) -> None:
    """``max(a, min(b, u))``: both limits are surfaces with a mode on each side: no branch stalls."""
    model = typed(tmp_path, SAMPLED.replace("MODES\n", LIMITS))
    assert "has a kink" not in str(cf.check_model(model))
    diagram = cf.explore(cf.find_orbit(model), "kp", (0.8, 1.5))
    assert not diagram.loose_ends
    p = model.defaults

    def wanted(z: np.ndarray, kp: float) -> float:
        return float(kp * (p["r"] - z[0]) + p["ki"] * z[1])

    def doubling(z: np.ndarray) -> list[float]:
        at, kp = z[:2], z[2]
        columns = [
            after_a_tick(at + e, wanted(at + e, kp), p)
            - after_a_tick(at - e, wanted(at - e, kp), p)
            for e in 1e-5 * np.eye(2)
        ]
        slopes = np.array(columns).T / 2e-5
        closing = after_a_tick(at, wanted(at, kp), p) - at
        return [*closing, float(np.linalg.det(slopes + np.eye(2)))]

    def corner(z: np.ndarray) -> list[float]:
        at, kp = z[:2], z[2]
        between = after_a_tick(at, 0.02, p)
        return [*(after_a_tick(between, wanted(between, kp), p) - at), wanted(at, kp) - 0.02]

    found = {
        kind: [b.params["kp"] for b in diagram.bifurcations if b.kind is kind]
        for kind in (cf.Kind.PD, cf.Kind.CS)
    }
    [pd] = found[cf.Kind.PD]
    assert pd == pytest.approx(fsolve(doubling, [0.84, 0.4, 1.43], xtol=1e-8)[2], abs=1e-6)
    reference = fsolve(corner, [1.12, 0.37, 1.43], xtol=1e-12)[2]
    assert min(abs(kp - reference) for kp in found[cf.Kind.CS]) < 1e-9


def test_domains_of_one_mode_do_not_hide_a_kink_of_a_reset(tmp_path: Path) -> None:
    """Solutions cross such surfaces without an event; without a mode on each side the kink is told."""
    model = typed(tmp_path, SAMPLED.replace("MODES\n", "  rest: {in: {off: +}}\n"))
    report = str(cf.check_model(model))
    assert "the reset at 'tick' has a kink where ki*q + kp*(r - x) - 1/50 = 0" in report
    assert "a mode on each side" in report


#: An LLC converter with a fixed output: where no diode conducts, both currents are equal (a slide).
LLC = """
name: llc
states: [ir, im, vc]
parameters: {V: 1.0, Vo: 0.9, Lr: 1.0, Lm: 4.0, Cr: 1.0, w: 0.7}
period: 2*pi/w
surfaces:
  bridge: {observable: sin(w*t)}
  diode: {observable: ir - im, sliding: filippov}
field:
  ir: (V*sign(sin(w*t)) - vc - Vo*sign(ir - im))/Lr
  im: Vo*sign(ir - im)/Lm
  vc: ir/Cr
symmetry: ir -> -ir, im -> -im, vc -> -vc, t -> t + T/2
"""


def test_a_converter_without_loss_ends_at_its_resonance(tmp_path: Path) -> None:
    """Its branch stalls at w = 1 with currents of 3e5; that is no fold. An orbit by expm at w = 0.7."""
    model = typed(tmp_path, LLC)
    orbit = cf.find_orbit(model)
    p = model.defaults

    def moved(t: float, y: np.ndarray, duration: float, slides: bool, sense: float) -> np.ndarray:
        drive = p["V"] * np.sign(np.sin(p["w"] * (t + 0.5 * duration)))
        if slides:  # one current through both coils
            A = np.array([[0.0, 0.0, -1.0 / (p["Lr"] + p["Lm"])]] * 2 + [[1.0 / p["Cr"], 0.0, 0.0]])
            b = np.array([drive / (p["Lr"] + p["Lm"])] * 2 + [0.0])
        else:
            A = np.array([[0.0, 0.0, -1.0 / p["Lr"]], [0.0] * 3, [1.0 / p["Cr"], 0.0, 0.0]])
            b = np.array([(drive - sense * p["Vo"]) / p["Lr"], sense * p["Vo"] / p["Lm"], 0.0])
        whole = np.zeros((4, 4))
        whole[:3, :3], whole[:3, 3] = A, b
        return np.asarray((expm(whole * duration) @ [*y, 1.0])[:3])

    for (mode, _), begin, end in zip(orbit.itinerary, orbit.begins, orbit.ends, strict=True):
        duration = (end[0] - begin[0]) % orbit.period
        slides, sense = mode.startswith("slide"), 1.0 if "diode+" in mode else -1.0
        assert moved(begin[0], begin[1:], duration, slides, sense) == pytest.approx(
            end[1:], abs=1e-9
        )
    last = cf.continue_orbit(orbit, "w", (0.65, 1.2)).ends[1]
    assert last.reason is cf.EndReason.UNBOUNDED
