"""The page on chaos: single points of its tables, and the itineraries that depend on them."""

from __future__ import annotations

import re

import numpy as np
import pytest
from pages import table, text_of

import contfric as cf

PAGE = text_of("gallery/chaos")


def motions(omega: object, S: object, S0: float, confirm: int = 3000) -> cf.LyapunovMap:
    grid = {"Omega": np.atleast_1d(np.asarray(omega)), "S": np.atleast_1d(np.asarray(S))}
    state = [1.0 + 0.9 * S0, 0.0]
    fixed = {"S0": S0}
    return cf.lyapunov_map("coulomb", grid, fixed, state=state, periods=2000, confirm=confirm)


def test_the_band_is_chaotic_inside_and_not_beside() -> None:
    for S, _, ends, _ in table(PAGE, "table: band"):
        low, high = (float(end) for end in ends.split(" to "))
        found = motions([low - 0.01, low, high, high + 0.01], float(S), 0.3)
        assert found.chaotic[:, 0].tolist() == [False, True, True, False]


def test_the_line_at_one_half() -> None:
    found = motions(0.5, [0.03, 0.04, 0.0545, 0.06], 0.4)
    assert found.chaotic[0].tolist() == [True, False, True, False]
    assert "0.0545, a ratio of 7.3" in PAGE


@pytest.mark.parametrize(
    "row",
    [row for row in table(PAGE, "table: maps") if row[1] == "0"],
    ids=lambda row: f"S0={row[0]}",
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
