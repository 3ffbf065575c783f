"""The orbit of a proved event as a zero of the chain of a branch that ends or passes there.

An event is proved on the shortest problem of its orbit: without segments that have vanished there, on its
half if it is symmetric (:mod:`contfric.certify.equations.locating`). A branch has another chain. Where each
of its joints is one of the event's orbit, and each of its segments leads from one of these joints to the next
one in the same mode, or has no length there and its exit surface is met anyway, the event's orbit solves the
equations of the branch exactly; not only up to the width of balls.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain

from flint import arb, arb_mat

from contfric.bvp.system import System
from contfric.certify.equations.chain import Chain, Segments, segments_of
from contfric.certify.equations.closing import closing_of, closure_of_states
from contfric.certify.equations.extended import Builder
from contfric.certify.equations.kept import Kept
from contfric.certify.equations.short_slide import ShortSlide
from contfric.certify.equations.zeros import Closing, at_start, closed, in_span, zeros_at_joints
from contfric.certify.events import EventCertificate
from contfric.certify.inequalities.along_segments import rows_met
from contfric.models.balls.build import ball_model
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector, around, column, identity, numbers

#: A joint of the branch is taken for that of the event within this distance.
_NEAR = 1e-5
#: Steps of Newton's method towards the time at which a rest could be left.
_NEWTON = 4
#: How far from where they end that time is looked for: more than rounding, less than events are apart.
_AROUND = arb(2) ** -50


@dataclass(frozen=True, eq=False)
class _Cycle:
    """The event's whole orbit: joints, modes, resets before them, and what vanishes at each joint."""

    joints: list[Vector]
    modes: list[str]
    resets: list[str]
    vanishing: list[list[Vector]]
    turn: arb
    periods: int

    def dated(self, autonomous: bool, first: arb) -> Iterator[_Cycle]:
        """Yield the cycle; without excitation, with each of its joints in turn at a branch's first time."""
        if not autonomous:
            yield self
            return
        for own in self.joints:
            later = (first - own[0]).mid()
            yield replace(self, joints=[[z[0] + later, *z[1:]] for z in self.joints])


def as_zero_of(
    proof: EventCertificate,
    system: System,
    segments: Segments,
    build: Builder,
    near: Vector,
    short: ShortSlide | None = None,
) -> Vector | None:
    """Return balls that hold the event's orbit as a solution (z, p) of a branch's chain; None if it is not.

    Parameters
    ----------
    build : the model with the phase for its time
    near : approximate solution of the chain at the event
    short : a slide of the branch that has no length there: its equations for that case are solved, too
    """
    if proof.location is None or proof.value is None:
        return None
    own = proof.location.orbit.system
    if own.model is not system.model or (system.half and not own.half):
        return None
    if system.periods % own.periods:
        return None
    if len(segments.kept) != len(proof.kept) or not all(map(Kept.same, segments.kept, proof.kept)):
        return None
    model = build(proof.value)
    for touched in (False, True)[: 1 + _is_within(proof)]:
        cycle = _cycle(proof, model, touched)
        for dated in [] if cycle is None else cycle.dated(system.model.autonomous, near[0]):
            found = _on(dated, system, segments, model, near, short)
            if found is not None:
                return [*found, proof.value]
    return None


def _is_within(proof: EventCertificate) -> bool:
    """Tell whether the event is a touch within a segment."""
    assert proof.location is not None
    condition = proof.location.condition
    return condition is not None and condition.within


def _on(
    cycle: _Cycle,
    system: System,
    segments: Segments,
    model: BallModel,
    near: Vector,
    short: ShortSlide | None = None,
) -> Vector | None:
    """Return the joints of a chain that the event's orbit solves, next to some; None if it does not."""
    m, count = segments.states + 1, segments.count
    if short is not None and not short.touches:
        left = _left(cycle, segments, model, near, short.segment)
        if left is None:
            return None
        cycle = left
    found: list[tuple[int, int]] = []
    for i in range(count):
        at = _matched(cycle, near[i * m : (i + 1) * m])
        if at is None:
            return None
        found.append(at)
    found.append(_closed(found[0], cycle, system, near))
    if not all(_leads(cycle, model, segments, i, *found[i : i + 2]) for i in range(count)):
        return None
    if short is not None and not _is_left_still(cycle, segments, model, short, found):
        return None
    *joints, closed = (_moved(cycle, at) for at in found)
    end = (
        closed[0] if system.model.autonomous else arb(0)
    )  # without excitation a cycle ends at time 0
    return [c for time, *state in joints for c in (time - end, *state)]


def _cycle(proof: EventCertificate, model: BallModel, touched: bool = False) -> _Cycle | None:
    """Return the whole orbit of an event in phases; with a joint where it touches a surface, if asked for."""
    location, event = proof.location, proof.event
    assert location is not None
    orbit = location.orbit
    segments = segments_of(orbit.system)
    m, half = segments.states + 1, orbit.system.half
    closure = closure_of_states(segments)
    one = identity(m - 1)
    twice = closure * closure == one  # for certain
    if not twice:
        return None
    autonomous = event.orbit.model.autonomous
    timed = ball_model(event.orbit.model, event.params, proof.parameter, proof.value)
    scale = arb(1) if autonomous else 2 * arb.pi() / timed.period
    joints = [list(proof.zero[i * m : (i + 1) * m]) for i in range(segments.count)]
    joints = [[joint[0] * scale, *joint[1:]] for joint in joints]
    condition = location.condition
    met = rows_met(condition, segments, model)
    closing = closing_of(segments, model, half)
    still = condition.segment if condition is not None and condition.before else -1
    known = zeros_at_joints(segments, model, closing, met, still)
    whole = segments_of(orbit.as_whole().system)
    starts = range(0, whole.count, segments.count)  # of the turn, or of its half and the image
    modes = [list(whole.modes[k : k + segments.count]) for k in starts]
    resets = [list(whole.resets[k : k + segments.count]) for k in starts]
    if still >= 0:  # both of its ends are one point
        del joints[still], known[still]
        for own in (*modes, *resets):
            del own[still]
    if touched and condition is not None:
        i = condition.segment
        after, mode = proof.zero[-2] * scale, segments.modes[i]
        move = Chain(segments, model).move(i, [*joints, *joints[:1]])
        end = numbers((move.field * after).exp() * move.start)
        kept = at_start(segments, model, i, known[i])
        kept = [row for row in kept if in_span(numbers(arb_mat([row]) * move.field), [])]
        joints.insert(i + 1, [joints[i][0] + after, *end[: m - 1]])
        row = model.rows[condition.surface]
        if condition.departs:
            row = model.rate(condition.surface, condition.departs)
        rate = model.rate(condition.surface, mode)
        if condition.departs:
            rate = numbers(arb_mat([row]) * move.field)
        known.insert(i + 1, [row, rate, *kept])
        for own in modes:
            own.insert(i + 1, own[i])
        for own in resets:
            own.insert(i + 1, "")
    turn = -joints[0][0] if autonomous else arb(segments.turn) * 2 * arb.pi()
    if half:
        image = [[z[0] + turn, *numbers(closure * column(z[1:]))] for z in joints]
        joints, known = (
            [*joints, *image],
            [
                *known,
                *(_images(rows, closing, segments, model, modes) for rows in known),
            ],
        )
        turn = 2 * turn
    all_modes, all_resets = list(chain.from_iterable(modes)), list(chain.from_iterable(resets))
    return _Cycle(joints, all_modes, all_resets, known, turn, orbit.periods)


def _images(
    rows: list[Vector],
    closing: Closing,
    segments: Segments,
    model: BallModel,
    modes: list[list[str]],
) -> list[Vector]:
    """Return the images of rows; of a rate also that of the image of its surface, as balls do not show it."""
    found = [closed(row, closing, segments, model) for row in rows]
    images, of = dict(segments.images), dict(zip(*modes, strict=True))
    rates = [rate for rate in map(model.rate_that_is, rows) if rate is not None]
    return found + [
        model.rate(images[name], of[mode], order)
        for name, mode, order in rates
        if name in images and mode in of
    ]


def _left(
    cycle: _Cycle, segments: Segments, model: BallModel, near: Vector, i: int
) -> _Cycle | None:
    """Return the cycle with a joint where a rest could be left without acceleration into segment i.

    It is the only such time next to a printed one (interval Newton).
    """
    m = segments.states + 1
    at = _matched(cycle, near[(i - 1) * m : i * m])
    if at is None or cycle.modes[at[0]] != segments.modes[i - 1]:
        return None
    j, mode = at[0], segments.modes[i - 1]
    row = model.rate(segments.exits[i], segments.modes[i])
    start = column(model.extended(cycle.joints[j][0], cycle.joints[j][1:]))
    field, rate = model.fields[mode], arb_mat([row]) * model.fields[mode]
    after = (near[i * m] - _moved(cycle, at)[0]).mid()
    for _ in range(_NEWTON):
        state = (field * after).exp() * start
        value, slope = (arb_mat([row]) * state)[0, 0], (rate * state)[0, 0]
        if slope.contains(0):
            return None
        after = (after - value / slope).mid()
    wide = around(after, _AROUND)
    value = (arb_mat([row]) * (field * after).exp() * start)[0, 0]
    slope = (rate * (field * wide).exp() * start)[0, 0]
    if slope.contains(0):
        return None
    found = after - value / slope
    if not abs(found - after) < _AROUND or not found > 0:
        return None
    end = numbers((field * found).exp() * start)
    following = cycle.joints[j + 1] if j + 1 < len(cycle.joints) else _moved(cycle, (0, 1))
    if not cycle.joints[j][0] + found < following[0]:
        return None
    kept = [own for own in cycle.vanishing[j] if model.keeps(own, mode)]
    joint = [cycle.joints[j][0] + found, *end[: m - 1]]
    return replace(
        cycle,
        joints=[*cycle.joints[: j + 1], joint, *cycle.joints[j + 1 :]],
        modes=[*cycle.modes[: j + 1], mode, *cycle.modes[j + 1 :]],
        resets=[*cycle.resets[: j + 1], "", *cycle.resets[j + 1 :]],
        vanishing=[*cycle.vanishing[: j + 1], [row, *kept], *cycle.vanishing[j + 1 :]],
    )


def _is_left_still(
    cycle: _Cycle,
    segments: Segments,
    model: BallModel,
    short: ShortSlide,
    at: list[tuple[int, int]],
) -> bool:
    """Tell whether a slide has no length, and is left without acceleration there."""
    i = short.segment
    known, rest = cycle.vanishing[at[i][0]], model.fields[segments.modes[i - 1]]
    row = model.rate(segments.exits[i], segments.modes[i])
    rows = [row, numbers(arb_mat([row]) * rest)] if short.touches else [row]
    return at[i] == at[i + 1] and all(in_span(own, known) for own in rows)


def _matched(cycle: _Cycle, joint: Vector) -> tuple[int, int] | None:
    """Return which joint of the orbit one of the branch is, and how many times the orbit later."""
    for j, own in enumerate(cycle.joints):
        later = round(float(((joint[0] - own[0]) / cycle.turn).mid()))
        moved = _moved(cycle, (j, later))
        if all(abs(float((a - b).mid())) < _NEAR for a, b in zip(joint, moved, strict=True)):
            return j, later
    return None


def _moved(cycle: _Cycle, at: tuple[int, int]) -> Vector:
    joint = cycle.joints[at[0]]
    return [joint[0] + at[1] * cycle.turn, *joint[1:]]


def _closed(first: tuple[int, int], cycle: _Cycle, system: System, near: Vector) -> tuple[int, int]:
    """Return the joint that the closure of the branch leads to from its first one."""
    j, later = first
    if not system.half:
        times = system.periods // cycle.periods
        if system.model.autonomous:
            times = round(float((-near[0] / cycle.turn).mid()))
        return j, later + times
    count = len(cycle.joints)
    steps = j + count // 2
    return steps % count, later + steps // count


def _leads(
    cycle: _Cycle,
    model: BallModel,
    segments: Segments,
    i: int,
    start: tuple[int, int],
    end: tuple[int, int],
) -> bool:
    """Tell whether the orbit obeys the equations of segment i of the branch."""
    j, later = start
    resets = cycle.resets[j], segments.resets[i]
    own = cycle.modes[j] == segments.modes[i] and _act_alike(model, resets, cycle.vanishing[j])
    own = own and end in _reached(cycle, j, later)
    if not ((start == end and not segments.resets[i]) or own):
        return False
    pin = segments.pins[i]
    if pin is None:
        return in_span(model.rows[segments.exits[i]], cycle.vanishing[end[0]])
    if isinstance(pin, str):
        return in_span(model.rows[pin], cycle.vanishing[j])
    return in_span(model.rate(pin[1], pin[0]), cycle.vanishing[j])


def _reached(cycle: _Cycle, j: int, later: int) -> Iterator[tuple[int, int]]:
    """Yield the joints that the orbit comes to from one in the same mode: the next, and others beyond it."""
    count = len(cycle.joints)
    for k in range(j + 1, j + count + 1):
        at = k % count
        yield at, later + k // count
        if cycle.modes[at] != cycle.modes[j] or cycle.resets[at]:
            return


def _act_alike(model: BallModel, resets: tuple[str, str], vanishing: list[Vector]) -> bool:
    """Tell whether two resets (or none) lead to the same state, as an impact without speed leads nowhere."""
    if resets[0] == resets[1]:
        return True
    one = identity(model.size)
    first, second = (model.resets[name] if name else one for name in resets)
    return all(in_span(row, vanishing) for row in (first - second).tolist())
