"""The page on chaos: single points of its tables, and the itineraries that depend on them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import contfric as cf

PAGE = (Path(__file__).parents[2] / "docs" / "gallery" / "chaos.md").read_text(encoding="utf-8")


def motions(omega: object, S: object, S0: float, confirm: int = 3000) -> cf.LyapunovMap:
    grid = {"Omega": np.atleast_1d(np.asarray(omega)), "S": np.atleast_1d(np.asarray(S))}
    state = [1.0 + 0.9 * S0, 0.0]
    fixed = {"S0": S0}
    return cf.lyapunov_map("coulomb", grid, fixed, state=state, periods=2000, confirm=confirm)


def table(name: str) -> list[list[str]]:
    found = re.search(rf"<!-- table: {name} -->\n(.*?)\n<!-- end -->", PAGE, re.DOTALL)
    assert found is not None
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in found[1].splitlines()]
    return rows[2:]


def test_the_band_is_chaotic_inside_and_not_beside() -> None:
    for S, _, ends, _ in table("band"):
        low, high = (float(end) for end in ends.split(" to "))
        found = motions([low - 0.01, low, high, high + 0.01], float(S), 0.3)
        assert found.chaotic[:, 0].tolist() == [False, True, True, False]


def test_the_line_at_one_half() -> None:
    found = motions(0.5, [0.03, 0.04, 0.0545, 0.06], 0.4)
    assert found.chaotic[0].tolist() == [True, False, True, False]
    assert "0.0545, a ratio of 7.3" in PAGE


@pytest.mark.parametrize(
    "row", [row for row in table("maps") if row[1] == "0"], ids=lambda row: f"S0={row[0]}"
)
def test_no_chaos_far_above_the_largest_friction_of_chaos(row: list[str]) -> None:
    S0, largest = float(row[0]), float(row[3])
    beyond = np.linspace(largest, S0, 6)[2:]
    assert not motions(np.linspace(0.1, 0.9, 9), beyond, S0, 0).chaotic.any()
    assert "| **nearly** |" in PAGE


def test_every_statement_has_a_verdict() -> None:
    verdicts = re.findall(r"\| \*\*(.*?)\*\* \|", PAGE)
    assert len(verdicts) == 12
    assert {"yes", "nearly", "mostly", "not as a whole"} <= set(verdicts)
