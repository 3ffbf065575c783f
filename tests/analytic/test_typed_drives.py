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


CAPSULE = """
name: capsule
states: [r, y1, y2]
parameters: {w: 0.95, a: 1.5, zeta: 0.01, delta: 0.02, beta: 15.0, g: 2.5, f: 1.0}
period: 2*pi/w
define: {k: "2*zeta*(y2 - y1) - r - where(r > delta, beta*(r - delta), 0)"}
surfaces:
  contact: {observable: r, level: delta}
  slide: {observable: y2, sliding: filippov}
field: {r: y1 - y2, y1: a*cos(w*t) + k, y2: (-f*sign(y2) - k)/g}
"""
CRAWLS = """
name: crawls
states: [x1, x2, y1, y2]
parameters: {w: 0.95, a: 1.5, zeta: 0.1, g: 2.5, f: 1.0, slope: 0.3}
period: 2*pi/w
define: {k: 2*zeta*(y2 - y1) - x1 + x2}
surfaces: {slide: {observable: y2, sliding: filippov}}
field: {x1: y1, x2: y2, y1: a*cos(w*t) + k, y2: (slope - f*sign(y2) - k)/g}
"""


def test_what_crawls_is_told_to_be_written_by_its_relative_position(tmp_path: Path) -> None:
    """The capsule of Liu, Wiercigroch and Pavlovskaia (2013) on a slope: it was called resonance."""
    model = typed(tmp_path, CRAWLS)
    (found,) = cf.check_model(model).findings
    assert "the same at x1 + c, x2 + c, whatever c is" in str(found)
    with pytest.raises(cf.ConvergenceError, match=r"moves on .* x1 \+ c, x2 \+ c"):
        cf.find_orbit(model)


def crawled(params: dict[str, float], start: tuple[float, ...], span: float) -> list[float]:
    """Return (r, y1, y2) after a time, from one in which the capsule moves: from event to event."""
    w, a, zeta, delta, beta, g, f = (
        params[n] for n in ("w", "a", "zeta", "delta", "beta", "g", "f")
    )

    def pull(y: list[float]) -> float:
        return 2.0 * zeta * (y[2] - y[1]) - y[0] - (beta * (y[0] - delta) if y[0] > delta else 0.0)

    t, y, end = start[0], list(start[1:]), start[0] + span
    way = math.copysign(1.0, y[2])
    while t < end:

        def rates(t: float, y: list[float], way: float = way) -> list[float]:
            k = pull(y)
            return [y[1] - y[2], a * math.cos(w * t) + k, (-f * way - k) / g if way else 0.0]

        events = [lambda _, y: abs(pull(y)) - f] if way == 0.0 else [lambda _, y: y[2]]
        events[0].terminal, events[0].direction = True, 1.0 if way == 0.0 else -way
        tight = {"rtol": 1e-10, "atol": 1e-11, "max_step": 0.01}
        found = solve_ivp(rates, (t, end), y, events=events, **tight)
        t, y = found.t[-1], found.y[:, -1].tolist()
        if t < end:
            y[2] = 0.0
            force = -pull(y)
            way = math.copysign(1.0, force) if way == 0.0 or abs(force) > f else 0.0
    return y


@pytest.mark.parametrize(("beta", "low"), [(15.0, 1.5), (40.0, 1.1)])
def test_a_capsule_slips_through_where_rest_is_passed(
    tmp_path: Path, beta: float, low: float
) -> None:
    """In contact no state is near the lower limit of rest: what is there was told from out of contact.

    The event at which the capsule rests no more was GS on one of its branches, and CS on the other.
    """
    model = typed(tmp_path, CAPSULE)
    orbit = cf.find_orbit(model, {"beta": beta, "a": 1.7})
    start = next(j for j in orbit.joints if abs(j[3]) > 1e-3)
    assert crawled(orbit.params, start, orbit.period) == pytest.approx(start[1:], abs=1e-6)
    diagram = cf.explore(orbit, "a", (low, 1.8))
    assert {b.kind for b in diagram.bifurcations} == {cf.Kind.CS}
    assert diagram.verify().same
