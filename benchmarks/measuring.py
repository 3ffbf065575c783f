"""Cases, and their measurement in turns."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from peers.oscillator import Failure

#: A call shorter than this is repeated within its turn until this much time has passed: the clock is then
#: read a hundred times less often than the call is made.
SHORTEST = 5e-3
#: A call shorter than the resolution of the clock counts as this long.
CLOCK = 1e-7

Call = Callable[[], tuple[Any, str]]


@dataclass
class Case:
    """One setting of one method: a call that returns (anything, remark), and the error of that."""

    method: str
    setting: str
    call: Call
    error: Callable[[Any], float]
    units: int = 1


@dataclass
class Row:
    """What was measured: error and remark, or a failure; seconds for one unit."""

    case: Case
    error: float
    remark: str
    failed: bool
    median: float
    least: float


def attempt(case: Case) -> tuple[Any, str, bool]:
    """Return (result, remark, failed)."""
    try:
        return *case.call(), False
    except (Failure, ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
        return None, f"FAILED: {error}", True


def _seconds(case: Case) -> float:
    start = time.perf_counter()
    attempt(case)
    return time.perf_counter() - start


def _repeats(case: Case, first: float) -> int:
    """How often a call is made in one turn; the first, cold call tells whether it is worth a second look."""
    if first > 20 * SHORTEST:
        return 1
    return math.ceil(SHORTEST / max(_seconds(case), CLOCK))


def measure(cases: list[Case], rounds: int) -> list[Row]:
    """Run all cases once (warm-up, result), then in turns."""
    outcomes, repeats = [], []
    for case in cases:
        start = time.perf_counter()
        result, remark, failed = attempt(case)
        took = time.perf_counter() - start
        outcomes.append((math.inf if failed else case.error(result), remark, failed))
        repeats.append(_repeats(case, took))
    seconds: list[list[float]] = [[] for _ in cases]
    for _ in range(rounds):
        for k, case in enumerate(cases):
            start = time.perf_counter()
            for _ in range(repeats[k]):
                attempt(case)
            seconds[k].append((time.perf_counter() - start) / repeats[k] / case.units)
    return [
        Row(case, *outcome, statistics.median(s), min(s))
        for case, outcome, s in zip(cases, outcomes, seconds, strict=True)
    ]
