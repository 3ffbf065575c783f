"""Modes that overlap: of two switches a single one changes; else which mode follows has to be said."""

from __future__ import annotations

from itertools import permutations, product
from pathlib import Path

import numpy as np
import pytest
from typed import typed

import contfric as cf

#: (first heater, second heater) of each mode.
SWITCHES = tuple(product("01", repeat=2))


def rooms(rng: np.random.Generator, order: tuple[int, ...]) -> tuple[str, dict[str, float]]:
    """Return the file of two rooms with thermostats, and its parameters; modes in some order."""
    names = ("q1", "q2", "a", "k", "l1", "h1", "l2", "h2")
    low, high = (6, 6, 0.2, 0.1, 18, 20.5, 18, 20.5), (9, 9, 0.4, 0.6, 19.5, 22, 19.5, 22)
    p = dict(zip(names, rng.uniform(low, high).tolist(), strict=True))
    modes = ""
    for one, two in (SWITCHES[i] for i in order):
        sides = (
            f"{'hot1: -' if one == '1' else 'cold1: +'}, {'hot2: -' if two == '1' else 'cold2: +'}"
        )
        field = f"x: {one}*q1 - a*x - k*(x - y) + 1.5, y: {two}*q2 - a*y - k*(y - x) + 1.5"
        modes += f"  m{one}{two}: {{in: {{{sides}}}, field: {{{field}}}}}\n"
    return (
        f"name: rooms\nstates: [x, y]\nparameters: {p}\nautonomous: true\nsurfaces:\n  hot1: {{observable: "
        "x, level: h1}\n  cold1: {observable: x, level: l1}\n  hot2: {observable: y, level: h2}\n  cold2: "
        f"{{observable: y, level: l2}}\nmodes:\n{modes}spread: {{x: 22, y: 22}}\n"
    ), p


@pytest.mark.parametrize("seed", range(3))
def test_one_of_two_switches_changes(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    order = list(permutations(range(4)))[int(rng.integers(24))]
    text, _ = rooms(rng, order)
    motion = cf.simulate(typed(tmp_path, text), state=[17.0, 17.5], periods=200, events=60)
    assert len(motion) > 10
    names = [mode for mode, _ in motion.itinerary]
    for (mode, surface), after in zip(motion.itinerary, names[1:], strict=False):
        changed = [k for k in (0, 1) if mode[1 + k] != after[1 + k]]
        assert changed == [int(surface[-1]) - 1], (mode, surface, after)


def gated(seed: int) -> tuple[str, str]:
    """Return a file in which two modes hold behind a surface, in either of which motion may turn back."""
    rng = np.random.default_rng(seed)
    rates = {mode: float(rng.uniform(0.2, 1.0) * rng.choice([-1, 1])) for mode in ("up", "down")}
    named = str(rng.choice(["up", "down"]))
    modes = [
        "  low: {in: {big: -}, field: {x: -x, y: 1 + cos(t)/9}}\n",
        f"  up: {{in: {{left: +}}, field: {{x: -1, y: {rates['up']!r}}}}}\n",
        f"  down: {{in: {{right: -}}, field: {{x: 1, y: {rates['down']!r}}}}}\n",
    ]
    order = rng.permutation(3)
    return (
        f"name: gated\nstates: [x, y]\nparameters: {{c: {float(rng.uniform(0.2, 0.8))!r}}}\nperiod: "
        "2*pi\nsurfaces:\n  big: {observable: y, level: c}\n  left: {observable: x, level: -1}\n  right: "
        f"{{observable: x, level: 1}}\nmodes:\n{''.join(modes[i] for i in order)}resets:\n  left: {{to: "
        "[low, down], from: [up]}\n  right: {to: [low, up], from: [down]}\n"
    ), named


@pytest.mark.parametrize("seed", range(5))
def test_which_of_two_modes_follows_has_to_be_said(tmp_path: Path, seed: int) -> None:
    """Where the one that came first in the file turned back it was chosen without a word."""
    text, named = gated(seed)
    with pytest.raises(cf.ModelError, match=r"meets 'big' in 'low.*' could go on in down or up"):
        typed(tmp_path, text)
    model = typed(tmp_path, f"{text}  big: {{to: {named}, from: [low]}}\n")
    motion = cf.simulate(model, state=[0.0, 0.0], domain="low:x0", periods=1, events=2)
    assert [model.whole_mode(mode) for mode, _ in motion.itinerary] == ["low", named]
