"""What an ensemble stores of each diagram: its events, and a quantity of its branches at fixed values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from contfric.base.tabled import Coded

Array: TypeAlias = NDArray[Any]


class Drawn(Coded):
    """What became of a sample."""

    COMPLETE = "a whole diagram"
    LIMITED = "cut by a limit (max_branches, max_points)"
    FAILED = "no orbit to begin with was found"
    OUTSIDE = "the model is not defined there"
    MISSING = "not computed"


@dataclass(frozen=True, eq=False)
class Rows:
    """Results of some samples; three tables, of samples, of events and of orbits at the fixed values.

    Attributes
    ----------
    outcomes : codes of :class:`Drawn`; branches, loose : numbers of branches and of loose ends
    reasons : why a sample failed
    event_sample, event_label, event_value : which sample, kind and names of the branches that meet, where
    orbit_sample, orbit_name, orbit_index, orbit_stable, orbit_row : which sample, name of the branch,
        number of the fixed value, 1 stable, 0 unstable, -1 unknown, the quantity
    """

    outcomes: NDArray[np.uint8]
    branches: NDArray[np.int32]
    loose: NDArray[np.int32]
    reasons: NDArray[np.str_]
    event_sample: NDArray[np.int32]
    event_label: NDArray[np.str_]
    event_value: NDArray[np.float64]
    orbit_sample: NDArray[np.int32]
    orbit_name: NDArray[np.str_]
    orbit_index: NDArray[np.int32]
    orbit_stable: NDArray[np.int8]
    orbit_row: NDArray[np.float64]

    @classmethod
    def empty(cls, count: int) -> Rows:
        """Return rows of samples that are not computed."""
        text, whole, number = np.dtype("U1"), np.dtype(np.int32), np.dtype(np.float64)
        return cls(
            np.full(count, Drawn.MISSING.code, dtype=np.uint8),
            np.zeros(count, whole),
            np.zeros(count, whole),
            np.zeros(count, text),
            *(np.zeros(0, kind) for kind in (whole, text, number)),
            *(np.zeros(0, kind) for kind in (whole, text, whole, np.dtype(np.int8), number)),
        )


def joined(parts: Sequence[Rows]) -> Rows:
    """Return the rows of consecutive samples as one; a part counts its samples from 0."""
    starts = np.concatenate([[0], np.cumsum([len(part.outcomes) for part in parts])])[:-1]
    columns = {}
    for field in fields(Rows):
        arrays = [getattr(part, field.name) for part in parts]
        if field.name in ("event_sample", "orbit_sample"):
            arrays = [(a + s).astype(np.int32) for a, s in zip(arrays, starts, strict=True)]
        columns[field.name] = np.concatenate(arrays)
    return Rows(**columns)


def by_sample(samples: Array, count: int) -> Iterator[slice]:
    """Yield the part of a table that belongs to each sample; its rows are in their order."""
    edges = np.searchsorted(samples, np.arange(count + 1))
    for first, last in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        yield slice(first, last)
