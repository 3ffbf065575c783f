"""What goes round and what moves on, as textbooks write it: a junction, a robot; against scipy."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from scipy.integrate import solve_ivp
from typed import typed

import contfric as cf

JUNCTION = """
name: junction
states: [phi, v]
parameters: {I: 0.8, beta: 4.0}
autonomous: true
angles: [phi]
surfaces:
  up: {observable: phi, level: LOW}
  down: {observable: phi, level: HIGH}
modes:
  one: {in: {down: -, up: -}, field: {phi: v, v: (I - v - ONE)/beta}}
  two: {in: {down: -, up: +}, field: {phi: v, v: (I - v - TWO)/beta}}
  three: {in: {down: +, up: +}, field: {phi: v, v: (I - v - THREE)/beta}}
"""
#: A current that is a triangle of the phase, where the phase is written from -pi on, and from 0 on.
TURNS = {
    "from -pi": ("-pi/2", "pi/2", "2*(-pi - phi)/pi", "2*phi/pi", "2*(pi - phi)/pi"),
    "from 0": ("pi/2", "3*pi/2", "2*phi/pi", "2*(pi - phi)/pi", "2*(phi - 2*pi)/pi"),
}


def written(low: str, high: str, *currents: str) -> str:
    """Return the file of a junction."""
    text = JUNCTION.replace("LOW", low).replace("HIGH", high)
    for name, current in zip(("ONE", "TWO", "THREE"), currents, strict=True):
        text = text.replace(name, current)
    return text


@pytest.mark.parametrize("turn", TURNS)
def test_modes_of_an_angle_hold_within_one_turn(tmp_path: Path, turn: str) -> None:
    """Each piece of the current is a formula of its own part of the turn: no fault, it was said to be one."""
    model = typed(tmp_path, written(*TURNS[turn]))
    assert cf.check_model(model).ok
    orbit = cf.find_orbit(model, state=(0.0, 2.0))
    _, phi, v = orbit.joints[0]
    found = solve_ivp(
        lambda _, y: [y[1], (0.8 - y[1] - 2.0 / math.pi * math.asin(math.sin(y[0]))) / 4.0],
        (0.0, orbit.period),
        (phi, v),
        rtol=1e-10,
        atol=1e-11,
        max_step=0.02,
    )
    assert found.y[:, -1] == pytest.approx([phi + 2.0 * math.pi, v], abs=1e-6)


@pytest.mark.parametrize("turn", TURNS)
def test_pieces_that_do_not_meet_after_a_turn_are_refused(tmp_path: Path, turn: str) -> None:
    """The last piece is wrong by a little, which is a jump where the angle begins again."""
    *others, last = TURNS[turn]
    findings = cf.check_model(typed(tmp_path, written(*others, f"{last} + 0.1"))).findings
    assert any("that is no angle" in str(f) for f in findings)
