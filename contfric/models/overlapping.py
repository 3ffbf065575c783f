"""Which mode follows where several hold behind a surface: the one in which the fewest switches change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
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
