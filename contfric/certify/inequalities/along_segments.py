"""The inequalities of an orbit over the whole of every segment.

They are those of :mod:`contfric.bvp.system`. Inside of a segment the surfaces that bound its mode are
not met, so that its end is the *first* meeting with the exit surface; there the observables are in the
domain that the next mode follows. A hold is left with an acceleration that is not negative, and on the
way no limit of rest is passed.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

from flint import arb, arb_mat

from contfric.bvp.system import System
from contfric.certify.equations.chain import Chain, Segments
from contfric.certify.equations.extended import EventCondition
from contfric.certify.equations.zeros import (
    Closing,
    at_start,
    in_span,
    order_at_start,
    vanishes_after,
    zeros_at_joints,
)
from contfric.certify.inequalities.sign import Path, positive, touched, undecided
from contfric.certify.verdict import Finding, Verdict
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector, column, numbers


@dataclass(frozen=True, eq=False)
class Touch:
    """Where an orbit at an event meets a surface: the one inequality that does not hold strictly there.

    Attributes
    ----------
    condition : the segment and the surface
    after : time of a touch after the start of its segment; None at a joint
    """

    condition: EventCondition
    after: arb | None = None


#: What an inequality is about.
DURATION, JOINT, EXIT, INSIDE, ENTRY = "duration", "joint", "exit", "inside", "entry"
#: The rate with which an observable leaves 0 at the start: a part of what is asked for inside.
RATE = "rate at the start"
#: The acceleration with which a hold could be left, over all of it.
ACCELERATED = "acceleration"


class InequalityName(NamedTuple):
    """Which inequality it is: its segment, its surface, and what it is about."""

    segment: int
    surface: str
    what: str


@dataclass(frozen=True)
class Inequality:
    """An inequality of one segment, and what became of it.

    ``window`` returns a ball of times after the start of the segment, outside of which it holds; None if none
    is known.
    """

    segment: int
    surface: str
    what: str
    finding: Finding
    window: Callable[[], arb | None] = lambda: None

    @property
    def name(self) -> InequalityName:
        """Which one it is."""
        return InequalityName(self.segment, self.surface, self.what)

    def named(self, system: System) -> Finding:
        """Return the finding with its place in words."""
        if self.finding.proved:
            return self.finding
        mode = system.itinerary[self.segment][0]
        text = f"segment {self.segment + 1} ({mode}): {self.what} at {self.surface}: {self.finding.why}"
        return Finding(self.finding.verdict, text)


def inequalities(
    chain: Chain,
    system: System,
    joints: list[Vector],
    closing: Closing,
    touch: Touch | None = None,
    loose: Collection[InequalityName] = (),
    only: Collection[int] | None = None,
) -> Iterator[Inequality]:
    """Return all inequalities of a chain, joint by joint.

    Parameters
    ----------
    joints : enclosures of joints 0 .. N
    closing : how rows at the last joint read at the first one
    touch : the inequality that does not hold strictly, of an orbit at an event
    loose : inequalities at joints and rates at starts that are known to hold, of the others that are returned
    only : segments whose inside is looked at; all if it is not given
    """
    model, segments = chain.model, chain.segments
    met = touch.condition if touch else None
    still = met.segment if met and met.before else -1
    more = rows_met(met, segments, model)
    known = zeros_at_joints(segments, model, closing, more, still)
    surfaces = [s.name for s in system.model.surfaces]
    shown = set[tuple[int, str, int]]()  # at joints, by what holds up to the end or from the start
    for i in range(segments.count) if only is None else sorted(only):
        move = chain.move(i, joints)
        duration = joints[i + 1][0] - joints[i][0]
        if touch and touch.condition.before and touch.condition.segment == i:
            continue  # it has no duration
        if not duration > 0:
            verdict = Verdict.REFUTED if duration < 0 else Verdict.UNDECIDED
            found = Inequality(i, segments.exits[i], DURATION, Finding(verdict, "not positive"))
            if found.name not in loose:
                yield found
                continue
        zeros = at_start(segments, model, i, known[i])
        path = Path(move.field, move.start, duration.upper(), duration.lower())
        for surface, sign in _inside(system, i, surfaces):
            row, name = model.surfaces[surface] * sign, InequalityName(i, surface, JOINT)
            ends = int(
                segments.exits[i] == surface
                or segments.pins[(i + 1) % segments.count] == surface
                or name in loose
                or (i == still - 1 and in_span(model.rows[surface], known[still]))
                or in_span(model.rows[surface], more.get(i, []))
            )
            if name in loose and grazes_at_end(EventCondition(i, surface), segments, model):
                ends = 2  # its rate vanishes at the end, too
            # an observable that is not negative at the start is as good as one that is zero
            least = _before(segments, i, surface) in loose and not segments.resets[i]
            at = segments.modes[i], zeros, surface, int(least)
            order = order_at_start(model, model.rows[surface], *at)
            if order and all(x.is_zero() for x in numbers(row * path.field)):
                continue
            if _is_event(touch, i, surface):
                finding = touched(path, row, order, touch.after if touch is not None else None)
            elif _is_left_held(segments, i, surface) or _grazes_at(touch, i, surface, chain):
                finding = touched(path, row, order, None)
            else:
                bends = InequalityName(i, surface, EXIT) in loose
                rises = order < 2 and InequalityName(i, surface, (ENTRY, RATE)[order]) in loose
                finding = positive(path, row, order, ends, bends, rises)
                if finding.proved and not ends:
                    shown.add((i, surface, sign))
            if finding.proved and not order and i and not segments.resets[i]:
                shown.add((i - 1, surface, sign))
            window = partial(undecided, path, row, order, ends)
            yield Inequality(i, surface, INSIDE, finding, window)
        yield from _held(chain, system, i, path, zeros, touch)
    for found in (
        *_at_joints(chain, system, joints, surfaces, shown),
        *_exits(chain, system, joints),
    ):
        at_event = list(more.get(found.segment, []))  # rows that vanish because it is one
        at_event += known[still] if still >= 0 and found.segment in (still - 1, still) else []
        if found.what == JOINT and in_span(model.rows[found.surface], at_event):
            continue
        rests = bool(more) and _enters_at_rest(chain, known[found.segment], found)
        if rests and found.surface in dict(_inside(system, found.segment, surfaces)):
            continue  # which side it goes on to is what the inequality inside says
        if not (found.name in loose or (touch and _is_of(touch.condition, found))):
            yield found


def _before(segments: Segments, i: int, surface: str) -> InequalityName:
    """Return the inequality at the joint that a segment starts at; of the image before half a turn."""
    image = surface if i else dict(segments.images).get(surface, surface)
    return InequalityName((i - 1) % segments.count, image, JOINT)


def _enters_at_rest(chain: Chain, zeros: list[Vector], found: Inequality) -> bool:
    """Tell whether a segment begins on a surface, as it does after an impact without speed."""
    if found.what != ENTRY:
        return False
    reset = chain.model.resets[chain.segments.resets[found.segment]]
    return vanishes_after(chain.model.rows[found.surface], reset, zeros)


def _is_event(touch: Touch | None, i: int, surface: str) -> bool:
    """Tell whether the event is that a segment touches a surface."""
    if touch is None or not (touch.condition.rate or touch.condition.within):
        return False
    if touch.condition.departs:
        return False
    return (touch.condition.segment, touch.condition.surface) == (i, surface)


def _grazes_at(touch: Touch | None, i: int, surface: str, chain: Chain) -> bool:
    """Tell whether the event is that a segment touches a surface at its end."""
    if touch is None or (touch.condition.segment, touch.condition.surface) != (i, surface):
        return False
    return grazes_at_end(touch.condition, chain.segments, chain.model)


def grazes_at_end(condition: EventCondition, segments: Segments, model: BallModel) -> bool:
    """Tell whether an observable that vanishes at a joint is stationary there, as its rate is the exit."""
    if condition.rate or condition.within or condition.departs or condition.before:
        return False
    i, surface = condition.segment, condition.surface
    mode, exit_ = segments.modes[i], segments.exits[i]
    if model.alike is not None and model.alike(surface, mode) == exit_:
        return True
    return bool(exit_) and in_span(model.rate(surface, mode), [model.rows[exit_]])


def _is_left_held(segments: Segments, i: int, surface: str) -> bool:
    """Tell whether a segment ends with a touch, at which a hold begins."""
    pin = segments.pins[(i + 1) % segments.count]
    return isinstance(pin, tuple) and segments.exits[i] == surface


def rows_met(
    condition: EventCondition | None, segments: Segments, model: BallModel
) -> dict[int, list[Vector]]:
    """Return the rows that vanish at the ends of segments at an event, in addition to the exits."""
    if condition is None or condition.within:
        return {}
    i, surface = condition.segment, condition.surface
    if condition.before:  # both of its ends are one point
        return {i - 1: [model.rows[surface]]}
    if condition.departs or condition.rate:
        return {i: [model.rate(surface, condition.departs or segments.modes[i])]}
    row, found = model.rows[surface], dict[int, list[Vector]]()
    for k in range(i, segments.count if segments.images else i + segments.count):
        at = k % segments.count  # and where what rests then keeps it
        if k > i and (segments.resets[at] or not model.keeps(row, segments.modes[at])):
            break
        found[at] = [row]
    return found


def _is_of(met: EventCondition, found: Inequality) -> bool:
    """Tell whether an inequality at a joint is the one that vanishes at an event."""
    what = EXIT if met.rate else JOINT
    return not (met.within or met.departs or met.before) and (met.segment, met.surface, what) == (
        found.segment,
        found.surface,
        found.what,
    )


def _held(
    chain: Chain, system: System, i: int, path: Path, zeros: list[Vector], touch: Touch | None
) -> Iterator[Inequality]:
    """Return that a hold could be left at any time: the acceleration that it would be left with."""
    for hold in system.holds:
        if hold.segment == i:
            sign = next(int(side) for at, _, side, _ in system.layout.held if at == i)
            row = chain.model.rate(hold.leaves, hold.departs)
            order = order_at_start(chain.model, row, chain.segments.modes[i], zeros)
            if touch and touch.after is not None and _departs(touch, i):
                finding = touched(path, arb_mat([row]) * sign, order, touch.after)
            else:
                finding = positive(path, arb_mat([row]) * sign, order, False)
            window = partial(undecided, path, arb_mat([row]) * sign, order, 0)
            yield Inequality(i, hold.leaves, ACCELERATED, finding, window)


def _departs(touch: Touch, i: int) -> bool:
    return bool(touch.condition.departs) and touch.condition.segment == i


def _inside(system: System, i: int, surfaces: list[str]) -> list[tuple[str, int]]:
    """Return the surfaces that a segment must not meet inside, each with the sign of its side."""
    layout = system.layout
    found = [(surfaces[k], int(s)) for at, k, s in layout.interior if at == i]
    exit_, sign = surfaces[layout.exits[i]], -int(layout.exit_signs[i])
    if layout.pins[i] == -1 and sign and exit_ not in [name for name, _ in found]:
        found.append((exit_, sign))
    return found


def _at_joints(
    chain: Chain,
    system: System,
    joints: list[Vector],
    surfaces: list[str],
    shown: set[tuple[int, str, int]],
) -> Iterator[Inequality]:
    model = chain.model
    for i, k, sign, where in system.layout.joint:
        # the checker of files, which has no holds, asks for each of them: tubes are to end where its do
        if system.holds and where == 0 and (int(i), surfaces[k], int(sign)) in shown:
            continue
        if where == 1:  # after a reset
            state = chain.move(int(i), joints).start
        else:
            after = joints[int(i) + 1]
            state = column(model.extended(after[0], after[1:]))
        value = int(sign) * (model.surfaces[surfaces[k]] * state)[0, 0]
        yield Inequality(int(i), surfaces[k], ENTRY if where == 1 else JOINT, _sign(value))


def _exits(chain: Chain, system: System, joints: list[Vector]) -> Iterator[Inequality]:
    """Rates at the exits: transversal, so that the end of a segment depends smoothly on its start."""
    model, segments = chain.model, chain.segments
    for i in range(segments.count):
        sign, exit_ = int(system.layout.exit_signs[i]), segments.exits[i]
        if not exit_ or sign == 0:
            continue
        after = joints[i + 1]
        state = column(model.extended(after[0], after[1:]))
        row = model.surfaces[exit_] * model.fields[segments.modes[i]]
        yield Inequality(i, exit_, EXIT, _sign(sign * (row * state)[0, 0]))


def _sign(value: object) -> Finding:
    if value > 0:  # type: ignore[operator]
        return Finding(Verdict.PROVED)
    if value < 0:  # type: ignore[operator]
        return Finding(Verdict.REFUTED, f"{value} is negative")
    return Finding(Verdict.UNDECIDED, f"{value} has no sign")
