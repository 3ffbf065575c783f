"""The search on one section: cells near a return are handed to Newton, and halved until they are decided.

A cell is **torn** if it is mixed (a discontinuity goes through it, and orbits may lie on either side), or
near while the gaps at its corners differ by more than a return may within a cell. It is halved

* if it is torn; on sections of dimension above one Newton is started from its corners, too, as
  its solutions reach across the discontinuity;
* if it is near, and Newton, started in it, found no orbit in it or next to it (or several);
* if it is near one orbit, but the gaps at the corners do not fit to that: on a section of dimension
  one the slope of the gap at a fixed point is its multiplier less 1, so that the gaps at both
  corners are known from it. On other sections, until the cell is small.

What is left at the smallest size is a discontinuity, if the cell is torn; or a place where the map nearly
has a fixed point, which is reported.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray, IntArray
from contfric.bvp.system import build_system
from contfric.censuses.asked import Findings, Mesh, Wanted
from contfric.censuses.cells import (
    Cells,
    Near,
    closing_nodes,
    common_events,
    halved,
    make_cells,
    near_cells,
)
from contfric.censuses.grid import Grid
from contfric.censuses.orbits import Catalogue
from contfric.censuses.result import SectionSearch
from contfric.orbit.itinerary.itineraries import whole_of
from contfric.orbit.orbit import Orbit, Status
from contfric.orbit.solve import refine
from contfric.remember.journal import remembered
from contfric.signature import ReducedItinerary

Progress = Callable[[str], None]
#: Largest difference of a return within a cell that Newton is started in: in time (periods), and in
#: position as part of the box. The maps bend over about a tenth of either.
_COARSE = 0.05
#: Gaps that are all this small are a continuum of orbits: one of them is enough.
_FLAT = 1e-10
#: Deviation of a gap from the line through a fixed point, relative to its value there, in a cell that
#: holds no other fixed point: with a deviation of 1 there could be another one at the corner.
_BENT = 0.5
#: Largest gap near a fixed point, in sizes of a cell from it: what a return stretches distances by,
#: where discontinuities do not let the cell itself show it.
_STRETCH = 16.0
#: Fixed points of one itinerary nearer than this (relative) are one: rounding over a slope of 1e-5.
_SAME = 1e-10
#: Gap that is rounding, where a line is asked for.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Root:
    """A fixed point of an itinerary's map: coordinates on the section and, in one dimension, its slope."""

    at: FloatArray
    slope: float | None


@dataclass(eq=False)
class Search:
    """The search on one section.

    Attributes
    ----------
    wanted : which itineraries (itinerary, periods) may have an orbit
    most : number of starts at which it ends
    jumps, open : discontinuities, and near returns without an orbit, that are left at the smallest size
    """

    grid: Grid
    mesh: Mesh
    catalogue: Catalogue
    wanted: Wanted
    most: int
    progress: Progress | None = None
    jumps: int = 0
    open: int = 0
    solves: int = 0
    complete: bool = True
    roots: dict[tuple[tuple[int, ...], int, bool], list[Root]] = field(default_factory=dict)
    _tried: set[tuple[int, int, int, bool]] = field(default_factory=set)

    def run(self) -> None:
        """Search the whole section."""
        level = self.mesh.coarse
        cells = make_cells(self.grid, self._first_cells(), 1 << (self.grid.bits - level))
        while len(cells):
            self._say(level, len(cells))
            if self.grid.count > self.most:
                self.complete = False
                return
            chosen = self._judge(cells, level)
            cells, level = halved(self.grid, cells, chosen), level + 1

    def findings(self) -> Findings:
        """Return what was found so far."""
        grid, mesh, dimension = self.grid, self.mesh, self.grid.section.dimension
        done = SectionSearch(
            section=str(grid.section),
            dimension=dimension,
            first=0.5**mesh.coarse,
            last=0.5 ** max(mesh.torn, mesh.near),
            reach=grid.reach if dimension > 1 else 0.0,
            farthest=self.farthest,
            starts=grid.count,
            solves=self.solves,
            held=grid.held,
            cut=grid.cut,
            jumps=self.jumps,
            open=self.open,
            complete=self.complete,
        )
        return Findings(self.catalogue.copy(), tuple(grid.followed.values()), done)

    @property
    def farthest(self) -> float:
        """Largest position of a fixed point, 0 without any, and on a section that is a curve."""
        if self.grid.section.dimension == 1:
            return 0.0
        places = [np.abs(root.at[1:]).max() for found in self.roots.values() for root in found]
        return float(max(places, default=0.0))

    def _say(self, level: int, count: int) -> None:
        if self.progress is not None:
            found = len(self.catalogue)
            self.progress(
                f"{self.grid.section}: {count} cells of 2^-{level}, {self.grid.count} starts, {found} orbits"
            )

    def _first_cells(self) -> IntArray:
        axis = np.arange(1 << self.mesh.coarse, dtype=np.int64) << (
            self.grid.bits - self.mesh.coarse
        )
        axes = np.meshgrid(*[axis] * self.grid.section.dimension, indexing="ij")
        return np.stack([a.ravel() for a in axes], axis=1)

    def _judge(self, cells: Cells, level: int) -> NDArray[np.bool_]:
        """Return which cells are to be halved; orbits found in them are in the catalogue."""
        common, mixed = common_events(self.grid, cells)
        torn, chosen = mixed.copy(), np.zeros(len(cells), dtype=bool)
        limit = np.full(self.grid.section.dimension, _COARSE)
        limit[1:] *= 2.0 * self.grid.reach
        for near in near_cells(self.grid, cells, common):
            coarse = (np.ptp(near.gaps, axis=1) > limit).any(axis=1)
            torn[near.cells[coarse]] = True
            if level >= self.mesh.torn:
                self.jumps += int(coarse.sum())
            for k in np.flatnonzero(~coarse):
                if self._is_decided(cells, near, int(k), level):
                    continue
                chosen[near.cells[k]] = True
                if level >= self.mesh.near:
                    self._leave(near, int(k), level)
        if self.grid.section.dimension > 1:
            self._try_corners(cells, torn, level)
        return chosen & (level < self.mesh.near) | torn & (level < self.mesh.torn)

    def _leave(self, near: Near, k: int, level: int) -> None:
        """Count a cell of the smallest size that is left with zero among its gaps, not next to them."""
        low, high = near.gaps[k].min(axis=0), near.gaps[k].max(axis=0)
        if not ((low <= 0.0) & (high >= 0.0)).all():
            return
        # near a grazing a return changes with the square root of the distance, and not by more
        if (high - low).max() > _STRETCH * math.sqrt(0.5**level):
            self.jumps += 1
        else:
            self.open += 1

    def _try_corners(self, cells: Cells, torn: NDArray[np.bool_], level: int) -> None:
        """Start Newton from those corners of torn cells whose return nearly closes."""
        grid = self.grid
        rows = np.unique(cells.rows[torn])
        limit = np.full(grid.section.dimension, _STRETCH * 0.5**level)
        limit[1:] *= 2.0 * grid.reach
        for near in closing_nodes(grid, rows, limit):
            for row in near.cells.tolist():
                place = (row, near.event, near.periods, near.half)
                if place not in self._tried:
                    self._tried.add(place)
                    self._start(row, near)

    def _start(self, row: int, near: Near) -> None:
        codes = tuple(self.grid.code[row, : near.event + 1].tolist())
        itinerary = self.grid.itinerary_of(codes)
        if not self.wanted(whole_of(self.grid.model, itinerary, near.half), near.periods):
            return
        root = self._solve(row, near, itinerary)
        _keep(self.roots.setdefault((codes, near.periods, near.half), []), root)

    # --------------------------------------------------------------------------------- one cell

    def _is_decided(self, cells: Cells, near: Near, k: int, level: int) -> bool:
        """Tell whether nothing is left to find in a near cell."""
        cell = int(near.cells[k])
        rows = cells.rows[cell]
        codes = tuple(self.grid.code[rows[0], : near.event + 1].tolist())
        itinerary = self.grid.itinerary_of(codes)
        if not self.wanted(whole_of(self.grid.model, itinerary, near.half), near.periods):
            return True
        roots = self.roots.setdefault((codes, near.periods, near.half), [])
        nearby = [root for root in roots if self._distance(cells, cell, root) <= 1.0]
        if not nearby:
            best = int(rows[np.argmin(np.abs(near.gaps[k]).max(axis=1))])
            _keep(roots, self._solve(best, near, itinerary))
            nearby = [root for root in roots if self._distance(cells, cell, root) <= 1.0]
        if np.abs(near.gaps[k]).max() < _FLAT:
            return True
        if len(nearby) != 1:  # several: they are found, and nothing more can be told apart here
            return bool(nearby) and level >= self.mesh.near
        if nearby[0].slope is not None:
            return self._is_straight(rows, near.gaps[k][:, 0], nearby[0])
        return level >= self.mesh.decided

    def _distance(self, cells: Cells, cell: int, root: Root) -> float:
        """Return the distance of a root from a cell (0: inside), in sizes of the cell."""
        unit = float(1 << self.grid.bits)
        low, size = cells.low[cell] / unit + self.grid.shift, cells.size / unit
        share = root.at.copy()
        share[1:] = 0.5 * (share[1:] / self.grid.reach + 1.0)
        away = share - low - 0.5 * size
        away[0] -= np.rint(away[0])
        return float(max(0.0, np.max(np.abs(away)) / size - 0.5))

    def _is_straight(self, rows: IntArray, gaps: FloatArray, root: Root) -> bool:
        """Tell whether the gaps at the corners are those of the line through a root."""
        assert root.slope is not None
        away = self.grid.time[rows] - root.at[0]
        line = root.slope * (away - np.rint(away))
        return bool(np.all(np.abs(gaps - line) <= _BENT * np.abs(line) + _ROUNDING))

    def _solve(self, row: int, near: Near, itinerary: ReducedItinerary) -> Root | None:
        """Start Newton from a node; the orbit goes to the catalogue, its place on the section back."""
        grid = self.grid
        self.solves += 1
        joints = np.empty((near.event + 1, 1 + grid.start.shape[1]))
        joints[0, 0], joints[0, 1:] = grid.time[row], grid.start[row]
        joints[1:, 0] = grid.time[row] + grid.lift[row, : near.event]
        joints[1:, 1:] = grid.state[row, : near.event]
        joints[:, 0] *= grid.period
        system = build_system(grid.model, itinerary, near.periods, near.half)
        orbit = refine(Orbit(system, joints, grid.vector.copy(), np.inf, Status.NOT_CONVERGED))
        if orbit.converged:  # after cut corrections the last ones may not have come to rounding
            orbit = refine(orbit, damped=False)
        if not orbit.converged or not orbit.admissible:
            return None
        self.catalogue.add(orbit)
        at = np.empty(grid.section.dimension)
        at[0] = (orbit.joints[0, 0] / grid.period) % 1.0
        at[1:] = orbit.joints[0, 1:] @ grid.section.basis
        slope = None
        if grid.section.dimension == 1:
            slope = float(orbit.turn_multipliers[0].real) - 1.0
        return Root(at, slope)


@remembered()
def searched(search: Search, progress: Progress | None) -> Findings:
    """Run a search to its end, and return what it has found."""
    search.progress = progress
    search.run()
    return search.findings()


def _keep(roots: list[Root], root: Root | None) -> None:
    """Add a fixed point unless it is known."""
    if root is None:
        return
    for other in roots:
        away = root.at - other.at
        away[0] -= np.rint(away[0])
        if np.abs(away).max() < _SAME * (1.0 + np.abs(other.at).max()):
            return
    roots.append(root)
