"""From branches and events to a diagram: mirror images, nodes, loose ends."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from contfric.atlas.diagram import Diagram, LooseEnd, Node
from contfric.atlas.matching import same_event
from contfric.continuation.branch import Branch
from contfric.continuation.events import Bifurcation, End, EndReason
from contfric.continuation.points import Settings
from contfric.models.definition import Model

#: Ends that the exploration goes on from.
_FOLLOWED = frozenset({EndReason.CS, EndReason.BP, EndReason.PD})
#: Ends that need no follower.
FINAL = frozenset({EndReason.RANGE, EndReason.LIMIT, EndReason.CLOSED, EndReason.UNBOUNDED})


@dataclass(eq=False)
class Event:
    """A bifurcation while the exploration runs, with the branches that meet there."""

    bifurcation: Bifurcation
    branches: list[int] = field(default_factory=list)


def collect(
    model: Model,
    settings: Settings,
    bounds: tuple[float, float],
    computed: list[Branch],
    events: list[Event],
    notes: tuple[str, ...],
    complete: bool,
) -> Diagram:
    """Return the diagram, with the mirror image of every asymmetric branch."""
    branches: list[Branch] = []
    place: dict[int, int] = {}
    image: dict[int, int] = {}
    for i, branch in enumerate(computed):
        place[i] = len(branches)
        branches.append(branch)
        if not branch.symmetric and model.symmetry is not None:
            image[i] = len(branches)
            branches.append(branch.mirror())
    nodes = [node for event in events for node in _nodes(event, place, image)]
    loose = [
        LooseEnd(place[i], side, _not_followed(end) if end.reason in _FOLLOWED else end)
        for i, branch in enumerate(computed)
        for side, end in enumerate(branch.ends)
        if end.reason not in FINAL and not _is_followed(events, settings, i, end)
    ]
    return Diagram(
        model,
        settings.parameter,
        bounds,
        tuple(branches),
        tuple(nodes),
        tuple(loose),
        complete,
        notes,
    )


def _not_followed(end: End) -> End:
    """Return an end that could be followed and was not, saying so."""
    return replace(end, message=f"{end.reason.value}; not followed (see the notes)")


def _nodes(event: Event, place: dict[int, int], image: dict[int, int]) -> list[Node]:
    """Return the node of an event, and its mirror image if that is another one."""
    here = tuple(place[i] for i in event.branches)
    there = tuple(image.get(i, place[i]) for i in event.branches)
    if event.bifurcation.symmetric:
        return [Node(event.bifurcation, tuple(dict.fromkeys((*here, *there))))]
    if there == here:
        return [Node(event.bifurcation, here)]
    return [Node(event.bifurcation, here), Node(event.bifurcation, there, mirrored=True)]


def _is_followed(events: list[Event], settings: Settings, index: int, end: End) -> bool:
    """Tell whether another branch goes on from an end; mirror images share theirs."""
    if end.reason not in _FOLLOWED or end.bifurcation is None:
        return False
    for event in events:
        if index in event.branches and same_event(
            event.bifurcation, end.bifurcation, settings.parameter, settings.width
        ):
            return len(event.branches) > 1
    return False
