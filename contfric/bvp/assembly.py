"""Assembles what a boundary-value problem asks of each segment: its margins, its exit, its labels."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

from contfric.base.attributes import cached_property
from contfric.bvp.holds import NO_PIN, TOUCH_PIN, Hold, holds_of
from contfric.bvp.margins import EventFunction, Margin, double_zeros, lasting_segments
from contfric.bvp.segment_starts import Itinerary, entry_rows, joints_before
from contfric.models.definition import Model
from contfric.models.mode_domains import (
    ending_sides,
    exit_domains,
    inside_sign,
    mirror_mode,
    mode_bounds,
    mode_domains,
)
from contfric.signature.holds import is_hold

#: Itineraries of a structure have hundreds of margins each, mostly the same ones.
_event = cache(EventFunction)


def following_modes(model: Model, itinerary: Itinerary, half: bool) -> list[str]:
    """Return the mode after each segment of a turn; after half an orbit it is the image of the first."""
    first = mirror_mode(model)[itinerary[0][0]] if half else itinerary[0][0]
    return [*(mode for mode, _ in itinerary[1:]), first]


@dataclass(frozen=True, eq=False)
class Assembly:
    """The segments of one turn, and what is asked of each.

    Attributes
    ----------
    domains : given in full form; empty if the itinerary is reduced
    """

    model: Model
    itinerary: Itinerary
    half: bool
    domains: tuple[str, ...]

    @cached_property
    def holds(self) -> tuple[Hold, ...]:
        """The holds of the itinerary."""
        return holds_of(self.model, self.itinerary)

    @cached_property
    def held(self) -> dict[int, Hold]:
        """The same by their segments."""
        return {hold.segment: hold for hold in self.holds}

    @cached_property
    def names(self) -> list[str]:
        """The surfaces of the model: where modes come as they are visited those of the orbit have been."""
        _ = self.inside, self.entries, self.ending  # modes are visited in this order
        return [surface.name for surface in self.model.surfaces]

    @cached_property
    def exits(self) -> list[str]:
        """The exit surface of each segment; of a hold the one that it leaves, if it is left at its end."""
        return [
            (self.held[i].until or self.held[i].leaves) if i in self.held else exit_
            for i, (_, exit_) in enumerate(self.itinerary)
        ]

    @cached_property
    def joints(self) -> Itinerary:
        """Mode and exit of the segment before each."""
        return joints_before(self.model, self.itinerary, self.half)

    @cached_property
    def entries(self) -> list[tuple[int, ...]]:
        """Rows of the entry margins."""
        return entry_rows(self.model, self.itinerary, self.joints, self.domains)

    @cached_property
    def after(self) -> list[str]:
        """The mode that each segment leads to by the transitions.

        Before a hold it is the mode in which that is left, but where rest is touched (GS).
        The load at a stop on a surface falls: the slide comes from beyond it, where it would reverse.
        """
        found = following_modes(self.model, self.itinerary, self.half)
        for hold in self.holds:
            if not hold.follows and (hold.after_rest or hold.pin is not None):
                found[hold.segment - 1] = hold.departs
        return found

    @cached_property
    def inside(self) -> list[tuple[str, ...]]:
        """The domains in which each segment may end."""
        if self.domains:
            return [(domain,) for domain in self.domains]
        return [
            self._ends_in(*pair, after)
            for pair, after in zip(self.itinerary, self.after, strict=True)
        ]

    @cached_property
    def ending(self) -> list[dict[str, int]]:
        """The sides of surfaces on which each segment ends."""
        return [
            ending_sides(self.model, mode, exit_, after, inside)
            for (mode, exit_), after, inside in zip(
                self.itinerary, self.after, self.inside, strict=True
            )
        ]

    def _ends_in(self, mode: str, surface: str, after: str) -> tuple[str, ...]:
        if is_hold(surface):
            return mode_domains(self.model, mode)
        found = exit_domains(self.model, mode, surface, after)
        if not found:
            raise ValueError(f"no domain of {mode} leads through {surface} into {after}")
        return found

    def pin(self, i: int) -> int:
        """Return the surface that a hold starts on, as the layout has it."""
        hold = self.held.get(i)
        if hold is None:
            return NO_PIN
        return TOUCH_PIN if hold.pin is None else self.model.surface_index[hold.pin]

    def exit_sign(self, i: int) -> float:
        """Return the sign of the rate of the observable where the exit surface is met from inside."""
        domain, hold = self.inside[i][0], self.held.get(i)
        if hold is not None and hold.until is not None:
            return float(-inside_sign(self.model, self.itinerary[i][0], hold.until))
        if hold is not None:  # it is left to the side on which the departing mode lies
            domain = mode_domains(self.model, hold.departs)[0]
        elif i + 1 in self.held and self.held[i + 1].pin is None:
            return 0.0
        sign = self.model.domain_by_name[domain].signs[self.exits[i]]
        return float(-sign if hold is None else sign)

    # ------------------------------------------------------------------------------------ margins

    @cached_property
    def interior(self) -> list[tuple[int, ...]]:
        """Rows of the interior margins."""
        model, rows = self.model, list[tuple[int, ...]]()
        for i, (mode, _) in enumerate(self.itinerary):
            own = model.chatter_by_mode.get(mode)
            if own is not None and not own.other:  # its flights stay on their side of the wall
                side = inside_sign(model, own.flight, own.surface)
                rows.append((i, model.surface_index[own.surface], side))
            for surface in self.names if self.domains else mode_bounds(model)[mode]:
                if self.domains:
                    sign = model.domain_by_name[self.inside[i][0]].signs[surface]
                else:
                    sign = inside_sign(model, mode, surface)
                if sign != 0 and surface not in model.wraps:
                    rows.append((i, model.surface_index[surface], sign))
        return rows

    @cached_property
    def joint(self) -> list[tuple[int, ...]]:
        """Rows of the joint margins."""
        rows = list[tuple[int, ...]]()
        pinned = {(hold.segment - 1, hold.pin) for hold in self.holds}
        index = {surface: k for k, surface in enumerate(self.names)}
        for i, ((_, exit_), ending) in enumerate(zip(self.itinerary, self.ending, strict=True)):
            rows += sorted(
                (i, index[surface], sign, 0)
                for surface, sign in ending.items()
                if sign and surface != exit_ and (i, surface) not in pinned
            )
        return rows

    @cached_property
    def lasting(self) -> list[tuple[int, str]]:
        """Segments that must last, and the surface that each is named by."""
        return lasting_segments(self.model, self.itinerary, self.joints, self.holds)

    @cached_property
    def tests(self) -> tuple[EventFunction, ...]:
        """All margins, in the order of their values."""
        names = self.names
        return (
            *(_event(Margin.INTERIOR, i, names[k]) for i, k, _ in self.interior),
            *(_event(Margin.EXIT, i, exit_) for i, exit_ in enumerate(self.exits)),
            *(_event(Margin.JOINT, i, names[k]) for i, k, *_ in self.joint),
            *(_event(Margin.ENTRY, i, names[k]) for i, k, *_ in self.entries),
            *(_event(Margin.LASTING, i, surface) for i, surface in self.lasting),
            *(_event(Margin.HELD, hold.segment, hold.leaves) for hold in self.holds),
        )

    @cached_property
    def leaving(self) -> list[tuple[int, ...]]:
        """Rows (segment, surface, side, mode) of the holds: what each leaves, to where, and in which mode."""
        model = self.model
        return [
            (
                hold.segment,
                model.surface_index[hold.leaves],
                int(model.domain_by_name[mode_domains(model, hold.departs)[0]].signs[hold.leaves]),
                model.mode_index[hold.departs],
            )
            for hold in self.holds
        ]

    @property
    def doubles(self) -> list[tuple[int, ...]]:
        """Rows (margin, segment) of those with a double zero where the segment has no length."""
        found = double_zeros(self.model, self.itinerary, self.half, self.holds)
        last = {i for i, _ in self.lasting}
        return [
            (self.tests.index(test), i) for test, i in found if test in self.tests and i in last
        ]

    # ------------------------------------------------------------------------------------- labels

    def labels(self) -> Iterator[tuple[int, ...]]:
        """Yield segments and observables of transparent surfaces, and on which of them they start and end."""
        model = self.model
        if self.domains or model.composed:  # what bounds no mode has no side there
            return
        own = [
            [s.name for s in model.surfaces if s.observable == o.name] for o in model.observables
        ]
        for i, (mode, exit_) in enumerate(self.itinerary):
            if model.mode_by_name[mode].sliding:
                continue
            end = self.held[i + 1].pin if i + 1 in self.held else exit_
            for c, of in enumerate(own):
                if any(s != model.phase and inside_sign(model, mode, s) == 0 for s in of):
                    ends = self._begins_on(i, of), end
                    yield i, c, *(model.surface_index[s] if s in of else -1 for s in ends)

    def _begins_on(self, i: int, own: list[str]) -> str | None:
        """Return the surface of some that a segment begins on after a reset; else that of its entry."""
        entry = self.joints[i]
        reset = self.model.reset_at(*entry)
        return entry[1] if reset is None else next((s for s in reset.lands if s in own), None)
