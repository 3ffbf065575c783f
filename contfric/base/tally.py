"""Counts of the work of the kernels, for this process, and separately for what is computed in advance.

A run reports the counts, and tests hold that nothing else was computed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

#: Added to by the kernels, in the order of the fields of :class:`Counts`.
_ALL = np.zeros(4, dtype=np.int64)
_HERE: ContextVar[NDArray[np.int64]] = ContextVar("contfric_tally", default=_ALL)


def tally() -> NDArray[np.int64]:
    """Return the counts that kernels add to here, shape (4,)."""
    return _HERE.get()


@contextmanager
def count_apart() -> Iterator[Callable[[], None]]:
    """Count what the block does apart; what is yielded adds it to the counts of who calls it."""
    own = np.zeros_like(_ALL)
    token = _HERE.set(own)
    try:
        yield lambda: add(own)
    finally:
        _HERE.reset(token)


def add(more: NDArray[np.int64]) -> None:
    """Add to the counts."""
    here = tally()
    np.add(here, more, out=here)


@dataclass(frozen=True)
class Counts:
    """How often each kind of work was done."""

    newton_solves: int = 0
    multiplier_evaluations: int = 0
    admissibility_checks: int = 0
    simulated_events: int = 0

    def __sub__(self, other: Counts) -> Counts:
        return Counts(*(a - b for a, b in zip(astuple(self), astuple(other), strict=True)))


def counts() -> Counts:
    """Return the counts of this process so far; subtract two of them to get those of a run."""
    return Counts(*(int(value) for value in tally()))
