"""What ``check`` says of models with one fault each, whose numbers are drawn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import contfric as cf
from contfric.models.check import Topic

DRIVEN = """
name: driven
states: [x, v]
parameters: {{w: 0.9}}
period: 2*pi/w
surfaces: {{s: {{observable: "{observable}", level: {level}}}}}
modes:
  above: {{in: {{s: +}}, field: {{x: v, v: cos(w*t) - x - 0.1*v}}}}
  below: {{in: {{s: -}}, field: {{x: v, v: cos(w*t) - 2*x - 0.1*v}}}}
"""


def said(tmp_path: Path, text: str) -> dict[Topic, list[str]]:
    """What a check says, by topic."""
    file = tmp_path / "model.yaml"
    file.write_text(text, encoding="utf-8")
    found: dict[Topic, list[str]] = {}
    for finding in cf.check_model(file).findings:
        found.setdefault(finding.topic, []).append(str(finding))
    return found


@pytest.mark.parametrize("seed", range(2))
def test_an_observable_that_jumps_over_its_level(tmp_path: Path, seed: int) -> None:
    at, jump = np.random.default_rng(seed).uniform((-0.5, 0.5), (0.5, 1.5))
    observable = f"x + where(x > {at}, {jump}, 0)"
    found = said(tmp_path, DRIVEN.format(observable=observable, level=at + 0.5 * jump))
    assert any(
        m.startswith("error") and "jumps by" in m and "no solution is ever" in m
        for m in found[Topic.CONTINUITY]
    )
    # beside the level it is a jump inside of a mode; without one there is nothing to say
    plain = said(tmp_path, DRIVEN.format(observable=f"x + abs(x - {at})", level=at + 1.0))
    assert Topic.CONTINUITY not in plain


@pytest.mark.parametrize("seed", range(2))
def test_a_surface_at_a_double_root(tmp_path: Path, seed: int) -> None:
    at, size = np.random.default_rng(seed).uniform((-0.5, 0.1), (0.5, 10.0))
    found = said(tmp_path, DRIVEN.format(observable=f"{size}*(x - {at})**2", level=0))
    assert any("the gradient of" in m for m in found[Topic.SURFACES])
    crossed = said(tmp_path, DRIVEN.format(observable=f"(x - {at})*({size} + x**2)", level=0))
    assert Topic.SURFACES not in crossed


def test_a_mode_that_no_solution_comes_into(tmp_path: Path) -> None:
    far = said(tmp_path, DRIVEN.format(observable="x", level=40.0))
    assert any("simulations came into mode 'above'" in m for m in far[Topic.REACHED])
    near = said(tmp_path, DRIVEN.format(observable="x", level=0.1))
    assert Topic.REACHED not in near


#: Rest is held for almost no load: solutions pass v = 0.
HARDLY_HELD = """
name: held
states: [x, v]
parameters: {{w: 0.9, a: 2.0, S: 0.2, H: 1e-7}}
period: 2*pi/w
observables: {{pull: a*cos(w*t) - x}}
surfaces: {{v: {{observable: v}}, up: {{observable: pull, level: H}}, down: {{observable: pull, level: -H}}}}
modes:
  up: {{in: {{v: +}}, field: {{x: v, v: pull - S - 0.1*v}}}}
  down: {{in: {{v: -}}, field: {{x: v, v: pull + S - 0.1*v}}}}
  {rest}: {{in: {{v: 0, up: -, down: +}}, field: {{x: 0, v: 0}}}}
"""


@pytest.mark.parametrize("rest", ["rest", "slide"])
def test_a_mode_of_rest_that_no_solution_comes_into(tmp_path: Path, rest: str) -> None:
    """Whatever its name is: only modes that contfric derives are not spoken of."""
    found = said(tmp_path, HARDLY_HELD.format(rest=rest))
    assert any(f"simulations came into mode '{rest}'" in m for m in found[Topic.REACHED])


TWO_SIDES = """
name: sides
states: [x, v]
parameters: {{a: {a}}}
autonomous: true
surfaces: {{right: {{observable: x, level: a}}, left: {{observable: x, level: -a}}}}
field: {{x: v, v: -x}}
modes: {{r: {{in: {{right: +}}}}, l: {{in: {{left: -}}}}}}
"""


def test_solutions_that_all_end(tmp_path: Path) -> None:
    """Nothing is between the two modes: each solution comes to where no mode holds, wherever it starts."""
    found = said(tmp_path, TWO_SIDES.format(a=np.random.default_rng(0).uniform(0.2, 1.0)))
    assert sum(m.startswith("error") for m in found[Topic.TRANSITIONS]) == 2


CIRCUIT = """
name: circuit
states: [q, i]
parameters: {{L: {L:.6e}, C: {C:.6e}, R: {R:.6e}, E: 2.0, w: {w:.6e}}}
period: 2*pi/w
surfaces: {{s: {{observable: q}}}}
modes:
  on: {{in: {{s: -}}, field: {{q: i, i: (E*cos(w*t) - q/C - R*i)/L}}}}
  off: {{in: {{s: +}}, field: {{q: i, i: (E*cos(w*t) - 2*q/C - R*i)/L}}}}
"""


@pytest.mark.parametrize("seed", range(2))
def test_units_are_proposed_whatever_the_scales(tmp_path: Path, seed: int) -> None:
    draw = np.random.default_rng(seed)
    inductance, capacity = 10.0 ** draw.uniform((-7, -8), (-5, -6))
    w = 0.7 / np.sqrt(inductance * capacity)
    resistance = 0.1 * np.sqrt(inductance / capacity)
    text = CIRCUIT.format(L=inductance, C=capacity, R=resistance, w=w)
    (warning,) = [m for m in said(tmp_path, text)[Topic.SCALES] if m.startswith("warning")]
    units = dict(pair.split(": ") for pair in warning[warning.rindex("{") + 1 : -1].split(", "))
    charge = abs(2.0 / (1.0 / capacity - inductance * w**2 + 1j * w * resistance))
    assert float(units["q"]) == pytest.approx(charge, rel=0.5)
    assert float(units["t"]) == pytest.approx(1.0 / w, rel=0.5)


def test_times_that_are_far_apart(tmp_path: Path) -> None:
    heated = DRIVEN.format(observable="x", level=0.1).replace("[x, v]", "[x, v, h]")
    hot = said(tmp_path, heated.replace("*v}", "*v, h: 1.0e+8*v**2 - h}"))
    assert any("times of change" in m and "'h'" in m for m in hot[Topic.SCALES])
    warm = said(tmp_path, heated.replace("*v}", "*v, h: v**2 - h}"))
    assert Topic.SCALES not in warm


def test_a_kink_is_said_once(tmp_path: Path) -> None:
    text = """
name: bent
states: [x, v]
parameters: {w: 0.9}
period: 2*pi/w
field: {x: v, v: cos(w*t) - x - 0.1*v - 0.3*abs(x - 0.2)}
"""
    assert len(said(tmp_path, text)[Topic.KINKS]) == 1
