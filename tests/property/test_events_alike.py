"""Events at one value of the parameter whose solutions consist of the same passages: which are told apart."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pytest

from contfric.atlas.completeness.degenerate import _ALIKE, _alike
from contfric.base.arrays import FloatArray
from contfric.events.incident.sequences import necklaces
from contfric.orbit.canonical.slides import Outline

CYCLE = 7.0


@dataclass(frozen=True)
class Located:
    """What is asked of an event."""

    outline: Outline


def outline(passages: list[FloatArray]) -> Outline:
    """The solution of passages of one period each, one after the other; its image has the other sign."""
    starts = np.vstack(passages)
    images = starts * (1.0, -1.0, -1.0)
    images[:, 0] = (images[:, 0] + 0.5 * CYCLE) % CYCLE
    return Outline(len(passages), CYCLE, starts, images)


def drawn(rng: np.random.Generator, slides: int) -> FloatArray:
    """A random passage with some slides."""
    times = np.sort(rng.uniform(0.0, CYCLE, slides))
    return np.column_stack([times, rng.uniform(-1.0, 1.0, (slides, 2))])


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("slides", [(3, 3), (3, 4), (2, 5)])
def test_other_sequences_of_passages_are_other_solutions(
    seed: int, slides: tuple[int, int]
) -> None:
    """Two passages with the same stops in all: only rotations of one sequence are one solution."""
    rng = np.random.default_rng(seed)
    passages = [drawn(rng, count) for count in slides]
    sequences = [s for length in (1, 2, 3, 4) for s in necklaces(2, length)]
    found = {s: Located(outline([passages[k] for k in s])) for s in sequences}
    for one, other in combinations(sequences, 2):
        assert not _alike(found[one], found[other]), (one, other)  # type: ignore[arg-type]
    for sequence in sequences:
        turned = sequence[1:] + sequence[:1]
        again = Located(outline([passages[k] for k in turned]))
        assert _alike(found[sequence], again)  # type: ignore[arg-type]


@pytest.mark.parametrize("seed", range(20))
def test_a_slide_left_out_is_the_same_solution(seed: int) -> None:
    """One has a slide more, in the order of the other: they are not told apart, nor are their images."""
    rng = np.random.default_rng(seed)
    passages = [drawn(rng, 4), drawn(rng, 5)]
    whole = outline(passages)
    kept = np.sort(rng.choice(9, 8, replace=False))
    noise = 0.3 * _ALIKE * rng.uniform(-1.0, 1.0, (8, 3))
    for starts in (whole.starts, whole.images):
        fewer = np.roll(starts[kept] + noise, int(rng.integers(8)), axis=0)
        less = Outline(2, CYCLE, fewer, fewer)
        assert _alike(Located(whole), Located(less))  # type: ignore[arg-type]
        assert _alike(Located(less), Located(whole))  # type: ignore[arg-type]
    swapped = whole.starts[kept][[1, 0, *range(2, 8)]]
    assert not _alike(Located(whole), Located(Outline(2, CYCLE, swapped, swapped)))  # type: ignore[arg-type]
