"""What follows an event of friction contacts that share their loads, if the return map is continuous.

Two contacts change at once: ``first``, at whose surface segment i ends, and another one. Where that is

* beyond the limit of its load *behind* the joint, it lets go with the first: its state there is the other one
  on the two sides of the event. In between it changes a little later, in a segment without length;
* at a surface *before* the joint, it may change first. As loads jump where a contact stops, what follows is
  not the same two changes in the other order: the second contact may stop, or let go, at once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from contfric.errors import NotationError
from contfric.models.structure_model import ComposedModel
from contfric.orbit.system import Itinerary
from contfric.signature.edits import Edit

if TYPE_CHECKING:
    from contfric.models.shared_loads import Limit


def limit_after(model: ComposedModel, itinerary: Itinerary, i: int, surface: str) -> Limit | None:
    """Return the limit of a shared load that is met after a joint; None if it is no such thing."""
    limit = model.composition.limit(surface)
    return None if limit is None or surface in model.composition.ways(itinerary[i][0]) else limit


def with_other_state(
    model: ComposedModel, itinerary: Itinerary, i: int, limit: Limit, vanishes: bool
) -> tuple[Edit, str]:
    """Return the edit where a contact has the other state after a joint, and why.

    Parameters
    ----------
    vanishes : whether the segment after the joint has no length
    """
    n, name = len(itinerary), limit.contact.name
    (mode, exit_), (here, leaves), after = (
        itinerary[i],
        itinerary[(i + 1) % n],
        itinerary[(i + 2) % n][0],
    )
    states = model.composition.states_in(here)
    lets_go = "p" if limit.sign == "+" else "n"
    other = "".join({**states, name: lets_go if states[name] == "s" else "s"}.values())
    back = limit.name if states[name] != "s" else name
    if not model.follows(mode, exit_, other):
        raise NotationError(f"'{other}' cannot follow '{mode}' at {exit_}")
    if vanishes and other == after and leaves in (limit.name, name):
        return Edit(
            frozenset({(i + 1) % n})
        ), f"'{name}' changes its state at joint {i + 1} already"
    if not model.follows(other, back, here):
        raise NotationError(f"'{here}' cannot follow '{other}' at {back}")
    return Edit(inserted={i: ((other, back),)}), f"'{name}' changes its state after joint {i + 1}"


def in_other_order(
    model: ComposedModel, itinerary: Itinerary, i: int, surface: str, short: int
) -> Edit:
    """Return the edit where a surface is met before that at which a segment ends.

    Parameters
    ----------
    short : number of segments after the joint that have no length
    """
    n, (mode, first) = len(itinerary), itinerary[i]
    for count in range(short, min(short, 1) - 1, -1):
        target = itinerary[(i + 1 + count) % n][0]
        gone = frozenset((i + 1 + k) % n for k in range(count))
        for between in _paths(model, mode, surface, first, target):
            if len(between) <= count or count == 0 < len(between):
                return Edit(gone, {i: surface}, {i: between} if between else {})
    raise NotationError(f"{surface} and {first} are met at once, and do not change places there")


def _paths(
    model: ComposedModel, mode: str, surface: str, first: str, target: str
) -> list[tuple[tuple[str, str], ...]]:
    """Return segments without length between a mode that is left through a surface and another mode."""
    if model.follows(mode, surface, target):
        return [()]
    found: list[tuple[tuple[str, str], ...]] = []
    for after in model.targets.get((mode, surface), ()):
        if first not in model.composition.ways(after):
            continue
        if model.follows(after, first, target):
            found.append(((after, first),))
        for between in model.targets[after, first]:
            for last, end in model.exits_of(between):
                if end == target:
                    found.append(((after, first), (between, last)))
    return sorted(found, key=len)
