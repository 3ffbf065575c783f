r"""The ends of a tube at events: the last box holds the event, so that nothing is left between.

In a box that reaches beyond the end of a branch orbits are admissible up to one. The equations of a chain
know nothing of its inequalities, so that a box (:mod:`contfric.certify.tubes.tube`) may reach beyond the
event at which a branch ends. Let X(s) be the curve in it, T its direction. A few inequalities change their
sign in the box: a load at a joint less its limit, a rate at an exit, the duration of a segment are numbers
m(s), with ``m' = (derivative of m by the unknowns) T``; inside of a segment q(tau, s) may vanish for times
tau in a window W only, and its derivative by s for fixed tau is known in the same way. Where all of these
derivatives are negative over the whole box, towards its outer end, each of the inequalities holds for s below
some number, so that all of them hold up to the least, s*: there the branch ends, and nowhere else in the box.
The other inequalities are proved for all s; where they lean on one of the first (a load that begins at its
limit at the event is below it before) they hold up to s*. Where a slide is left with an acceleration that
vanishes at s* (at S = S0), that is one of the numbers, and the next derivative has a sign.

A branch that ends at a limit of its parameter ends so, too, where an inequality vanishes there (at S = 0 the
load at a stop, say). No event says that s* is the end. So its last box shows, too, that the orbits up to
almost the end are admissible; or all of its orbits are, and the limit is one of the model only.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from flint import arb, arb_mat

from contfric.bvp.system import System
from contfric.certify.equations.chain import Chain, Segments
from contfric.certify.equations.extended import Builder, EventCondition, rows_of
from contfric.certify.equations.zeros import Closing
from contfric.certify.inequalities.along_segments import (
    ACCELERATED,
    DURATION,
    ENTRY,
    EXIT,
    INSIDE,
    JOINT,
    RATE,
    Inequality,
    InequalityName,
    inequalities,
)
from contfric.certify.tubes.circle import is_off
from contfric.certify.tubes.piece import UNKNOWN, Piece
from contfric.certify.tubes.splitting import Split, event_of, has_no_flip, split_box
from contfric.certify.tubes.tube import Box, box_between, orbit_in, section, solved
from contfric.certify.tubes.turns import Turns
from contfric.certify.verdict import Verdict, all_of
from contfric.models.balls.numbers import Vector, dot

if TYPE_CHECKING:
    from contfric.certify.tubes.tracing import Arcs, Tracer
    from contfric.certify.tubes.vanishing import Vanishing

#: Halvings of a step up to an event.
_HALVINGS = 24
#: How far the box of an end reaches beyond it, as a share of its length.
_BEYOND = 0.1
#: Where in the box of a PD or BP its tube begins, as a share of its reach.
WITHIN = 0.8
#: Inequalities at joints, which may change their sign in the box of an end.
NUMBERS = (DURATION, JOINT, EXIT, ENTRY)


@dataclass(frozen=True, eq=False)
class Flip:
    """The box of a PD or BP at an end of a branch.

    Attributes
    ----------
    turns : how the branch's chain is that of two turns
    split : the box
    piece : what is proved in it, but for its place
    plane : normal of the planes in which the tube meets it
    """

    turns: Turns
    split: Split
    piece: Piece
    plane: Vector

    def holds(self, zero: Vector) -> bool:
        """Tell whether a solution (z, p) in some balls is one of the box, and admissible."""
        return self.surrounds(zero) and self.piece.proved

    def surrounds(self, zero: Vector) -> bool:
        """Tell whether a solution (z, p) in some balls is one of the box."""
        return self.split.holds(*self.turns.of(zero[:-1]), zero[-1])

    def amplitude(self, point: Vector) -> float:
        """Return the e of an orbit (z, p) of the branch, as a share of the reach."""
        return self.split.amplitude(self.turns.of(point[:-1])) / float(self.split.reach)

    def covers(self, point: Vector) -> bool:
        """Tell whether the tube meets the box before a printed orbit (z, p), on the way to the event."""
        return abs(self.amplitude(point)) < WITHIN

    def guess(self, share: float) -> Vector:
        """Return about the orbit (z, p) at a share of the reach."""
        one, other, value = self.split.at(arb(share * float(self.split.reach)))
        return [*self.turns.joined(one, other), value]


def flip_at(tracer: Tracer, turns: Turns, far: Vector) -> Flip | None:
    """Return the box of a PD or BP at an end, as wide as it can be proved with all that is asked for.

    Parameters
    ----------
    far : orbit of the branch that is as far from the event as the box need reach
    """
    event = event_of(turns.segments, tracer.build, turns.near)
    if event is None:
        return None
    centre, functional = event
    first, second = turns.of(far[:-1])
    half = [(a - b) / 2 for a, b in zip(first, second, strict=True)]
    reach, best = abs(float(dot(functional, half).mid())), None
    for _ in range(_HALVINGS):
        tracer.count += 1
        split = split_box(turns.segments, tracer.build, centre, functional, reach)
        if split is not None:
            best = _flip(tracer, turns, split)
            piece = best.piece
            if piece.regular or not tracer.goes_on():
                break
        reach /= 2
    return best


def _flip(tracer: Tracer, turns: Turns, split: Split) -> Flip:
    """Return what is proved of the orbits of two turns in the box of their event."""
    turn, v = split.turn, split.centre[split.size : -1]
    admissible = tracer.obeys(turns.system, turns.segments, turn)
    chain = tracer.segments, tracer.build
    wholes = [[*turns.joined(*pair), turn[-1]] for pair in split.pairs()]
    flips = 0 if all(has_no_flip(*chain, whole) for whole in wholes) else UNKNOWN
    folds = 0 if split.one_sided else UNKNOWN
    labels = (turns.proof.event.label,) if turns.is_event(split.box, split.functional) else ()
    tori = 0 if all(is_off(*chain, tracer.closes, whole) for whole in wholes) else UNKNOWN
    piece = Piece(0, 0, (0, 0), True, admissible, folds, flips, tori, events=labels)
    return Flip(turns, split, piece, [*turns.directed(v, [-c for c in v]), arb(0)])


def leave(
    tracer: Tracer, first: Vector, last: Vector, arcs: Arcs, forward: bool, level: int = 0
) -> list[Piece]:
    """Cover a step at whose last (or first) point the branch ends at an event of its inequalities."""
    piece = _edge(tracer, first, last, arcs, forward)
    if piece is not None:
        return [piece]
    splits = level < _HALVINGS and tracer.goes_on()
    middle = tracer.middle(first, last) if splits else None
    if middle is None:
        return tracer.cover(first, last, arcs, _HALVINGS)
    between = 0.5 * (arcs[0] + arcs[1])
    before, after = (arcs[0], between), (between, arcs[1])
    if forward:
        return [
            *tracer.cover(first, middle, before, 0),
            *leave(tracer, middle, last, after, True, level + 1),
        ]
    return [
        *leave(tracer, first, middle, before, False, level + 1),
        *tracer.cover(middle, last, after, 0),
    ]


def _edge(tracer: Tracer, first: Vector, last: Vector, arcs: Arcs, forward: bool) -> Piece | None:
    """Return the piece whose box reaches beyond the end of the branch, or None if it is not proved."""
    segments, build = tracer.segments, tracer.build
    inner, end = (first, last) if forward else (last, first)
    plane = [b - a for a, b in zip(inner, end, strict=True)]
    beyond = [(b + _BEYOND * c).mid() for b, c in zip(end, plane, strict=True)]
    outer = solved(segments, build, tracer.plain, beyond, plane)
    if outer is None:
        return None
    tracer.count += 1
    box = box_between(segments, build, *((inner, outer) if forward else (outer, inner)))
    if box is None:
        return None
    edge = Edge(tracer.system, segments, build, tracer.closes, forward)
    names = ends_inside(edge, box)
    if tracer.is_limit(-1 if forward else 0):
        near = names and _is_near(edge, tracer, box, end, arcs[1] - arcs[0])
        if not near and _failing(edge, box.all, ()):
            return None
    elif not names:
        return None
    singular = any(tracer.is_singular(name) for name in names)
    leaves = forward if names else None
    piece = tracer.piece(box, arcs, (first[-1], last[-1]), all_of([]), leaves, singular)
    if not piece.decided:
        return None
    return tracer.linked(replace(piece, ends=names), box)


def _is_near(edge: Edge, tracer: Tracer, box: Box, end: Vector, length: float) -> bool:
    """Tell whether the orbit of a box up to which all are admissible is as near to an end as events are.

    Parameters
    ----------
    length : from the inner end of the box to that end, in arclength
    """
    if not length > tracer.end:
        return False
    inner = box.first if edge.forward else box.last
    plane = [(b - a).mid() for a, b in zip(inner, end, strict=True)]
    inside = [(b - tracer.end / length * c).mid() for b, c in zip(end, plane, strict=True)]
    point = solved(edge.segments, edge.build, tracer.plain, inside, plane)
    zero = None if point is None else orbit_in(edge.segments, edge.build, point, plane)
    return zero is not None and box.holds(zero) and not _failing(edge, zero, ())


def join(
    tracer: Tracer, flip: Flip | Vanishing, first: Vector, last: Vector, arcs: Arcs, forward: bool
) -> list[Piece]:
    """Cover the step in which the tube meets the box of an end, and all beyond it."""
    far, near = (first, last) if forward else (last, first)
    shares = [flip.amplitude(point) for point in (far, near)]
    wanted = WITHIN if shares[0] > 0 else -WITHIN
    middle = [c.mid() for c in flip.guess(wanted)]
    point = solved(tracer.segments, tracer.build, tracer.plain, middle, flip.plane)
    zero = None if point is None else orbit_in(tracer.segments, tracer.build, point, flip.plane)
    if point is None or zero is None or not flip.surrounds(zero):
        return tracer.cover(first, last, arcs, 0)
    share = (shares[0] - wanted) / (shares[0] - shares[1])
    start, stop = arcs if forward else arcs[::-1]
    arc = start + share * (stop - start)
    end = tracer.end_of(forward)
    here = (arc, float(point[-1].mid()))
    (start, one_value), (stop, other_value) = (here, end) if forward else (end, here)
    piece = replace(flip.piece, start=start, stop=stop, values=(one_value, other_value))
    if forward:
        before = tracer.cover(first, point, (arcs[0], arc), 0)
        held = isinstance(tracer.last, Box) and tracer.last.holds(zero)
        tracer.last = None
        return [*before, replace(piece, linked=held)]
    tracer.last = zero
    return [piece, *tracer.cover(point, last, (arc, arcs[1]), 0)]


@dataclass(frozen=True, eq=False)
class Edge:
    """The chain of a branch, to look at a box that reaches beyond its end.

    Attributes
    ----------
    forward : whether the outer end is that of ``last``; else it is that of ``first``
    """

    system: System
    segments: Segments
    build: Builder
    closing: Closing
    forward: bool


def ends_inside(edge: Edge, box: Box) -> tuple[InequalityName, ...]:
    """Return the inequalities that end the branch at one orbit of a box; none if that is not proved."""
    if box.tangent is None:
        return ()
    loose = [found.name for found in _failing(edge, box.all, ()) if found.name.what == DURATION]
    # what such a segment shows of its ends as long as it lasts need not fall by itself
    loose += [found.name for found in _failing(edge, box.all, loose) if found.name.what in NUMBERS]
    left = _failing(edge, box.all, loose)
    rates = [found.name._replace(what=RATE) for found in left if found.what == INSIDE]
    if rates:
        still = {found.name for found in _failing(edge, box.all, [*loose, *rates])}
        loose += [name for name in rates if name._replace(what=INSIDE) not in still]
        left = [found for found in left if found.name in still]
    if not all(found.name.what in (INSIDE, ACCELERATED) for found in left):
        return ()
    sides = (False, True) if edge.forward else (True, False)
    zeros = [section(edge.segments, edge.build, box, last) for last in sides]
    if zeros[0] is None or zeros[1] is None or _failing(edge, zeros[0], ()):
        return ()
    beyond = _failing(edge, zeros[1], ())
    if not any(found.finding.verdict is Verdict.REFUTED for found in beyond):
        return ()
    falls = all(_falls(edge, box, name, None) for name in loose)
    if falls and all(_falls(edge, box, found.name, found.window()) for found in left):
        return (*loose, *(found.name for found in left))
    return ()


def _failing(
    edge: Edge, x: Vector, loose: tuple[InequalityName, ...] | list[InequalityName]
) -> list[Inequality]:
    """Return the inequalities that are not proved for all solutions in some balls."""
    chain = Chain(edge.segments, replace(edge.build(x[-1]), slopes=None))
    joints = chain.joints(x[:-1])
    found = inequalities(chain, edge.system, joints, edge.closing, loose=loose)
    return [inequality for inequality in found if not inequality.finding.proved]


def _falls(edge: Edge, box: Box, name: InequalityName, window: arb | None) -> bool:
    """Tell whether the number of an inequality falls towards the outer end, over the whole box."""
    assert box.tangent is not None
    slope = slope_along(edge, box.all, box.tangent, name, window)
    return slope is not None and bool(slope < 0 if edge.forward else slope > 0)


def slope_along(
    edge: Edge, x: Vector, tangent: Vector, name: InequalityName, window: arb | None
) -> arb | None:
    """Return the rate of an inequality's number along a tangent, over some balls; None if it has none."""
    chain = Chain(edge.segments, edge.build(x[-1]))
    z, i, sign = chain.joints(x[:-1]), name.segment, signs_of(edge.system, name)
    if name.what == DURATION:
        first, last = (chain.times_by(k, tangent) for k in (i, i + 1))
        return last - first
    if sign is None:
        return None
    if name.what in (INSIDE, ACCELERATED):
        if window is None or not window < chain.duration(i, z):
            return None
        along = [h.departs for h in edge.system.holds if (h.segment, name.what) == (i, ACCELERATED)]
        met = EventCondition(i, name.surface, departs=along[0] if along else "")
        rows = rows_of(chain.model, edge.segments, met, 0)
        return sign * dot(chain.observed_within(z, i, window, *rows)[1], tangent)
    starts, order = name.what in (RATE, ENTRY), int(name.what in (EXIT, RATE))
    rows = rows_of(chain.model, edge.segments, EventCondition(i, name.surface), order)
    if starts and edge.segments.resets[i]:
        rows = _before_reset(chain, edge.segments.resets[i], *rows)
    return sign * dot(chain.observed(z, i + int(not starts), *rows)[1], tangent)


def _before_reset(
    chain: Chain, reset: str, row: arb_mat, slope: arb_mat
) -> tuple[arb_mat, arb_mat]:
    """Return the row that an observable after a reset is before it, and its slope by the parameter."""
    model = chain.model
    assert model.slopes is not None
    return row * model.resets[reset], slope * model.resets[reset] + row * model.slopes.resets[reset]


def signs_of(system: System, name: InequalityName) -> int | None:
    """Return the sign with which the observable of an inequality is positive where it holds."""
    layout, surfaces = system.layout, [s.name for s in system.model.surfaces]
    i = name.segment
    if name.what in (EXIT, ACCELERATED):
        return int(layout.exit_signs[i])
    if name.what in (JOINT, ENTRY):
        after = int(name.what == ENTRY)
        rows = [(at, surfaces[k], s) for at, k, s, where in layout.joint if where == after]
    else:
        rows = [(at, surfaces[k], s) for at, k, s in layout.interior]
        if layout.pins[i] == -1 and layout.exit_signs[i]:
            rows.append((i, surfaces[layout.exits[i]], -layout.exit_signs[i]))
    return next((int(s) for at, k, s in rows if (at, k) == (i, name.surface)), None)
