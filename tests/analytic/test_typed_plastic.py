"""Plastic impacts: what hits a wall and stays there, until the force of the wall vanishes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from typed import typed

import contfric as cf

#: T. Gilet, N. Vandewalle, S. Dorbolo, Completely inelastic ball, Phys. Rev. E 79 (2009) 055201.
BALL = """
name: ball
states: [y, v]
parameters: {{a: {a}, g: {g}, w: {w}}}
period: 2*pi/w
surfaces: {{table: {{observable: y - a*sin(w*t)}}}}
modes: {{flight: {{in: {{table: +}}, field: {{y: v, v: -g}}}}}}
resets: {{table: {{v: a*w*cos(w*t), chatter: true}}}}
"""


@pytest.mark.parametrize("share", [1.2, 2.0, 3.1])
def test_a_ball_that_does_not_bounce(tmp_path: Path, share: float) -> None:
    draw = np.random.default_rng(round(10 * share))
    g, w = float(draw.uniform(0.5, 2.0)), float(draw.uniform(0.6, 1.6))
    a = share * g / w**2
    model = typed(tmp_path, BALL.format(a=a, g=g, w=w))
    assert cf.check_model(model).ok
    orbit = cf.find_orbit(model)
    left = np.arcsin(1.0 / share) / w  # the table falls faster than the ball
    speed = a * w * np.cos(w * left)

    def gap(lasts: float) -> float:
        return g / w**2 + speed * lasts - 0.5 * g * lasts**2 - a * np.sin(w * (left + lasts))

    lasts = brentq(gap, 0.5 * speed / g, 2.0 * speed / g + 4.0 * np.sqrt(a / g), xtol=1e-14)
    rests = [k for k, (mode, _) in enumerate(orbit.itinerary) if mode == "chatter"]
    assert orbit.durations[rests] == pytest.approx([2.0 * np.pi / w - lasts], abs=1e-9)


@pytest.mark.parametrize("case", range(3))
def test_rest_on_a_table_ends_where_it_has_no_duration(tmp_path: Path, case: int) -> None:
    draw = np.random.default_rng(case)
    g, w = float(draw.uniform(0.5, 2.0)), float(draw.uniform(0.6, 1.6))
    unit = g / w**2
    model = typed(tmp_path, BALL.format(a=draw.uniform(2.0, 3.0) * unit, g=g, w=w))
    branch = cf.continue_orbit(cf.find_orbit(model), "a", (1.5 * unit, 4.0 * unit))
    # it leaves the table at sin(w*t) = 1/share with the table's speed, and is back after a whole period
    last = branch.bifurcations[-1]
    assert last.params["a"] == pytest.approx(np.sqrt(1.0 + np.pi**2) * unit, rel=1e-9)
    assert branch.values[-1] == last.params["a"]
    assert all(orbit.admissible for orbit in branch)


FLOOR = """
name: floor
coordinates: [q]
parameters: {w: 0.7, e: 0.0}
period: 2*pi/w
mass: identity
damping: 0.1
stiffness: 1
force: {q: cos(w*t)}
contacts: {floor: {kind: impact, gap: 0.3 + q, restitution: e, chatter: true}}
"""


@pytest.mark.parametrize("e", [0.0, 0.4])
def test_a_restitution_of_0_is_no_fault(tmp_path: Path, e: float) -> None:
    assert cf.check_model(typed(tmp_path, FLOOR), {"e": e}).ok


def test_what_goes_on_into_its_wall_is_a_fault(tmp_path: Path) -> None:
    text = BALL.replace("a*w*cos(w*t), chatter: true", "1.2*v").format(a=1.0, g=1.0, w=1.0)
    found = cf.check_model(typed(tmp_path, text))
    assert not found.ok and "still runs into the surface 'table'" in str(found)
