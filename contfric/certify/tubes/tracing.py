"""Covers a branch with boxes, from event to event."""

from __future__ import annotations

import math
import time
from collections.abc import Collection, Sequence
from dataclasses import replace

from flint import arb, arb_mat

from contfric.bvp.system import System
from contfric.certify.certificate import Certificate
from contfric.certify.equations.chain import Chain, Segments
from contfric.certify.equations.closing import closing_of
from contfric.certify.events import EventCertificate
from contfric.certify.inequalities.along_segments import Inequality, inequalities
from contfric.certify.tubes.circle import has_no_pair
from contfric.certify.tubes.leaving import Flip, flip_at, join, leave
from contfric.certify.tubes.passing import passes_once
from contfric.certify.tubes.piece import UNKNOWN, Piece
from contfric.certify.tubes.strand import Strand
from contfric.certify.tubes.tube import Box, are_linked, box_between, section, solved
from contfric.certify.tubes.turns import turns_of
from contfric.certify.tubes.vanishing import Vanishing, vanishing_at
from contfric.certify.verdict import Finding, Verdict, all_of
from contfric.continuation.branch import Branch
from contfric.models.balls.numbers import Vector

#: Halvings of a step of the branch: what is not proved then is left.
HALVINGS = 12
#: A box is tried only if it is at most this much longer than the last one that was proved; and, if fewer than
#: some were proved since one was not, if it is hardly longer: lengths are halves of each other.
_GROWTH, _STEADY, _SLOW = 2.5, 4, 1.5
#: A box reaches over several steps of the branch if the last one was about as long; or if, after so many at
#: most, it may be longer.
_SAME, _PATIENT = 1.2, 32
#: Largest share of its rate that the ball of the rate of the parameter is to be, in boxes towards a BP or PD.
_TURNS = 0.8
#: After so many boxes it is tried again whether they are found at once, by the half-widths of the last one.
_AGAIN = 8
#: Shares of the way to an end that is not known at which an orbit is looked for.
_WAYS = (0.5, 0.25, 0.125)
#: Most parts of a box in which its inequalities are looked at.
_PARTS = 16
#: Most boxes that are tried along a branch: some minutes of work.
_MOST = 30_000
#: After so many shortest stretches in a row without a proof no others are halved, until one is proved: where
#: the equations are singular all along (a continuum, a period without bound) halving is of no use.
_IN_ROW = 8

Arcs = tuple[float, float]
NO_BOX = Finding(Verdict.UNDECIDED, "no box")


class Tracer(Strand):
    """Covers the steps of a branch with boxes.

    Parameters
    ----------
    proofs : certificates of the events of the branch
    points : certificates of its printed orbits
    until : when to end, by ``time.time``
    """

    def __init__(
        self,
        branch: Branch,
        proofs: list[EventCertificate],
        until: float,
        points: Sequence[Certificate] = (),
    ) -> None:
        super().__init__(branch)
        self.until, self.count, self.ended = until, 0, ""
        self._known: dict[int, Vector | None] = {}  # orbits next to printed ones, by number
        self.begin()
        self.met = self.met_by(proofs)
        self.flips = [self._flip(proofs, e) or vanishing_at(self, proofs, e) for e in (0, -1)]
        self.printed_orbits = self.enclosed(points)
        self.unique = {k for k, point in enumerate(points) if point.unique.proved}
        self.held, self.obeying = set[int](), set[int]()
        for flip in (one for one in self.flips if one is not None):
            self._hold(flip)

    def _flip(self, proofs: list[EventCertificate], end: int) -> Flip | None:
        """Return the box of the event at an end, if that is a PD or BP at which two turns become one."""
        at = float(self.branch.arc[end])
        near = self.point(self.branch[end])
        for proof in proofs:
            if proof.proved and abs(proof.event.position - at) <= self.end:
                turns = turns_of(proof, self.system, near)
                if turns is not None:
                    return flip_at(self, turns, self.far_from(end))
        return None

    def _hold(self, box: Box | Flip | Vanishing, arcs: Arcs | None = None) -> None:
        """Note which printed orbits are on the curve of a proved box, all of which is admissible.

        Looked at are those that may not be alone within their stated error, which is large next to a PD or
        BP; and, of those between two arclengths, whether they are admissible.
        """
        for k, zero in self.printed_orbits.items():
            near = arcs is not None and arcs[0] <= self.branch.arc[k] <= arcs[1]
            if (near or k not in self.unique) and box.holds(zero):
                self.held.add(k)
                if near:
                    self.obeying.add(k)

    # ------------------------------------------------------------------ steps

    def begin(self) -> None:
        """Begin a part of the branch: of boxes before it nothing is known."""
        self.last: Box | Vector | None = None
        self.begun: Box | None = None  # its first box
        self.length = math.inf
        self.missed, self.steady = 0, _STEADY  # boxes in a row that were not proved, and that were
        # the last box that was proved, and how many in a row before one of several steps is tried
        self.proved_length, self.patience = 0.0, _STEADY
        self.turning = False  # whether a box did not show a monotone parameter

    def step(self, k: int, stop: int) -> tuple[list[Piece], int]:
        """Cover the branch from point k to a later one, at most ``stop``; return its number, too.

        That is the next one, or one that is about as far as the last box reached.
        """
        last, before = self._reached(k, stop), self.last
        if self.unique >= {k, last}:
            self.missed = 0  # the equations are regular here
        found = self._step(k, last)
        if last > k + 1 and not all(piece.exists for piece in found) and self.goes_on():
            self.last, last = before, k + 1  # no orbit was found halfway: the branch bends much
            found = self._step(k, last)
        return found, last

    def _reached(self, k: int, stop: int) -> int:
        """Return the last point up to which a box is tried from point k: one step, or more."""
        arc, found = self.branch.arc, min(self.after(k), stop)
        most = _GROWTH if self.steady >= self.patience else _SAME
        most *= min(self.length, self.proved_length)
        while found < stop and not (self._is_special(k) or self._is_special(found)):
            if arc[found + 1] - arc[k] > most:
                break
            found += 1
        return found

    def _is_special(self, k: int) -> bool:
        """Tell whether there is no step from point k, or one that is not only covered with boxes."""
        at, count = self.branch.arc, len(self.branch)
        ends = ((0, k == 0), (-1, k + 2 == count))
        if k + 1 >= count or any(there and self.has_edge(end) for end, there in ends):
            return True
        return self.after(k) > k + 1 or any(
            flip is not None and abs(at[k + 1 - end] - at[-end]) < self.far
            for end, flip in enumerate(self.flips)
        )

    def _allowed(self) -> float:
        """Return how long the next box may be.

        Towards a BP or PD the rate of the parameter vanishes; relative to it, its ball grows with the square
        of the length. Once a box could not show its sign, that says how long others may be.
        """
        most = (_GROWTH if self.steady >= _STEADY else _SLOW) * self.length
        if self.turning and isinstance(self.last, Box) and self.last.monotone:
            assert self.last.tangent is not None
            rate = self.last.tangent[-1]
            share = float((rate.rad() / abs(rate.mid())).upper())
            wanted = self.proved_length * math.sqrt(_TURNS / share)
            most = min(most, max(wanted, self.length / 2))
        return most

    def _step(self, k: int, j: int) -> list[Piece]:
        printed = self.point(self.branch[k]), self.point(self.branch[j])
        arcs = (float(self.branch.arc[k]), float(self.branch.arc[j]))
        if not self.goes_on():
            return [self._nothing(arcs, *printed)]
        plane = [b - a for a, b in zip(*printed, strict=True)]
        exact = [self._exact(k, printed[0], plane), self._exact(j, printed[1], plane)]
        first, last = (at or raw for at, raw in zip(exact, printed, strict=True))
        for end, flip in enumerate(self.flips):
            if flip is not None and abs(arcs[1 - end] - self.branch.arc[-end]) < self.far:
                inside = [flip.covers(at) for at in printed]
                if all(inside):
                    return []
                if inside[end]:
                    return join(self, flip, first, last, arcs, end == 1)
        left = k == 0 and self.has_edge(0), j + 1 == len(self.branch) and self.has_edge(-1)
        if all(left):
            middle, between = self.middle(first, last), 0.5 * (arcs[0] + arcs[1])
            if middle is not None:
                before = leave(self, first, middle, (arcs[0], between), False)
                return [*before, *leave(self, middle, last, (between, arcs[1]), True)]
        elif any(left):
            return leave(self, first, last, arcs, left[1])
        elif None not in exact:
            return self.cover(first, last, arcs, 0)
        elif exact != [None, None]:
            return self._towards(first, last, arcs, 1 if exact[0] else 0)
        return [self._nothing(arcs, first, last)]

    def _towards(
        self, first: Vector, last: Vector, arcs: Arcs, end: int, level: int = 0
    ) -> list[Piece]:
        """Cover the stretch towards an end next to which no orbit is found, as far as there are orbits.

        Where a branch ends without an event (at S = 0, say) its equations may be singular there.

        Parameters
        ----------
        end : 1 if no orbit is next to the last point, 0 if none is next to the first one
        level : how many parts of it are covered already
        """
        point, share = None, 0.0
        if level <= HALVINGS and arcs[1] - arcs[0] > self.shortest and self.goes_on():
            for share in _WAYS if end else [1 - way for way in _WAYS]:
                point = self.middle(first, last, share)
                if point is not None:
                    break
        if point is None:
            return [self._nothing(arcs, first, last)]
        between = arcs[0] + share * (arcs[1] - arcs[0])
        before, after = (arcs[0], between), (between, arcs[1])
        if end:
            covered = self.cover(first, point, before, 0)
            return [*covered, *self._towards(point, last, after, end, level + 1)]
        rest = self._towards(first, point, before, end, level + 1)
        return [*rest, *self.cover(point, last, after, 0)]

    def goes_on(self) -> bool:
        """Tell whether more boxes may be tried; else it is said what ended the work."""
        if time.time() > self.until:
            self.ended = "the time limit ended it"
        elif self.count >= _MOST:
            self.ended = f"{_MOST} boxes were tried"
        return not self.ended

    def _nothing(self, arcs: Arcs, first: Vector, last: Vector) -> Piece:
        self.last = None
        why = Finding(Verdict.UNDECIDED, self.ended) if self.ended else NO_BOX
        return Piece(*arcs, (float(first[-1].mid()), float(last[-1].mid())), False, why)

    def middle(self, first: Vector, last: Vector, share: float = 0.5) -> Vector | None:
        """Return the orbit halfway between two others, or at another share of the way."""
        plane = [b - a for a, b in zip(first, last, strict=True)]
        middle = [(a + share * c).mid() for a, c in zip(first, plane, strict=True)]
        return solved(self.segments, self.build, self.plain, middle, plane)

    def _exact(self, k: int, printed: Vector, plane: Vector) -> Vector | None:
        """Return the orbit next to a printed point, which two steps of the branch share."""
        if self._known.get(k) is None:
            self._known[k] = solved(self.segments, self.build, self.plain, printed, plane)
        return self._known[k]

    def cover(self, first: Vector, last: Vector, arcs: Arcs, level: int) -> list[Piece]:
        """Cover the stretch between two orbits with boxes; ``level`` says how often it was halved."""
        length = arcs[1] - arcs[0]
        splits = level < HALVINGS and length > self.shortest and self.goes_on()
        splits = splits and self.missed < _IN_ROW
        parts = math.ceil(min(length / self._allowed(), 2**HALVINGS)) if splits else 1
        if parts > 1:
            halves = self._halves(first, last, arcs, level, (parts // 2) / parts)
            if halves is not None:
                return halves
        self.count += 1
        last_box = self.last if isinstance(self.last, Box) else None
        tries = last_box is not None and (last_box.at_once or self.count % _AGAIN == 0)
        like = last_box if tries else None
        box = box_between(self.segments, self.build, first, last, like)
        admissible = NO_BOX if box is None else self.admissible(box)
        refuted = admissible.verdict is Verdict.REFUTED  # by all orbits of the box
        piece = None
        if box is not None and (admissible.proved or not splits or refuted):
            piece = self.piece(box, arcs, (first[-1], last[-1]), admissible)
        whole = piece is not None and piece.proved and piece.decided
        if not (whole or refuted) and splits:
            self.patience = min(2 * self.patience, _PATIENT) if level == 0 else self.patience
            self.length, self.steady = length / 2, 0
            self.turning |= piece is not None and piece.folds == UNKNOWN and any(self.flips)
            halves = self._halves(first, last, arcs, level)
            if halves is not None:
                return halves
        self.proved_length = length if whole else self.proved_length
        self.length = max(self.length, length) if whole else math.inf
        self.steady = self.steady + 1 if whole else _STEADY
        self.missed = self.missed + 1 if admissible.verdict is Verdict.UNDECIDED else 0
        if box and piece:
            return [self.linked(piece, box)]
        return [self._nothing(arcs, first, last)]

    def piece(
        self,
        box: Box,
        arcs: Arcs,
        values: tuple[arb, arb],
        admissible: Finding,
        leaves: bool | None = None,
        singular: bool = False,
    ) -> Piece:
        """Return what is proved of a box, but for its link.

        Parameters
        ----------
        leaves : whether the branch ends in it on the way to its last point; to its first one if False
        singular : whether the chain is singular where it ends, as at a tangential stop
        """
        events = [(label, zero, ends) for label, zero, ends in self.met if box.holds(zero)]
        inside = tuple(label for label, _, _ in events)
        points: list[Vector | None] = [None, None]
        if leaves is not None:
            points[leaves] = next((zero for _, zero, ends in events if ends), None)
        folds = 0 if box.monotone else self._count(box, 1, points, singular)
        # orbits with holds have no multipliers: the least disturbance ends a hold
        held = bool(self.system.holds)
        flips = 0 if held or box.no_flip else self._count(box, -1, points, singular)
        ends = (float(values[0].mid()), float(values[1].mid()))
        off = held or has_no_pair(self.segments, self.plain, self.closes, box)
        tori = 0 if off else UNKNOWN
        knots = self.printed(box.first), self.printed(box.last)
        return Piece(*arcs, ends, True, admissible, folds, flips, tori, events=inside, knots=knots)

    def _count(
        self, box: Box, sigma: int, points: list[Vector | None], singular: bool = False
    ) -> int:
        """Return how often the Jacobian with sigma times the closure is singular between the ends of a box.

        Parameters
        ----------
        points : solutions on its curve in the place of its ends, where the branch ends at one
        singular : whether that one is the place where it is singular
        """
        if not passes_once(self.segments, self.build, box, sigma):
            return UNKNOWN
        signs = []
        for last, known in enumerate(points):
            if known and singular:
                continue
            at = known or section(self.segments, self.plain, box, bool(last))
            if at is None:
                return UNKNOWN
            _, rows = Chain(self.segments, self.build(at[-1])).linearised(at[:-1], sigma)
            signs.append(arb_mat([row[:-1] for row in rows]).det())
        if any(sign.contains(0) for sign in signs):
            return UNKNOWN
        return int(bool(signs[0] * signs[-1] < 0))

    def linked(self, piece: Piece, box: Box) -> Piece:
        """Return a piece with its link to the one before; from now on it is the last one."""
        before, self.last, self.begun = self.last, box, self.begun or box
        if piece.proved:
            self._hold(box, None if piece.ends else (piece.start, piece.stop))
        if before is None:
            return piece
        if isinstance(before, Box):
            return replace(piece, linked=are_linked(self.segments, self.plain, before, box))
        return replace(piece, linked=box.holds(before))

    def _halves(
        self, first: Vector, last: Vector, arcs: Arcs, level: int, share: float = 0.5
    ) -> list[Piece] | None:
        point = self.middle(first, last, share)
        if point is None:
            return None
        between = arcs[0] + share * (arcs[1] - arcs[0])
        return [
            *self.cover(first, point, (arcs[0], between), level + 1),
            *self.cover(point, last, (between, arcs[1]), level + 1),
        ]

    def admissible(self, box: Box) -> Finding:
        """Return whether all orbits of a box obey every inequality: of all at once, or part by part.

        Balls of all of its orbits are as wide as it is long, which a short segment feels first.
        """
        whole = self._failing(self.system, self.segments, box.all)
        if not whole:
            return all_of([])
        count, at = 1, {found.segment for found in whole}
        undecided = all(found.finding.verdict is Verdict.UNDECIDED for found in whole)
        while undecided and count < _PARTS:
            count *= 4
            parts = (box.part(k, count) for k in range(count))
            if not any(self._failing(self.system, self.segments, part, at) for part in parts):
                return all_of([])
        return whole[0].named(self.system)

    def obeys(self, system: System, segments: Segments, x: Vector) -> Finding:
        """Return whether all solutions (z, p) in some balls obey every inequality of a system."""
        found = self._failing(system, segments, x)
        return found[0].named(system) if found else all_of([])

    def _failing(
        self, system: System, segments: Segments, x: Vector, at: Collection[int] | None = None
    ) -> list[Inequality]:
        """Return the inequalities that are not proved for all solutions in some balls, of some segments."""
        model = self.plain(x[-1])
        chain, closing = Chain(segments, model), closing_of(segments, model, system.half)
        joints = chain.joints(x[:-1])
        every = inequalities(chain, system, joints, closing, only=at)
        return [found for found in every if not found.finding.proved]
