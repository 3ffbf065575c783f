"""What bounds a census, in words: why an orbit could be missing from it."""

from __future__ import annotations

from collections.abc import Sequence

from contfric.censuses.grid import CensusLimits
from contfric.censuses.orbits import Catalogue
from contfric.censuses.result import SectionSearch
from contfric.signature.edits import show

#: Orbits within this share of a box leave space for others outside of those found.
NEAR_ENOUGH = 0.75


def limits_of(
    limits: CensusLimits,
    searches: Sequence[SectionSearch],
    catalogue: Catalogue,
    interrupted: bool,
) -> tuple[str, ...]:
    """Return one line for each thing that bounds a census."""
    lines = [f"asked for: up to {limits.periods} period(s) and {limits.stops} stop(s)"]
    for search in searches:
        lines += [f"{search.section}: {text}" for text in _of_section(search, limits)]
    for itinerary, periods in sorted(catalogue.continua):
        lines.append(
            f"{show(itinerary)} over {periods} period(s): a multiplier is 1; of what may be a continuum of "
            "orbits one is listed"
        )
    if interrupted:
        lines.append("interrupted: what is listed was found until then")
    return tuple(lines)


def _of_section(search: SectionSearch, limits: CensusLimits) -> list[str]:
    lines = [_resolution(search)]
    if search.cut:
        lines.append(
            f"{search.cut} of {search.starts} starts make more than {limits.stops} stops in "
            f"{limits.periods} period(s): orbits with more stops may exist"
        )
    else:
        lines.append(f"no start makes more than {limits.stops} stops in {limits.periods} period(s)")
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
