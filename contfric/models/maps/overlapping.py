"""Chooses the mode beyond a surface where several hold: the one in which the fewest switches change.

A mode that holds on both sides of the surface may be entered on either.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from contfric.models.maps.transition_maps import TransitionMaps
    from contfric.models.parts import Domain


def nearest(
    fits: Sequence[Domain], mode: str, side_of: Mapping[tuple[str, str], int]
) -> list[Domain]:
    """Return the domains whose modes keep most sides of the mode before: of two switches one changes.

    Parameters
    ----------
    fits : domains that a state may be in, where modes overlap
    side_of : the side of each surface that a mode lies on; 0 if on both
    """
    if len(fits) == 1 or not mode:
        return list(fits)
    own = {s: side for (m, s), side in side_of.items() if m == mode and side}
    kept = [sum(side_of[d.own_mode, s] == side for s, side in own.items()) for d in fits]
    return [d for d, count in zip(fits, kept, strict=True) if count == max(kept)]


def turned_back(model: TransitionMaps, domain: str, surface: str, target: str) -> Iterator[str]:
    """Yield the domain on this side of a surface in the mode that is entered there, if it may turn back."""
    here, entered = model.domain_by_name[domain], model.domain_by_name[target].own_mode
    if entered != here.own_mode and (entered, surface) in model.turned_at_times:
        yield from (d.name for d in model.domains_of(entered) if d.signs == here.signs)
