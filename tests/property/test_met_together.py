"""Solutions that meet two surfaces together: genes that switch each other, followed in closed form."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from typed import typed

import contfric as cf

THRESHOLD, NAMES = 0.4, "xyz"
Side = tuple[bool, ...]


def model_of(folder: Path, table: dict[Side, list[float]]) -> cf.Model:
    """Return the model: each gene decays to a value that the sides of all genes say."""
    modes = ""
    for sides, to in table.items():
        where = ", ".join(f"{n}: {'-+'[s]}" for n, s in zip(NAMES, sides, strict=True))
        field = ", ".join(f"{n}: {v!r} - {n}" for n, v in zip(NAMES, to, strict=True))
        name = "".join(str(int(s)) for s in sides)
        modes += f"  m{name}: {{in: {{{where}}}, field: {{{field}}}}}\n"
    surfaces = ", ".join(f"{n}: {{observable: {n}, level: {THRESHOLD}}}" for n in NAMES)
    return typed(
        folder,
        f"name: genes\nstates: [x, y, z]\nparameters: {{a: 1}}\nautonomous: true\n"
        f"surfaces: {{{surfaces}}}\nmodes:\n{modes}\n",
    )


def followed(table: dict[Side, list[float]], y: np.ndarray, end: float) -> np.ndarray | None:
    """Return the state after some time, from crossing to crossing; None if the solution is caught."""
    y, sides, t = y.copy(), tuple(bool(v > THRESHOLD) for v in y), 0.0
    for _ in range(1000):
        to = np.array(table[sides])
        with np.errstate(all="ignore"):
            times = np.log((to - y) / (to - THRESHOLD))
        times[[(v > THRESHOLD) == s for v, s in zip(to, sides, strict=True)]] = math.inf
        k = int(np.argmin(times))
        step = min(float(times[k]), end - t)
        y, t = to + (y - to) * math.exp(-step), t + step
        if t >= end:
            return y
        y[k] = THRESHOLD
        sides = tuple(not s if i == k else s for i, s in enumerate(sides))
        if (table[sides][k] > THRESHOLD) != sides[k]:
            return None
    return None


@pytest.mark.parametrize("seed", range(3))
def test_two_genes_that_switch_together(tmp_path: Path, seed: int) -> None:
    draw, seen = np.random.default_rng(seed), 0
    for _ in range(4):
        rules = draw.integers(0, 2, (3, 2, 2))  # of each gene, by the sides of the two others
        table = {
            sides: [float(rules[i][tuple(map(int, sides[:i] + sides[i + 1 :]))]) for i in range(3)]
            for sides in itertools.product([False, True], repeat=3)
        }
        model = model_of(tmp_path, table)
        for sides, to in table.items():
            toward = [i for i in range(3) if (to[i] > THRESHOLD) != sides[i]]
            for pair in itertools.combinations(toward, 2):
                third = 3 - sum(pair)
                corner = np.full(3, THRESHOLD)
                corner[third] = THRESHOLD + (0.2 if sides[third] else -0.2)
                before = float(draw.uniform(0.1, 0.3))
                start = np.array(to) + (corner - to) * math.exp(before)
                if (start[third] > THRESHOLD) != sides[third]:
                    continue
                near = [followed(table, start + d, 3.0) for d in 1e-9 * draw.normal(size=(20, 3))]
                if any(y is None or np.abs(y - near[0]).max() > 1e-7 for y in near):
                    continue  # which comes first decides, or a solution is caught
                found = cf.simulate(model, state=start, periods=3.0)
                assert found.end == "the time asked for was reached"
                np.testing.assert_allclose(found.last[2], near[0], atol=1e-7)
                seen += 1
    assert seen
