"""Two switches with hysteresis each: of modes that overlap, the one in which a single switch has changed."""

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
        f"name: rooms\nstates: [x, y]\nparameters: {p}\nautonomous: true\nsurfaces:\n"
        "  hot1: {observable: x, level: h1}\n  cold1: {observable: x, level: l1}\n"
        "  hot2: {observable: y, level: h2}\n  cold2: {observable: y, level: l2}\n"
        f"modes:\n{modes}spread: {{x: 22, y: 22}}\n"
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
