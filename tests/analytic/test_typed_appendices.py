"""Models as the appendices of papers write them: numbers by arithmetic, and periods that are too long."""

from __future__ import annotations

import math
import random
from pathlib import Path

import numpy as np
import pytest
from typed import typed

import contfric as cf
from contfric.models.check.period import repeats_sooner
from contfric.models.check.probe import Probe

#: A wall that moves, a force and an impact, each with harmonics of its own.
HARMONICS = """
name: harmonics
states: [x, v]
parameters: {w: 0.7, r: 0.8, a1: 1.0, a2: 0.0, a3: 0.0, a4: 0.0, a6: 0.0, b3: 0.0, b4: 0.0, c2: 0.0, c6: 0.0}
period: 2*pi/w
define: {force: a1*cos(w*t) + a2*sin(2*w*t) + a3*cos(3*w*t) + a4*cos(4*w*t) + a6*sin(6*w*t)}
observables: {gap: x - 1 + b3*sin(3*w*t) + b4*cos(4*w*t)}
surfaces: {wall: {observable: gap}}
modes: {free: {in: {wall: -}, field: {x: v, v: force - 0.1*v - x}}}
resets: {wall: {v: -r*v + c2*cos(2*w*t) + c6*cos(6*w*t)}}
"""
AMPLITUDES = ("a1", "a2", "a3", "a4", "a6", "b3", "b4", "c2", "c6")


def divisor(text: str) -> int:
    """Return by what a report says to divide the period; 1 if it does not."""
    found = text.partition("'period' by ")[2].partition(".")[0]
    return int(found or 1)


def reported(model: cf.Model) -> int:
    """Return the same of a whole check."""
    return divisor(str(cf.check_model(model)))


def test_a_period_that_is_too_long_is_said(tmp_path: Path) -> None:
    """Harmonics of force, wall and impact: the period is too long by their common divisor."""
    model = typed(tmp_path, HARMONICS)
    draw = random.Random(5)
    wanted = []
    for _ in range(40):
        chosen = draw.sample(AMPLITUDES, draw.randint(1, 3))
        params = model.defaults | {
            name: draw.uniform(0.1, 0.5) * (name in chosen) for name in AMPLITUDES
        }
        wanted.append(math.gcd(*(int(name[1:]) for name in chosen)))
        assert divisor(repeats_sooner(Probe(model, params))) == wanted[-1], chosen
    assert {1, 2, 3, 4} <= set(wanted)
    assert (
        divisor(repeats_sooner(Probe(model, model.defaults | dict.fromkeys(AMPLITUDES, 0.0)))) == 1
    )


PARAMETRIC = """
name: parametric
states: [x, v]
parameters: {{w: 1.3, r: 4/5}}
period: {period}
surfaces: {{wall: {{observable: x}}}}
modes: {{free: {{in: {{wall: -}}, field: {{x: v, v: sin(w*t)**2 - 1/2 - 0.1*v - x}}}}}}
resets: {{wall: {{v: -r*v}}}}
"""


def test_a_period_doubling_needs_the_shortest_period(tmp_path: Path) -> None:
    """A square of a sine: multipliers of the longer period are squares, and a doubling is a branch point."""
    short, long = (
        typed(tmp_path, PARAMETRIC.format(period=period)) for period in ("pi/w", "2*pi/w")
    )
    assert (reported(short), reported(long)) == (1, 2)
    orbits = [cf.find_orbit(model) for model in (short, long)]
    once, twice = (np.sort_complex(orbit.multipliers) for orbit in orbits)
    assert np.sort_complex(once**2) == pytest.approx(twice, abs=1e-9)
    branches = [cf.continue_orbit(orbit, "w", (1.3, 1.34)) for orbit in orbits]
    assert [[e.kind.name for e in b.bifurcations] for b in branches] == [["PD"], ["BP"]]
    first, second = (b.bifurcations[0].params["w"] for b in branches)
    assert first == pytest.approx(second, abs=1e-9)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("3*pi/180", 3 * math.pi / 180),
        ("1/3", 1 / 3),
        ("sqrt(3)/2", math.sqrt(3) / 2),
        ("-2**-3", -0.125),
    ],
)
def test_numbers_by_arithmetic(tmp_path: Path, text: str, value: float) -> None:
    """A default may be written as its paper does."""
    alone = typed(tmp_path, PARAMETRIC.format(period="pi/w").replace("4/5", text))
    listed = typed(
        tmp_path,
        PARAMETRIC.format(period="pi/w").replace(
            "4/5", f"{{default: {text}, meaning: restitution}}"
        ),
    )
    assert alone.defaults["r"] == listed.defaults["r"] == value


@pytest.mark.parametrize("text", ["w/2", "1/0", "10m", "'0,5'", "log(-1)"])
def test_what_is_no_number_is_refused(tmp_path: Path, text: str) -> None:
    """Other parameters (these are ties), units, and what has no value."""
    with pytest.raises(
        cf.ModelError, match="the default of 'r' must be a finite number, or one by"
    ):
        typed(tmp_path, PARAMETRIC.format(period="pi/w").replace("4/5", text))
