"""Textbook models as their textbooks write them, against closed forms and scipy."""

from __future__ import annotations

import math

import pytest

import contfric as cf


def typed(tmp_path, text: str) -> cf.Model:
    """Return a model of a file with this text."""
    path = tmp_path / "model.yaml"
    path.write_text(text.lstrip())
    return cf.load_model(path)


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
