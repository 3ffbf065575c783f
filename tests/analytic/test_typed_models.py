"""Textbook models as their textbooks write them, against closed forms and scipy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from by_scipy import met
from scipy.linalg import expm
from scipy.optimize import fsolve
from typed import typed

import contfric as cf

#: A pendulum that its anchor strikes each time it passes the middle, in the direction of its motion.
ANCHOR = """
name: anchor
states: [x, v]
parameters: {c: 0.05, p: 0.3}
autonomous: true
surfaces: {middle: {observable: x}}
modes: {swings: {field: {x: v, v: -x - 2*c*v}}}
resets: {middle: {v: v + p*sign(v), from: [swings]}}
symmetry: x -> -x, v -> -v
"""


def test_a_blow_along_the_motion_does_not_jump(tmp_path) -> None:
    """From x > 0 the middle is met with v < 0 only: sign(v) jumps nowhere that motion comes to."""
    model = typed(tmp_path, ANCHOR)
    assert cf.check_model(model).ok
    orbit = cf.find_orbit(model)
    half = math.pi / math.sqrt(1.0 - 0.05**2)
    decay = math.exp(-0.05 * half)
    assert orbit.period == pytest.approx(2.0 * half, rel=1e-12)
    assert max(abs(orbit.ends[:, 2])) == pytest.approx(0.3 * decay / (1.0 - decay), rel=1e-11)
    assert abs(orbit.multipliers[0]) == pytest.approx(decay**2, rel=1e-11)


@pytest.mark.parametrize("blow", ["v*(1 + p*sign(v + 1))", "v*(1 + p*sign(v + p))"])
def test_a_blow_that_jumps_where_motion_meets_it_is_refused(tmp_path, blow: str) -> None:
    """The jump lies between two states of motion that comes from the same side."""
    modes = "{falls: {in: {middle: +}, field: F}, rises: {in: {middle: -}, field: F}}"
    text = ANCHOR.replace("{swings: {field: {x: v, v: -x - 2*c*v}}}", modes).replace(
        "swings", "falls"
    )
    text = text.replace("field: F", "field: {x: v, v: -x - 2*c*v}").replace("v + p*sign(v)", blow)
    report = cf.check_model(typed(tmp_path, text.replace("symmetry: x -> -x, v -> -v", "")))
    assert any("between states that meet it in mode 'falls'" in str(f) for f in report.findings)


GENES = """
name: genes
states: [x, y]
parameters: {k: 2.0, A: 0.6, W: 1.0, th: 1.0}
period: 2*pi/W
surfaces: {X: {observable: x, level: th}, Y: {observable: y, level: th}}
modes:
  both: {in: {X: +, Y: +}, field: {x: A*cos(W*t) - x, y: k - y}}
  xo: {in: {X: +, Y: -}, field: {x: k + A*cos(W*t) - x, y: k - y}}
  oy: {in: {X: -, Y: +}, field: {x: A*cos(W*t) - x, y: -y}}
  none: {in: {X: -, Y: -}, field: {x: k + A*cos(W*t) - x, y: -y}}
"""


@pytest.mark.parametrize("A", [0.0, 0.6])
def test_a_motion_with_excitation_winds_into_a_point(tmp_path, A: float) -> None:
    """A turn of size d takes a time of about d and shrinks by a share of about d: no period ends."""
    with pytest.raises(
        cf.ConvergenceError, match=r"comes to rest near x = (1|0\.99).*, y = (1|0\.99)"
    ):
        cf.find_orbit(typed(tmp_path, GENES), {"A": A}, state=[0.5, 0.5])


BLOWS_UP = """
name: blow-up
states: [V, w]
parameters: {I: 1.0, low: -1.0, top: 20.0, tau: 36.0}
autonomous: true
surfaces: {spike: {observable: V, level: top}}
modes: {quiet: {in: {spike: -}, field: {V: (I + exp(2*V) - w)/tau, w: -w/tau}}}
resets: {spike: {V: low, w: w + 0.1}}
"""


def test_a_spike_faster_than_the_time_can_say_is_said(tmp_path) -> None:
    """At V = 20 the rate is exp(40)/36: rounding of the time moves V by tens, and no branch is traced.

    At V = 5 the orbit is nearly the same, and so are its neighbours.
    """
    model = typed(tmp_path, BLOWS_UP)
    far = cf.find_orbit(model, state=[-1.0, 0.0])
    with pytest.raises(cf.ConvergenceError, match=r"'quiet' comes to 'spike' at a rate of 7e\+15"):
        cf.continue_orbit(far, "I", (0.5, 2.0))
    stopped = cf.continue_orbit(
        cf.find_orbit(model, {"top": 16.0}, state=[-1.0, 0.0]), "I", (0.5, 2.0)
    )
    assert all("'quiet' comes to 'spike'" in str(e) for e in stopped.ends)
    orbit = cf.find_orbit(model, {"top": 5.0}, state=[-1.0, 0.0])
    assert orbit.period == pytest.approx(far.period, abs=1e-2)

    def spike(_, y):
        return y[0] - 5.0

    def rates(_, y):
        return [(1.0 + math.exp(2.0 * y[0]) - y[1]) / 36.0, -y[1] / 36.0]

    time, end = met(rates, orbit.begins[0, 1:], spike, rtol=1e-13)
    assert time == pytest.approx(orbit.period, rel=1e-10)
    assert end[1] + 0.1 == pytest.approx(orbit.begins[0, 2], rel=1e-10)
    assert [e.reason.name for e in cf.continue_orbit(orbit, "I", (0.5, 2.0)).ends] == ["RANGE"] * 2


#: A loop with a saw-tooth phase detector, which slips.
LOOP = """
name: loop
states: [theta, z]
parameters: {dw: 2.0, K: 0.5, tau: 5.0}
autonomous: true
surfaces: {slip: {observable: theta, level: pi}}
modes: {runs: {in: {slip: -}, field: {theta: dw - K*z, z: (theta - z)/tau}}}
resets: {slip: {theta: theta - 2*pi}}
"""


def test_a_saw_tooth_of_an_angle_is_a_reset(tmp_path) -> None:
    """One turn is an affine map of z, in a time that the phase decides."""
    model = typed(tmp_path, LOOP)
    assert cf.check_model(model).ok
    orbit = cf.find_orbit(model)
    matrix, rest = np.array([[0.0, -0.5], [0.2, -0.2]]), np.array([4.0, 4.0])

    def after(time: float, z: float) -> np.ndarray:
        return rest + expm(matrix * time) @ (np.array([-math.pi, z]) - rest)

    z, T = fsolve(lambda u: after(u[1], u[0]) - [math.pi, u[0]], [0.0, 3.0], xtol=1e-14)
    assert orbit.period == pytest.approx(T, rel=1e-11)
    assert orbit.ends[0, 2] == pytest.approx(z, abs=1e-11)
    wrong = LOOP.replace("in: {slip: -}, ", "").replace("autonomous", "angles: [theta]\nautonomous")
    wrong = wrong.replace("resets: {slip: {theta: theta - 2*pi}}", "")
    findings = cf.check_model(typed(tmp_path, wrong)).findings
    assert any("a surface 'theta = pi' with a reset" in str(f) for f in findings)
