"""What the kernels count of their work: for this process, and apart for what is computed in advance."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import numpy as np
from numpy.typing import NDArray

#: Added to by the kernels, in the order of the fields of :class:`contfric.base.counts.Counts`.
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
