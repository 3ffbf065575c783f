"""From branches and events to a diagram: mirror images, nodes, loose ends."""

from __future__ import annotations

from dataclasses import dataclass, field

from contfric.atlas.diagram import Asked, Diagram, LooseEnd, Node
from contfric.atlas.matching import ROUNDING, same_event, same_location, telling_kind
from contfric.base.attributes import altered
from contfric.continuation.branch import Branch
from contfric.continuation.points import Settings
from contfric.events.bifurcation import (
    TERMINAL,
    Bifurcation,
    Decision,
    End,
    EndReason,
    Kind,
    Proposal,
)
from contfric.models.definition import Model

#: Ends that the exploration goes on from.
_FOLLOWED = frozenset(EndReason[name] for name in ("CS", "SS", "AS", "GS", "BP", "PD"))
#: Ends that need no follower.
FINAL = frozenset(
    {
        EndReason[name]
        for name in (
            "RANGE",
            "LIMIT",
            "CLOSED",
            "STOP",
            "UNBOUNDED",
            "REST",
            "CONTINUUM",
            "SHAKEDOWN",
            "PERIOD",
            "POINT",
        )
    }
)
#: How the reason begins why a branch of longer periods than those asked for is not followed.
NOT_ASKED_FOR = "max_periods"


@dataclass(eq=False)
class Event:
    """A bifurcation while the exploration runs.

    Attributes
    ----------
    bifurcation : as located on the first branch that met it
    branches : the branches that meet there
    members : the same event as located on the other branches
    proposals : what was proposed to follow it
    final : why nothing is continued from it, if that is known: the mass stays at rest, or a continuum
    kinds : what the itineraries of its solution call it
    begun : whether what leaves it has been begun in advance
    paired : whether the branch that leaves the event before it may well end here
    """

    bifurcation: Bifurcation
    branches: list[int] = field(default_factory=list)
    members: list[Bifurcation] = field(default_factory=list)
    proposals: list[Proposal] = field(default_factory=list)
    final: EndReason | None = None
    kinds: set[Kind] = field(default_factory=set)
    begun: bool = False
    paired: bool = False

    def take_better(self, end: End) -> None:
        """Take the event as a branch that ends there has it, where that knows it better."""
        assert end.bifurcation is not None
        if end.bifurcation.accuracy < self.bifurcation.accuracy:
            self.bifurcation = end.bifurcation


def collect(
    model: Model,
    settings: Settings,
    bounds: tuple[float, float],
    computed: list[Branch],
    events: list[Event],
    notes: tuple[str, ...],
    complete: bool,
    asked: Asked,
) -> Diagram:
    """Return the diagram, with the mirror image of every asymmetric branch."""
    computed = _with_proposals(model, computed, events, settings)
    branches: list[Branch] = []
    location: dict[int, int] = {}
    image: dict[int, int] = {}
    for i, branch in enumerate(computed):
        location[i] = len(branches)
        branches.append(branch)
        if not branch.symmetric and model.symmetry is not None:
            image[i] = len(branches)
            branches.append(branch.mirror())
    events = [event for event in events if not _is_relabelling_at_end(event, events, settings)]
    nodes = [node for event in events for node in _nodes(event, location, image)]
    loose = [
        LooseEnd(location[i], side, _not_followed(end) if end.reason in _FOLLOWED else end)
        for i, branch in enumerate(computed)
        for side, end in enumerate(branch.ends)
        if end.reason not in FINAL and not _is_followed(events, settings, (i, branch), end)
    ]
    return Diagram(
        model,
        settings.parameter,
        bounds,
        tuple(branches),
        tuple(nodes),
        tuple(loose),
        complete,
        notes + tuple(_without_branch(event, settings) for event in events if _is_bare(event)),
        asked,
    )


def _is_bare(event: Event) -> bool:
    """Tell whether a branch must leave an event, and all that was tried to find it is refused."""
    tried = [p for p in event.proposals if not p.why.startswith(NOT_ASKED_FOR)]
    refused = tried and all(p.verdict is Decision.REFUSED for p in tried)
    leaves = event.bifurcation.kind in (Kind.PD, Kind.BP)
    return bool(refused and leaves and len(set(event.branches)) < 2)


def _without_branch(event: Event, settings: Settings) -> str:
    b = event.bifurcation
    at = f"{b.label} at {settings.parameter} = {b.params[settings.parameter]:.9g}"
    return f"{at}: the branch that leaves there was not found ({event.proposals[-1].why})"


def _is_relabelling_at_end(event: Event, events: list[Event], settings: Settings) -> bool:
    """Tell whether an event is a tangency that happens at a sliding event: a part of that.

    Which branch has it before its end is rounding: the labels of the ends of a segment of no length are
    arbitrary.
    """
    b = event.bifurcation
    return b.kind is Kind.T and any(
        other.bifurcation.kind in TERMINAL
        and same_location(other.bifurcation, b, settings.parameter, settings.width)
        for other in events
    )


def _best_located(event: Event, settings: Settings) -> Bifurcation:
    """Return an event as the branch has it on which it is known best.

    Where another curve crosses, the equations of one branch are singular at the event, and those of another
    one need not be: an event known to the root of rounding may miss its symmetry.
    """
    best = event.bifurcation
    value = best.params[settings.parameter]
    for member in event.members:
        gap = abs(member.params[settings.parameter] - value)
        told = member.located and bool(member.tests) == bool(best.tests)
        # nearer than rounding they are known alike, and accuracies cost
        if told and gap > ROUNDING * settings.width and member.accuracy < best.accuracy:
            best = member
    return best


def _with_proposals(
    model: Model, computed: list[Branch], events: list[Event], settings: Settings
) -> list[Branch]:
    """Return the branches with what was proposed at their bifurcations."""
    location, count = {}, 0
    for i, branch in enumerate(computed):  # where a branch will stand among the mirror images
        location[i] = count
        count += 1 if branch.symmetric or model.symmetry is None else 2
    changed: dict[int, Bifurcation] = {}
    final = {id(b): event.final for event in events if event.final for b in event.members}
    for event in events:
        event.bifurcation = _best_located(event, settings)
        proposals = tuple(
            p if p.branch is None else altered(p, branch=location[p.branch])
            for p in event.proposals
        )
        kind = telling_kind([*event.kinds, *(member.kind for member in event.members)])
        if event.final is EndReason.REST:  # all margins of the last slides vanish at once
            kind = Kind.AS
        for member in event.members:
            same = kind is member.kind and proposals == member.proposals
            changed[id(member)] = (
                member if same else altered(member, kind=kind, proposals=proposals)
            )
        event.bifurcation = changed[id(event.bifurcation)]
        event.members = [changed[id(member)] for member in event.members]
    return [_renewed(branch, changed, final) for branch in computed]


def _renewed(
    branch: Branch, changed: dict[int, Bifurcation], final: dict[int, EndReason]
) -> Branch:
    ends = []
    for end in branch.ends:
        b = end.bifurcation
        if b is None:
            ends.append(end)
        elif id(b) in final:
            ends.append(End(final[id(b)], bifurcation=changed[id(b)]))
        else:
            now = changed.get(id(b), b)
            reason = end.reason  # a branch that ends where another one turns keeps its own
            if now.kind is not b.kind and now.kind is not Kind.SN:
                reason = EndReason[now.kind.name]
            ends.append(altered(end, reason=reason, bifurcation=now))
    found = tuple(changed.get(id(b), b) for b in branch.bifurcations)
    return altered(branch, bifurcations=found, ends=(ends[0], ends[1]))


def _not_followed(end: End) -> End:
    """Return an end that could be followed and was not, saying so."""
    return altered(end, message=f"{end}; not followed (its bifurcation says why)")


def _nodes(event: Event, location: dict[int, int], image: dict[int, int]) -> list[Node]:
    """Return the node of an event, and its mirror image if that is another one."""
    here = tuple(location[i] for i in event.branches)
    there = tuple(image.get(i, location[i]) for i in event.branches)
    if event.bifurcation.symmetric:
        return [Node(event.bifurcation, tuple(dict.fromkeys((*here, *there))))]
    if there == here:
        return [Node(event.bifurcation, here)]
    return [Node(event.bifurcation, here), Node(event.bifurcation, there, mirrored=True)]


def _is_followed(
    events: list[Event], settings: Settings, own: tuple[int, Branch], end: End
) -> bool:
    """Tell whether another branch goes on from an end of a numbered branch; mirror images share theirs."""
    index, branch = own
    if end.reason not in _FOLLOWED or end.bifurcation is None:
        return False
    for event in events:
        member = any(b is end.bifurcation for b in event.members)
        if index in event.branches and (
            member
            or same_event(event.bifurcation, end.bifurcation, settings.parameter, settings.width)
        ):
            meets = event.bifurcation.symmetric and not branch.symmetric  # its mirror image
            through = meets and any(p.verdict is Decision.KNOWN for p in event.proposals)
            return len(event.branches) > 1 or through
    return False
