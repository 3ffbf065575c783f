"""Census: all periodic orbits at given parameters, stable or not, up to a number of periods and stops.

What is asked for are closed itineraries of the transition graph (:mod:`contfric.censuses.itineraries`); what
is done is one search on each section that orbits meet (:mod:`contfric.censuses.sections`), which
tries all itineraries at once: a grid of starts is simulated, and refined wherever a discontinuity or a
near return is (:mod:`contfric.censuses.search`). Stability plays no part in it. ``docs/census.md`` says
what follows from that for completeness, and what does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.censuses.asked import Findings, Mesh, Wanted
from contfric.censuses.conditions import ClosedItinerary, Fate, fates_before
from contfric.censuses.grid import CensusLimits, Grid
from contfric.censuses.itineraries import canonical_pair, closed_itineraries
from contfric.censuses.orbits import Catalogue
from contfric.censuses.result import Census, SectionSearch
from contfric.censuses.search import Progress, Search, searched
from contfric.censuses.sections import Section, exit_arcs, sections_of
from contfric.errors import ParameterError, number_and, whole_number
from contfric.models import ModelSource, Parameters
from contfric.models.definition import Model
from contfric.models.tied import tied
from contfric.orbit.itinerary.itineraries import whole_of
from contfric.signature import ReducedItinerary
from contfric.signature.walks import show

#: Cells of a curve: 4096 a period at first (0.02 s for ten events); where itineraries differ
#: down to 1.5e-11 of a period, where both sides of a jump are the same to the accuracy of an event.
_CURVE = Mesh(coarse=12, torn=36, near=36, decided=36)
#: Cells of other sections, an axis: 64 at first, as the return maps of slides bend over about a tenth of
#: it; boundaries down to 1/512, beyond which Newton from either side reaches across; near returns
#: until Newton's disc is larger than the cell by far.
_BOX = Mesh(coarse=6, torn=9, near=12, decided=9)
#: Bits of the lattices: more than the smallest cells need.
_BITS = 40
#: Most halvings beyond these: a box then has 262,144 cells at first, and its events take 100 MB.
_FINEST = 3
#: In natural units a return map bends over lengths of the order of 1: a box larger than this (near a
#: resonance) is searched in steps of this factor, from a small one on.
_NATURAL, _FACTOR = 8.0, 8.0
#: The box is doubled at most this often.
_DOUBLINGS = 3
#: Orbits within this share of a box leave space for others outside of those found.
NEAR_ENOUGH = 0.75


def census(
    model: ModelSource,
    params: Parameters,
    *,
    periods: int = 2,
    stops: int = 6,
    finer: int = 0,
    most_starts: int = 2_000_000,
    seed: int = 0,
    progress: Progress | None = None,
) -> Census:
    """Find all periodic orbits at given parameters, stable or not, within limits.

    Parameters
    ----------
    periods : int
        Most excitation periods of an orbit.
    stops : int
        Most stops (slides that end at v = 0) of an orbit.
    finer : int
        Halvings of all cells beyond the default, 0 to 3, to see whether anything is added.
    most_starts : int
        Most trajectories on one section; if they are used up, ``complete`` is False.
    seed : int
        Shifts the grids; the same seed gives the same census.
    progress : callable, optional
        Takes one line of text now and then.

    Returns
    -------
    Census
        On Ctrl-C what was found so far, with ``complete`` False.

    Raises
    ------
    ParameterError
        If parameters or limits are not valid, or the model has no excitation.

    Examples
    --------
    >>> import contfric as cf
    >>> [o.name for o in cf.census("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4}, stops=4)]
    ['1a', '2s']
    """
    model, params = tied(model, params)
    vector = model.vector(params)
    limits = CensusLimits(
        whole_number("periods", periods, least=1), whole_number("stops", stops, least=1)
    )
    whole_number("finer", finer, least=0, most=_FINEST)
    whole_number("most_starts", most_starts, least=1)
    whole_number("seed", seed, least=0)
    if model.view(vector).period == 0.0:
        raise ParameterError(
            f"model '{model.name}' has no excitation: the periods of its orbits are unknown, and a "
            "census cannot be bounded by their number"
        )
    rests = sum(mode.sliding for mode in model.modes)
    if model.resets or rests != 1 or sum(s.switching for s in model.surfaces) != 1:
        raise ParameterError(
            f"model '{model.name}': a census is offered for models with one switching surface, rest on "
            "it, and no impacts: the itineraries of others cannot be bounded by their stops"
        )
    state = _Census(model, vector, limits, finer, most_starts, seed, progress)
    try:
        state.prepare()
        for section in sections_of(model, vector):
            state.search(section)
    except KeyboardInterrupt:
        state.interrupted = True
    return state.result()


@dataclass(eq=False)
class _Census:
    """State of one census."""

    model: Model
    vector: FloatArray
    limits: CensusLimits
    finer: int
    most_starts: int
    seed: int
    progress: Progress | None
    catalogue: Catalogue = field(default_factory=Catalogue)
    itineraries: list[ReducedItinerary] = field(default_factory=list)
    fates: dict[tuple[ReducedItinerary, int], Fate | None] = field(default_factory=dict)
    followed: set[ReducedItinerary] = field(default_factory=set)
    searches: list[SectionSearch] = field(default_factory=list)
    interrupted: bool = False

    def prepare(self) -> None:
        """List the itineraries, and what necessary conditions leave of them."""
        if self.progress is not None:
            self.progress("listing the itineraries")
        self.itineraries = closed_itineraries(self.model, self.limits.stops)
        arcs = exit_arcs(self.model, self.vector)
        self.fates = fates_before(self.model, self.itineraries, self.limits.periods, arcs)

    def search(self, section: Section) -> None:
        """Search one section, in boxes of several sizes if it has positions."""
        largest = float(np.sum(self.model.spread(self.model.mapping(self.vector))))
        if section.dimension == 1:
            self._search(section, largest)
            return
        sizes = [largest]
        while sizes[0] > _NATURAL:
            sizes.insert(0, sizes[0] / _FACTOR)
        sizes += [largest * 2.0**k for k in range(1, _DOUBLINGS + 1)]
        for reach in sizes:
            found = self._search(section, reach)
            if found is None or (reach >= largest and found.done.farthest <= NEAR_ENOUGH * reach):
                return

    def _search(self, section: Section, reach: float) -> Findings | None:
        """Search one section in one box; None if no itinerary needs it."""
        mesh = (_CURVE if section.dimension == 1 else _BOX).refined(self.finer)
        shift = np.random.default_rng(self.seed).uniform(size=section.dimension) / 2.0**mesh.coarse
        grid = Grid(section, self.vector, self.limits, shift, _BITS, reach)
        if not grid.useful:
            return None
        wanted = Wanted(self.model, self.fates)
        search = Search(grid, mesh, self.catalogue, wanted, self.most_starts)
        try:
            found = searched(search, self.progress)
        except BaseException:
            self._record(grid, search.findings())
            raise
        self._record(grid, found)
        return found

    def _record(self, grid: Grid, found: Findings) -> None:
        self.catalogue = found.catalogue
        for codes in found.itineraries:
            itinerary = grid.itinerary_of(codes)
            half = codes[-1] != grid.own
            self.followed.add(canonical_pair(self.model, whole_of(self.model, itinerary, half)))
        self.searches.append(found.done)

    # ----------------------------------------------------------------------------------- result

    def result(self) -> Census:
        """Return what was found."""
        complete = not self.interrupted and all(s.complete for s in self.searches)
        return Census(
            self.model,
            self.model.mapping(self.vector),
            self.limits.periods,
            self.limits.stops,
            self.catalogue.sorted(),
            tuple(self._walk(itinerary, n) for itinerary, n in self.fates),
            tuple(self.searches),
            limits_of(self.limits, self.searches, self.catalogue, self.interrupted),
            self.seed,
            complete,
            self.interrupted,
        )

    def _walk(self, itinerary: ReducedItinerary, periods: int) -> ClosedItinerary:
        found = len(self.catalogue.orbits.get((itinerary, periods), []))
        fate = self.fates[itinerary, periods]
        if found:
            fate = Fate.FOUND
        elif fate is None:
            fate = Fate.NOT_CLOSED if itinerary in self.followed else Fate.NOT_WALKED
        return ClosedItinerary(itinerary, periods, fate, found)


def limits_of(
    limits: CensusLimits,
    searches: Sequence[SectionSearch],
    catalogue: Catalogue,
    interrupted: bool,
) -> tuple[str, ...]:
    """Return one line for each thing that bounds a census."""
    lines = [
        f"asked for: up to {number_and(limits.periods, 'period')} and {number_and(limits.stops, 'stop')}"
    ]
    for search in searches:
        lines += [f"{search.section}: {text}" for text in _of_section(search, limits)]
    for itinerary, periods in sorted(catalogue.continua):
        lines.append(
            f"{show(itinerary)} over {number_and(periods, 'period')}: a multiplier is 1; of what may be "
            "a continuum of orbits one is listed"
        )
    if interrupted:
        lines.append("interrupted: what is listed was found until then")
    return tuple(lines)


def _of_section(search: SectionSearch, limits: CensusLimits) -> list[str]:
    lines = [_resolution(search)]
    if search.cut:
        lines.append(
            f"{search.cut} of {search.starts} starts make more than {limits.stops} stops in "
            f"{number_and(limits.periods, 'period')}: orbits with more stops may exist"
        )
    else:
        lines.append(
            f"no start makes more than {limits.stops} stops in {number_and(limits.periods, 'period')}"
        )
    if search.held:
        lines.append(f"{search.held} of {search.starts} starts come to rest for ever")
    if search.farthest > NEAR_ENOUGH * search.reach:
        lines.append(
            f"an orbit lies at {search.farthest:.3g}, near the edge of the box of half-width "
            f"{search.reach:.3g}: others may lie outside"
        )
    if search.open:
        lines.append(
            f"at {search.open} place(s) a return nearly closes and Newton finds no orbit: a fold, or "
            "an orbit at an event, to rounding"
        )
    if not search.complete:
        lines.append(
            f"ended by the limit on starts after {search.starts}: ask for more (most_starts=...)"
        )
    return lines


def _resolution(search: SectionSearch) -> str:
    text = f"{search.starts} starts in cells of {search.first:.2g} to {search.last:.2g}"
    if search.dimension > 1:
        text += f" of each axis, positions within {search.reach:.3g}"
    else:
        text += " of a period"
    return f"{text}; an itinerary within a single first cell may be missed"
