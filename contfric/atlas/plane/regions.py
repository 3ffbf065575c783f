"""The regions that curves cut a plane into, and the orbits that live in each.

The plane is a grid of cells; those that a curve passes are walls, and what hangs together between walls is
a region. So regions narrower than a cell are not told apart. Orbits are not inferred from rules of
crossing: the one-parameter diagrams along the sections say which branches pass a region, and where two
sections disagree the region says so.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from contfric.atlas.diagram import Diagram
from contfric.atlas.matching import identity_of
from contfric.atlas.plane.plane import Family, Region
from contfric.base.arrays import FloatArray
from contfric.base.interrupts import held_back
from contfric.bvp.system import Itinerary
from contfric.curves.curve import Curve
from contfric.curves.ranges import PlaneRanges
from contfric.models.definition import Model

#: Cells along each side: a cell is finer than a line in a printed figure.
CELLS = 400
#: A region of fewer cells than this is a gap between walls that touch.
_LEAST = 12
#: Points of a branch nearer than this to a wall (cells) may lie on its other side.
_AWAY = 1.5


#: Rows and columns of cells.
Frame = tuple[slice, slice]


@dataclass(frozen=True)
class Living:
    """Orbits of one itinerary in a region; the name does not count, for T changes it."""

    itinerary: Itinerary
    half: bool
    stable: bool
    name: str = field(compare=False)

    @property
    def key(self) -> tuple[Itinerary, bool]:
        """What one name belongs to: the itinerary, and whether the orbits are symmetric."""
        return self.itinerary, self.half


def regions_of(
    model: Model,
    vector: FloatArray,
    box: PlaneRanges,
    curves: Sequence[Curve],
    sections: Sequence[Diagram],
    max_periods: int,
) -> tuple[tuple[Region, ...], NDArray[np.int64]]:
    """Return the regions, largest first, and the number of each cell's (-1 on walls and outside).

    Orbits of more than ``max_periods`` periods, whose curves are not followed, are not listed.
    """
    with held_back():
        from scipy import ndimage

    passed = [cells_of(box, curve) for curve in curves]
    walls = np.zeros((CELLS, CELLS), dtype=np.int64)
    for rows, columns in passed:
        walls[rows, columns] += 1
    inside = _allowed(model, vector, box)
    free = (walls == 0) & inside
    numbers, count = ndimage.label(free)
    sizes = np.bincount(numbers.ravel(), minlength=count + 1)
    kept = [k for k in range(1, count + 1) if sizes[k] >= _LEAST]
    kept.sort(key=lambda k: -sizes[k])
    frames = ndimage.find_objects(numbers)
    cells = np.full(numbers.shape, -1, dtype=np.int64)
    for index, k in enumerate(kept):
        frame = frames[k - 1]
        cells[frame][numbers[frame] == k] = index
    depth = ndimage.distance_transform_edt(np.pad(free, 1))[1:-1, 1:-1]
    shown = [_short(section, max_periods) for section in sections]
    lives = _families(box, shown, cells, depth, len(kept))
    touching = _Touching(passed)
    regions = []
    for index, k in enumerate(kept):
        frame = frames[k - 1]
        mask = cells[frame] == index
        at = np.unravel_index(int(np.argmax(np.where(mask, depth[frame], -1.0))), mask.shape)
        i, j = (int(place) + part.start for place, part in zip(at, frame, strict=True))
        sampled, families, disputed = lives[index]
        share, bounds = float(sizes[k] / cells.size), touching.curves(cells, index, frame)
        regions.append(Region(_centre(box, i, j), share, bounds, families, sampled, disputed))
    return tuple(regions), cells


def _short(section: Diagram, max_periods: int) -> Diagram:
    """Return a section without its longer orbits."""
    kept = tuple(b for b in section.branches if b.system.periods <= max_periods)
    return replace(section, branches=kept)


def cells_of(box: PlaneRanges, curve: Curve) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the cells that a curve passes, without gaps, each once."""
    found = []
    for part in curve.parts:
        at = (part.values - box.low) / box.widths * CELLS
        along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(at, axis=0)).max(axis=1))])
        locations = np.linspace(0.0, along[-1], 2 + int(3.0 * along[-1]))
        found.append(np.column_stack([np.interp(locations, along, at[:, k]) for k in (0, 1)]))
    cells = np.clip(np.concatenate(found).astype(np.int64), 0, CELLS - 1)
    cells = np.unique(cells, axis=0)
    return cells[:, 0], cells[:, 1]


def _allowed(model: Model, vector: FloatArray, box: PlaneRanges) -> NDArray[np.bool_]:
    """Return the cells whose middles obey the model's constraints."""
    params = dict(model.mapping(vector))
    middle = (np.arange(CELLS) + 0.5) / CELLS
    one = box.low[0] + middle * box.widths[0]
    other = box.low[1] + middle * box.widths[1]
    inside = np.ones((CELLS, CELLS), dtype=np.bool_)
    for constraint in model.constraints:
        c = constraint.coefficients
        rest = constraint.value({**params, box.names[0]: 0.0, box.names[1]: 0.0})
        value = rest + c.get(box.names[0], 0.0) * one[:, None] + c.get(box.names[1], 0.0) * other
        inside &= value >= 0.0
    return inside


def _centre(box: PlaneRanges, i: int, j: int) -> dict[str, float]:
    at = box.low + (np.array([i, j]) + 0.5) / CELLS * box.widths
    return {name: float(value) for name, value in zip(box.names, at, strict=True)}


class _Touching:
    """Which curves touch a region.

    Parameters
    ----------
    passed : the cells that each curve passes
    """

    def __init__(self, passed: Sequence[tuple[NDArray[np.int64], NDArray[np.int64]]]) -> None:
        rows, columns = zip(*passed, strict=True) if passed else ((), ())
        self._cells = tuple(np.concatenate([np.empty(0, int), *part]) for part in (rows, columns))
        self._curves = np.repeat(np.arange(len(rows)), [len(row) for row in rows])

    def curves(self, numbers: NDArray[np.int64], index: int, frame: Frame) -> tuple[int, ...]:
        """Return the curves whose cells lie next to those of a region, all of them inside of a frame."""
        with held_back():
            from scipy import ndimage

        wide = tuple(slice(max(0, part.start - 1), part.stop + 1) for part in frame)
        mask = numbers[wide] == index
        rim = np.zeros(numbers.shape, dtype=np.bool_)
        rim[wide] = ndimage.binary_dilation(mask, np.ones((3, 3))) & ~mask
        return tuple(np.unique(self._curves[rim[self._cells]]).tolist())


def _families(
    box: PlaneRanges,
    sections: Sequence[Diagram],
    cells: NDArray[np.int64],
    depth: FloatArray,
    count: int,
) -> list[tuple[bool, tuple[Family, ...], tuple[Family, ...]]]:
    """Return for each region whether a section passes it, what lives there, and what is disputed."""
    seen: list[list[set[Living]]] = [[] for _ in range(count)]
    for section in sections:
        for index, living in _along(box, section, cells, depth):
            seen[index].append(living)
    names = _names(one for sets in seen for living in sets for one in living)
    found = []
    for sets in seen:
        every = set().union(*sets) if sets else set()
        common = set.intersection(*sets) if sets else set()
        found.append((bool(sets), _named(every, names), _named(every - common, names)))
    return found


def _names(orbits: Iterable[Living]) -> dict[tuple[Itinerary, bool], str]:
    """Return the shortest name of the orbits of each itinerary: T changes labels, and nothing else."""
    names: dict[tuple[Itinerary, bool], str] = {}
    for living in orbits:
        known = names.get(living.key, living.name)
        names[living.key] = min(known, living.name, key=lambda name: (len(name), name))
    return names


def _named(orbits: set[Living], names: dict[tuple[Itinerary, bool], str]) -> tuple[Family, ...]:
    return tuple(sorted({Family(names[one.key], one.stable) for one in orbits}))


def _along(
    box: PlaneRanges, section: Diagram, cells: NDArray[np.int64], depth: FloatArray
) -> list[tuple[int, set[Living]]]:
    """Return the stretches of a section in regions, each with the orbits on it."""
    varies = box.names.index(section.parameter)
    fixed = 1 - varies
    value = float(section.branches[0].params[box.names[fixed]][0]) if section.branches else np.nan
    location = int((value - box.low[fixed]) / box.widths[fixed] * CELLS)
    if not 0 <= location < CELLS:
        return []
    line = cells[:, location] if varies == 0 else cells[location, :]
    deep = depth[:, location] if varies == 0 else depth[location, :]
    edges = np.flatnonzero(np.diff(line)) + 1
    stretches = []
    for start, stop in zip([0, *edges.tolist()], [*edges.tolist(), CELLS], strict=True):
        index = int(line[start])
        inner = [k for k in range(start, stop) if deep[k] >= _AWAY]
        if index >= 0 and inner:
            stretches.append((index, _living(box, section, varies, inner[len(inner) // 2])))
    return stretches


def _living(box: PlaneRanges, section: Diagram, varies: int, cell: int) -> set[Living]:
    """Return the orbits at the middle of a cell of a section: of the branches that pass its value."""
    value = box.low[varies] + (cell + 0.5) / CELLS * box.widths[varies]
    found = set()
    for branch in section.branches:
        if branch.mirrored or branch.bridge:
            continue
        itinerary = min(identity_of(branch))
        below = branch.values - value
        for k in np.flatnonzero(below[:-1] * below[1:] <= 0.0):
            stable = branch.stable is not None and bool(branch.stable[k])
            found.add(Living(itinerary, branch.system.half, stable, branch[int(k)].name))
    return found
