"""The state of an exploration: branches traced, events met, events that wait to be followed."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

from contfric.atlas.collect import Event
from contfric.atlas.matching import (
    ROUNDING,
    SAME_SOLUTION,
    identity,
    identity_of,
    inner_orbit,
    on_branch,
    same_event,
    stops_distance,
)
from contfric.base.interrupts import held_back
from contfric.continuation.branch import Branch
from contfric.continuation.points import Settings
from contfric.continuation.singular_points.openings import with_openings
from contfric.events.bifurcation import (
    ACCURACY,
    TERMINAL,
    Bifurcation,
    Decision,
    End,
    EndReason,
    Kind,
    Proposal,
)
from contfric.orbit.orbit import Orbit

Progress = Callable[[str], None]

#: Kinds that leave nothing to follow: the branch itself goes on.
_PASSED = frozenset({Kind.SN, Kind.T, Kind.NS})
#: Kinds that a branch meets once each time that it passes them: a curve may come back to a branch point.
_ONE_AFTER_ANOTHER = frozenset({Kind.SN, Kind.PD, Kind.NS})
#: The tip of a branch whose parameter (relative to the range) and stops agree with an event to these is
#: at the event; one that is located agrees to rounding, or to what it is known to: two sides of a symmetric
#: orbit may meet their events one after the other within the first.
_SAME_LOCATION, _SAME_STOPS = 1e-8, 1e-6


def _alike(one: Orbit, other: Orbit) -> bool:
    """Tell whether two orbits are one solution: holds of other lengths may lead to the same stops."""
    return one.outline.apart(other.outline) < SAME_SOLUTION


def _combines(bifurcation: Bifurcation) -> bool:
    """Tell whether orbits of several copies may meet there: at sliding events, and folds of bridges."""
    held = bool(bifurcation.orbit.system.holds) and bifurcation.kind is not Kind.T
    return bifurcation.kind in TERMINAL or held


@dataclass(eq=False)
class Exploration:
    """State of one exploration."""

    settings: Settings
    max_periods: int
    copies: int
    max_branches: int
    bridges: bool
    progress: Progress | None
    branches: list[Branch] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    waiting: deque[Event] = field(default_factory=deque)
    notes: list[str] = field(default_factory=list)
    complete: bool = True
    #: Traced for an event that they do not meet: another event may ask for them.
    elsewhere: list[Branch] = field(default_factory=list)

    def add(self, branch: Branch) -> None:
        """Register a branch and the events that it meets: all of it, whenever Ctrl-C comes."""
        with held_back():
            self._register(branch)

    def _register(self, branch: Branch) -> None:
        index = len(self.branches)
        self.branches.append(branch)
        if self.progress is not None:  # the name costs
            self.progress(f"branch {index + 1}: {branch.name}, {len(branch)} points")
        if any(end.reason is EndReason.INTERRUPTED for end in branch.ends):
            raise KeyboardInterrupt
        for bifurcation in branch.bifurcations:
            self._meet(bifurcation, index)

    def accept(self, event: Event, reason: str, branch: Branch, ends: Iterable[End] = ()) -> None:
        """Register a branch that starts at an event, and why it was tried; ``ends`` of it are there, too."""
        index = len(self.branches)
        with held_back():
            self.judge(event, reason, Decision.ACCEPTED, index)
            self._register(branch)
            if index not in event.branches:
                event.branches.append(index)
        for end in ends:
            self.merge(event, end)

    def raise_copies(self, copies: int) -> None:
        """Try more copies at events from now on, those that were followed already among them."""
        if copies <= self.copies:
            return
        before, self.copies = self.copies, copies
        self.notes.append(f"copies raised to {copies}: a branch arrives with that many")
        waiting = {id(event) for event in self.waiting}
        for event in self.events:
            if _combines(event.bifurcation) and id(event) not in waiting:
                event.proposals.clear()
                self.waiting.append(event)
        self.settings = replace(self.settings, copies=copies)
        if before == 1:
            self._find_doublings()

    def _find_doublings(self) -> None:
        """Let the bridges that were traced with one copy have their doublings, which nobody had asked for."""
        self.elsewhere = [self._doubled(branch) for branch in self.elsewhere]
        for index, branch in enumerate(self.branches):
            opened = self.branches[index] = self._doubled(branch)
            for bifurcation in opened.bifurcations:
                if not any(bifurcation is b for b in branch.bifurcations):
                    self._meet(bifurcation, index)

    def _doubled(self, branch: Branch) -> Branch:
        """Return a bridge with its doublings; branch points of symmetric ones are found with any copies."""
        return branch if branch.system.half else with_openings(branch, self.settings)

    def judge(
        self,
        event: Event,
        reason: str,
        verdict: Decision,
        branch: int | None = None,
        why: str = "",
    ) -> None:
        """Keep what became of a candidate."""
        event.proposals.append(Proposal(reason, verdict, branch, why))
        if verdict is Decision.KNOWN and branch is not None and branch not in event.branches:
            event.branches.append(branch)

    def _meet(self, bifurcation: Bifurcation, index: int) -> None:
        settings = self.settings
        for event in self.events:
            if self._is_next_on_branch(event, bifurcation, index):
                continue
            if same_event(event.bifurcation, bifurcation, settings.parameter, settings.width):
                event.members.append(bifurcation)
                if index not in event.branches:
                    event.branches.append(index)
                if _combines(bifurcation):
                    self.raise_copies(bifurcation.orbit.periods // bifurcation.outline.periods)
                return
        event = Event(bifurcation, [index], [bifurcation])
        self.events.append(event)
        if not bifurcation.located:
            why = "not located: Newton fails after this point"
            self.judge(event, "go on after the event", Decision.REFUSED, why=why)
        elif bifurcation.kind not in _PASSED or _combines(bifurcation):
            self.waiting.append(event)

    def _is_next_on_branch(self, event: Event, bifurcation: Bifurcation, index: int) -> bool:
        """Tell whether a smooth event is another one of a branch that has met an event before.

        Both lie on one curve, one after the other: there they are told apart better than by what each is
        known to, which may be roughly. Next to a saddle folds and doublings follow each other that close.
        """
        if index not in event.branches or bifurcation.kind not in _ONE_AFTER_ANOTHER:
            return False
        if bifurcation.orbit.system.holds:  # there these kinds are names of one event
            return False
        parameter = self.settings.parameter
        gap = abs(event.bifurcation.params[parameter] - bifurcation.params[parameter])
        return gap > ACCURACY * self.settings.width

    def end_at(self, index: int, k: int, event: Event) -> None:
        """Let a branch end (its end k) at an event next to the one at which it was taken to end."""
        branch = self.branches[index]
        old = branch.ends[k].bifurcation
        assert old is not None
        new = replace(
            event.bifurcation,
            position=old.position,
            stable_before=old.stable_before,
            stable_after=old.stable_after,
        )
        ends = [*branch.ends]
        ends[k] = replace(ends[k], bifurcation=new)
        listed = tuple(new if b is old else b for b in branch.bifurcations)
        self.branches[index] = replace(branch, bifurcations=listed, ends=(ends[0], ends[1]))
        for other in [e for e in self.events if any(member is old for member in e.members)]:
            other.members = [member for member in other.members if member is not old]
            if not any(member is b for b in listed for member in other.members):
                other.branches = [i for i in other.branches if i != index]
                other.proposals = [p for p in other.proposals if p.branch != index]
            if other.members and other.bifurcation is old:
                other.bifurcation = other.members[0]
            if not other.members:
                self.events.remove(other)
                if other in self.waiting:
                    self.waiting.remove(other)
        event.members.append(new)
        if index not in event.branches:
            event.branches.append(index)

    def merge(self, event: Event, end: End) -> None:
        """Make what a branch calls the end at an event a member of it, if it is an event of its own yet."""
        for other in self.events:
            if other is event or not any(member is end.bifurcation for member in other.members):
                continue
            event.members += other.members
            event.branches += [i for i in other.branches if i not in event.branches]
            event.proposals += other.proposals
            self.events.remove(other)
            if other in self.waiting:
                self.waiting.remove(other)
            return

    def known(self, orbit: Orbit) -> int | None:
        """Return the branch, of those already traced, that an orbit lies on, or None."""
        return next((i for i, b in enumerate(self.branches) if on_branch(orbit, b)), None)

    def knows(self, event: Event, reason: str, orbit: Orbit) -> bool:
        """Tell whether an orbit lies on a branch already traced, and say so on the event."""
        known = self.known(orbit)
        if known is not None:
            self.judge(event, reason, Decision.KNOWN, known)
        return known is not None

    def take(self, event: Event, reason: str, branch: Branch, ends: Iterable[End] = ()) -> bool:
        """Register a branch that meets an event, if it is not known; whether it is new."""
        if self.knows(event, reason, inner_orbit(branch)):
            return False
        self.accept(event, reason, branch, ends)
        return True

    def ends_here(self, orbit: Orbit, event: Event) -> int | None:
        """Return the branch of the orbit's itinerary that already ends at an event; None if none does."""
        wanted, mirror = identity(orbit), orbit.model.symmetry is not None
        width = self.settings.width
        for index, branch in enumerate(self.branches):
            if branch.system.periods != orbit.periods or branch.system.half != orbit.system.half:
                continue
            if identity_of(branch) != wanted:
                continue
            for end, tip in zip(branch.ends, (branch[0], branch[-1]), strict=True):
                b, known = end.bifurcation, _SAME_LOCATION
                if b is not None:
                    if same_event(b, event.bifurcation, self.settings.parameter, width):
                        return index
                    known = max(ROUNDING, 2.0 * max(b.accuracy, event.bifurcation.accuracy))
                gap = abs(tip.params[branch.parameter] - orbit.params[branch.parameter])
                near = stops_distance(tip.stops, orbit.stops, mirror) < _SAME_STOPS
                if gap < known * width and near and _alike(tip, orbit):
                    return index
        return None
