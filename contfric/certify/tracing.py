"""Covers a branch with boxes, from event to event."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
from flint import arb, arb_mat

from contfric.certify.chain import Chain, Segments, segments_of
from contfric.certify.circle import has_no_pair
from contfric.certify.closing import closing_of, is_symmetry
from contfric.certify.events import EventCertificate
from contfric.certify.extended import Builder
from contfric.certify.inequalities import inequalities
from contfric.certify.leaving import WITHIN, Flip, flip_at, join, leave
from contfric.certify.meeting import as_zero_of
from contfric.certify.passing import passes_once
from contfric.certify.phases import in_phases
from contfric.certify.piece import UNKNOWN, Piece
from contfric.certify.tube import Box, are_linked, box_between, section, solved
from contfric.certify.turns import turns_of
from contfric.certify.verdict import Finding, Verdict, all_of
from contfric.continuation.branch import Branch
from contfric.continuation.events import TERMINAL
from contfric.models.balls.build import ball_model
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector
from contfric.orbit.orbit import Orbit
from contfric.orbit.system import System

#: Halvings of a step of the branch: what is not proved then is left.
HALVINGS = 12
#: Shortest step that is halved, as a share of the branch.
_SHORTEST = 1e-5
#: A box is tried only if it is at most this much longer than the last one that was proved.
_GROWTH = 2.5
#: Most boxes that are tried along a branch: some minutes of work.
_MOST = 30_000

#: How far the box of a PD or BP may reach, as a share of the branch.
_FAR = 0.1

Arcs = tuple[float, float]
NO_BOX = Finding(Verdict.UNDECIDED, "no box")


class Tracer:
    """Covers the steps of a branch with boxes.

    Parameters
    ----------
    proofs : certificates of the events of the branch
    until : when to end, by ``time.time``
    """

    def __init__(self, branch: Branch, proofs: list[EventCertificate], until: float) -> None:
        self.branch, self.parameter, self.until = branch, branch.parameter, until
        orbit = branch[len(branch) // 2]
        self.orbit = orbit
        low, high = float(branch.values.min()), float(branch.values.max())
        exact = self._model(arb(low))
        between = replace(exact, slopes=self._model(arb(low).union(arb(high))).slopes)
        half = branch.system.half
        self.whole = half and not is_symmetry(orbit, segments_of(orbit.system), between)
        self.system = orbit.as_whole().system if self.whole else orbit.system
        self.segments: Segments = segments_of(self.system)
        self.build: Builder = self._build
        # the closure is that of whole numbers at every value of the parameter
        self.closes = closing_of(self.segments, self.build(arb(low)), self.system.half)
        self.last: Box | Vector | None = None
        self.count, self.ended, self.length = 0, "", math.inf
        length = float(branch.arc[-1] - branch.arc[0])
        self.shortest, self.far = _SHORTEST * length, _FAR * length
        self.met = self._met(proofs)
        self.flips = [self._flip(proofs, end) for end in (0, -1)]

    # ------------------------------------------------------------------ the branch in balls

    def _model(self, value: arb) -> BallModel:
        return ball_model(self.branch.model, self.orbit.params, self.parameter, value)

    def _build(self, value: arb) -> BallModel:
        return in_phases(self._model(value))

    def _point(self, orbit: Orbit) -> Vector:
        """Return joints (phase and state) and parameter of an orbit of the branch's chain, exact numbers."""
        if self.whole:
            orbit = orbit.as_whole()
        value = arb(orbit.params[self.parameter])
        period = self._model(value).period
        found = [[arb(float(c)) for c in row] for row in orbit.joints]
        if not period.is_zero():
            for joint in found:
                joint[0] *= 2 * arb.pi() / period
        return [*(c.mid() for joint in found for c in joint), value]

    def _met(self, proofs: list[EventCertificate]) -> list[tuple[str, Vector, bool]]:
        """Return label and solution of the proved events on the branch, and whether one may end there."""
        found = []
        for proof in proofs:
            event = proof.event
            own = event.orbit.system is self.branch.system
            near = event.orbit if own else self.branch[0 if self._starts(proof) else -1]
            at = self._point(near)
            zero = as_zero_of(proof, self.system, self.segments, self.build, at)
            if proof.proved and zero is not None:
                found.append((event.label, zero, event.kind in TERMINAL))
        return found

    def _starts(self, proof: EventCertificate) -> bool:
        arc = self.branch.arc
        return proof.event.position <= 0.5 * float(arc[0] + arc[-1])

    def _flip(self, proofs: list[EventCertificate], end: int) -> Flip | None:
        """Return the box of the event at an end, if that is a PD or BP at which two turns become one."""
        at = float(self.branch.arc[end])
        near = self._point(self.branch[end])
        for proof in proofs:
            if proof.proved and abs(proof.event.position - at) <= self.shortest * 1e-3:
                turns = turns_of(proof, self.system, near)
                if turns is not None:
                    return flip_at(self, turns, self._far_from(end))
        return None

    def _far_from(self, end: int) -> Vector:
        """Return the orbit of the branch up to which the box of an event at an end may reach."""
        apart = np.abs(self.branch.arc - self.branch.arc[end]) - self.far
        inner = np.flatnonzero(apart >= 0)
        return self._point(self.branch[int(inner[np.argmin(apart[inner])])])

    def end_of(self, forward: bool) -> tuple[float, float]:
        """Return arclength and parameter at an end of the branch."""
        k = -1 if forward else 0
        return float(self.branch.arc[k]), float(self.branch.values[k])

    def _has_edge(self, end: int) -> bool:
        """Tell whether the branch ends at an event of its inequalities."""
        if self.branch.ends[end].reason.name in [kind.value for kind in TERMINAL]:
            return True
        at = float(self.branch.arc[end])
        return any(
            event.kind in TERMINAL and abs(event.position - at) <= self.shortest * 1e-3
            for event in self.branch.bifurcations
        )

    # ------------------------------------------------------------------ steps

    def step(self, k: int) -> list[Piece]:
        """Cover the step from point k to the next one."""
        printed = self._point(self.branch[k]), self._point(self.branch[k + 1])
        arcs = (float(self.branch.arc[k]), float(self.branch.arc[k + 1]))
        if not self.goes_on():
            return [self._nothing(arcs, *printed)]
        plane = [b - a for a, b in zip(*printed, strict=True)]
        exact = [solved(self.segments, self.build, point, plane) for point in printed]
        first, last = (at or raw for at, raw in zip(exact, printed, strict=True))
        for end, flip in enumerate(self.flips):
            if flip is not None and abs(arcs[1 - end] - self.branch.arc[-end]) < self.far:
                inside = [abs(flip.amplitude(at)) < WITHIN for at in printed]
                if all(inside):
                    return []
                if inside[end]:
                    return join(self, flip, first, last, arcs, end == 1)
        left = k == 0 and self._has_edge(0), k + 2 == len(self.branch) and self._has_edge(-1)
        if all(left):
            middle, between = self.middle(first, last), 0.5 * (arcs[0] + arcs[1])
            if middle is not None:
                before = leave(self, first, middle, (arcs[0], between), False)
                return [*before, *leave(self, middle, last, (between, arcs[1]), True)]
        elif any(left):
            return leave(self, first, last, arcs, left[1])
        elif None not in exact:
            return self.cover(first, last, arcs, 0)
        return [self._nothing(arcs, first, last)]

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

    def middle(self, first: Vector, last: Vector) -> Vector | None:
        """Return the orbit halfway between two others."""
        plane = [b - a for a, b in zip(first, last, strict=True)]
        middle = [((a + b) / 2).mid() for a, b in zip(first, last, strict=True)]
        return solved(self.segments, self.build, middle, plane)

    def cover(self, first: Vector, last: Vector, arcs: Arcs, level: int) -> list[Piece]:
        """Cover the stretch between two orbits with boxes; ``level`` says how often it was halved."""
        length = arcs[1] - arcs[0]
        splits = level < HALVINGS and length > self.shortest and self.goes_on()
        if length > _GROWTH * self.length and splits:
            halves = self._halves(first, last, arcs, level)
            if halves is not None:
                return halves
        self.count += 1
        box = box_between(self.segments, self.build, first, last)
        admissible = NO_BOX if box is None else self.obeys(self.system, self.segments, box.all)
        refuted = admissible.verdict is Verdict.REFUTED  # by all orbits of the box
        piece = None
        if box is not None and (admissible.proved or not splits or refuted):
            piece = self.piece(box, arcs, (first[-1], last[-1]), admissible)
        whole = piece is not None and piece.proved and piece.decided
        if not (whole or refuted) and splits:
            self.length = length / 2
            halves = self._halves(first, last, arcs, level)
            if halves is not None:
                return halves
        self.length = max(self.length, length) if whole else math.inf
        if box is None or piece is None:
            return [self._nothing(arcs, first, last)]
        return [self.linked(piece, box)]

    def piece(
        self,
        box: Box,
        arcs: Arcs,
        values: tuple[arb, arb],
        admissible: Finding,
        leaves: bool | None = None,
    ) -> Piece:
        """Return what is proved of a box, but for its link.

        Parameters
        ----------
        leaves : whether the branch ends in it on the way to its last point; to its first one if False
        """
        events = [(label, zero, ends) for label, zero, ends in self.met if box.holds(zero)]
        inside = tuple(label for label, _, _ in events)
        points: list[Vector | None] = [None, None]
        if leaves is not None:
            points[leaves] = next((zero for _, zero, ends in events if ends), None)
        folds = 0 if box.monotone else self._count(box, 1, points)
        flips = 0 if box.no_flip else self._count(box, -1, points)
        ends = (float(values[0].mid()), float(values[1].mid()))
        off = has_no_pair(self.segments, self.build, self.closes, box)
        tori = 0 if off else UNKNOWN
        return Piece(*arcs, ends, True, admissible, folds, flips, tori, events=inside)

    def _count(self, box: Box, sigma: int, points: list[Vector | None]) -> int:
        """Return how often the Jacobian with sigma times the closure is singular between the ends of a box.

        Parameters
        ----------
        points : solutions on its curve in the place of its ends, where the branch ends at one
        """
        if not passes_once(self.segments, self.build, box, sigma):
            return UNKNOWN
        signs = []
        for end, known in zip((box.first, box.last), points, strict=True):
            at = known or section(self.segments, self.build, box, end)
            if at is None:
                return UNKNOWN
            _, rows = Chain(self.segments, self.build(at[-1])).linearised(at[:-1], sigma)
            signs.append(arb_mat([row[:-1] for row in rows]).det())
        if signs[0].contains(0) or signs[1].contains(0):
            return UNKNOWN
        return int(bool(signs[0] * signs[1] < 0))

    def linked(self, piece: Piece, box: Box) -> Piece:
        """Return a piece with its link to the one before; from now on it is the last one."""
        before, self.last = self.last, box
        if before is None:
            return piece
        if isinstance(before, Box):
            return replace(piece, linked=are_linked(self.segments, self.build, before, box))
        return replace(piece, linked=box.holds(before))

    def _halves(self, first: Vector, last: Vector, arcs: Arcs, level: int) -> list[Piece] | None:
        point = self.middle(first, last)
        if point is None:
            return None
        between = 0.5 * (arcs[0] + arcs[1])
        return [
            *self.cover(first, point, (arcs[0], between), level + 1),
            *self.cover(point, last, (between, arcs[1]), level + 1),
        ]

    def obeys(self, system: System, segments: Segments, x: Vector) -> Finding:
        """Return whether all solutions (z, p) in some balls obey every inequality of a system."""
        model = replace(self.build(x[-1]), slopes=None)
        chain, closing = Chain(segments, model), closing_of(segments, model, system.half)
        for inequality in inequalities(chain, system, chain.joints(x[:-1]), closing):
            if not inequality.finding.proved:
                return inequality.named(system)
        return all_of([])
