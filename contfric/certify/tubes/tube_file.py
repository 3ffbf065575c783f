"""The tube of a branch as plain data, for the independent checker.

A file holds the knots between which the boxes are, the events of multipliers that are in them, and the event
at which the branch ends in the first or last of them. The checker makes its own boxes of these knots, which
are mostly shorter than those of the proof. So here a :class:`_GrowingTube` goes along the boxes of the proof
by steps that the checker decides, each of about the length of the last one. Where they would be far shorter
than the box of the proof, the tube ends, with the reason.
"""

from __future__ import annotations

import json
import math
import time
from typing import TYPE_CHECKING, Any

from flint import ctx

from contfric.certify.files import unknowns_of
from contfric.certify.inequalities.along_segments import DURATION, INSIDE, JOINT
from contfric.certify.tubes.piece import Piece
from contfric.events.bifurcation import TERMINAL, EndReason
from contfric.models.balls.numbers import working
from contfric.verify.curve import Link, check_admissible
from contfric.verify.file import BITS, CHECKED_MODELS, FORMAT, check_text, events_between, orbits_at
from contfric.verify.motion import Refused, Undecided

if TYPE_CHECKING:
    from contfric.certify.branch import BranchCertificate
    from contfric.continuation.branch import Branch

#: Half-width of the times at which a surface may be touched in the box of an end.
_TIMES = 1e-3
#: How often a box of the proof is halved; and one in which the branch ends.
_HALVINGS, _END_HALVINGS = 8, 14
#: Most boxes that are tried along a branch.
_MOST = 20_000
#: How much longer than the last box that was decided the next one is: after some in a row, and before; and
#: how much shorter if one is not.
_STEADY, _GROWTH, _SLOW, _SHORTER = 8, 1.3, 1.04, 0.75
#: How much longer than all before a box may be, over boxes of the proof, where each was decided.
_REACH = 2.5
#: Share of a branch that is left out next to the BP or PD where it is born: boxes shrink in proportion to the
#: distance from there.
_BORN = 0.02
#: Up to which share of the box of an end that the checker does not know a tube is written: before the event,
#: or before a limit of the parameter (which lies at 0.91).
_BEFORE, _BEFORE_LIMIT = 0.8, 0.9
#: What is in a file and not looked at, for a reader of it.
_UNCHECKED = "what lies between an open end (null) and the event at which the branch ends"

_Row = list[float]


class _GrowingTube:
    """A tube that grows from knot to knot by boxes that the checker decides.

    Parameters
    ----------
    data : the file, without knots
    start : its first knot
    until : when to end, by ``time.time``
    """

    def __init__(self, data: dict[str, Any], start: _Row, until: float) -> None:
        self.data, self.until = data, until
        self.rows, self.kinds, self.ends = [start], list[list[str]](), list[Any]([None, None])
        self.point: Link | None = None
        self.tried, self.length, self.steady, self.why = 0, math.inf, _STEADY, ""
        self.longest = 0.0  # box that was decided

    def may_try(self) -> bool:
        """Tell whether there is time for another box; else say what ended the work."""
        if self.tried < _MOST and time.time() < self.until:
            return True
        self.why = f"{_MOST} boxes were tried" if self.tried >= _MOST else "the time limit ended it"
        return False

    def step(self, row: _Row, end: Any = None) -> bool:
        """Go on to a knot, or to an end before it, in one box; else say why not."""
        if not self.may_try():
            return False
        self.tried += 1
        known = [self.point] if self.point else []
        try:
            first, last = orbits_at(self.data | {"knots": [self.rows[-1], row]}, known)
            kinds, _ = events_between(self.data, first, last, end)
            if end:
                check_admissible(*first.orbits(0))
        except (Refused, Undecided, ArithmeticError, ValueError) as error:
            self.why = str(error)
            return False
        self.longest = max(self.longest, math.dist(self.rows[-1], row))
        self.kinds.append([kind for kind in kinds if not end or kind != end[0]])
        self.rows.append(row)
        self.point, self.why = last, ""
        return True

    def march(self, row: _Row, further: bool = False) -> bool:
        """Go on to a knot in as many boxes as it takes; tell whether it is reached.

        Parameters
        ----------
        further : whether it goes on from there, so that a box shorter than half of the others is left out
        """
        start, whole, done = self.rows[-1], math.dist(self.rows[-1], row), 0.0
        while done < 1 and not (further and (1 - done) * whole < 0.5 * self.length < math.inf):
            # not two because one would be a little too long
            boxes = math.ceil(min((1 - done) * whole / self.length - 0.1, 2**_HALVINGS)) or 1
            there = done + (1 - done) / boxes if boxes > 1 else 1.0
            if further and boxes > 1:  # what is left of it belongs to the next ones
                there = done + self.length / whole
            length = (there - done) * whole
            if self.step(_between(start, row, there)):
                done, self.steady = there, self.steady + 1
                self.length *= _GROWTH if self.steady > _STEADY else _SLOW
            elif length * 2**_HALVINGS < whole or not self.may_try():
                return False
            else:
                self.length, self.steady = length * (_SHORTER if self.steady else 0.5), 0
        return True

    def finish(self, row: _Row, end: Any) -> bool:
        """Go on to an end of the branch before a knot."""
        for _ in range(_END_HALVINGS):
            if self.step(row, end):
                return True
            middle = _between(self.rows[-1], row)
            if not self._obeys(middle, row):
                row = middle
            elif not self.march(middle):
                return False
        return False

    def _obeys(self, row: _Row, other: _Row) -> bool:
        """Tell whether the orbit at a knot is admissible."""
        try:
            (_, point) = orbits_at(self.data | {"knots": [other, row]})
            check_admissible(*point.orbits(0))
        except (Refused, Undecided, ArithmeticError, ValueError):
            return False
        return True

    def turned(self) -> _GrowingTube:
        """Return the same tube in the other direction."""
        run = _GrowingTube(self.data, self.rows[-1], self.until)
        run.rows, run.kinds = self.rows[::-1], self.kinds[::-1]
        run.ends, run.tried, run.length = self.ends[::-1], self.tried, self.length
        _, run.point = orbits_at(self.data | {"knots": run.rows[-2:]})
        return run


def _between(a: _Row, b: _Row, share: float = 0.5) -> _Row:
    return [x + share * (y - x) for x, y in zip(a, b, strict=True)] if share < 1 else b


def tubes_of(proof: BranchCertificate, until: float = math.inf) -> list[dict[str, Any]]:
    """Return the tubes along a branch as plain data: one for each run of boxes that the checker decides.

    There are none if the checker does not know the model, or the orbits have holds.

    Parameters
    ----------
    until : when to end, by ``time.time``; the last tube ends there
    """
    branch, cap = proof.branch, ctx.cap
    if branch.model.name not in CHECKED_MODELS or branch.system.holds:
        return []
    ctx.cap = 3
    try:
        with working(BITS[0]):
            runs = _runs(proof, until)
    finally:
        ctx.cap = cap
    return [_data(proof, run) for run in runs if len(run.rows) > 1 + all(run.ends)]


def _runs(proof: BranchCertificate, until: float) -> list[_GrowingTube]:
    runs, run = list[_GrowingTube](), None
    rows = _rows_of(proof)
    for k, (piece, ends) in enumerate(zip(proof.pieces, rows, strict=True)):
        if ends is None:
            run = None
            continue
        a, b = ends
        if run is not None and piece.linked and _goes_further(proof, rows, k, run):
            continue
        if piece.ends and k == 0:
            run = _from_end(proof, b, a, until)
        else:
            if run is None or not piece.linked:
                run = _GrowingTube(_data(proof), a, until)
            _on(proof, k, run, b, _next(proof, rows, k) is not None)
        if run is not None and run not in runs:
            runs.append(run)
        run = None if run is None or run.why or run.ends[1] else run
    return runs


def _rows_of(proof: BranchCertificate) -> list[tuple[_Row, _Row] | None]:
    """Return the knots at the ends of each box of the proof; None for a box that is not in the file."""
    branch = proof.branch
    size, kept = len(branch.system.itinerary) * branch[0].joints.shape[1] + 1, _kept(branch)
    found: list[tuple[_Row, _Row] | None] = []
    for piece in proof.pieces:
        known = piece.proved and bool(piece.knots) and len(piece.knots[0]) == size
        known = known and kept[0] <= piece.start and piece.stop <= kept[1]
        knots = ([*unknowns_of(c[:-1].tolist()), float(c[-1])] for c in piece.knots)
        found.append(tuple(knots) if known else None)  # type: ignore[arg-type]
    return found


def _goes_further(
    proof: BranchCertificate,
    rows: list[tuple[_Row, _Row] | None],
    k: int,
    run: _GrowingTube,
) -> bool:
    """Tell whether a box of the checker may reach over a whole box of the proof into the next one."""
    after = _next(proof, rows, k)
    if after is None or proof.pieces[k].ends:
        return False
    most = run.length if run.length < math.inf else _REACH * run.longest
    return math.dist(run.rows[-1], after[1]) < most


def _next(
    proof: BranchCertificate, rows: list[tuple[_Row, _Row] | None], k: int
) -> tuple[_Row, _Row] | None:
    """Return the knots of the next box of the proof, if the tube goes on in it."""
    after = proof.pieces[k + 1] if k + 1 < len(rows) else None
    return rows[k + 1] if after is not None and after.linked and not after.ends else None


def _kept(branch: Branch) -> tuple[float, float]:
    """Return the arclength from and up to which a branch is in its file."""
    first, last = float(branch.arc[0]), float(branch.arc[-1])
    born = [end.reason in (EndReason.BP, EndReason.PD) for end in branch.ends]
    left_out = [_BORN * (last - first) * there for there in born]
    if branch.ends[1].reason is EndReason.CLOSED:  # its last point may lie beyond its first one
        last = float(branch.arc[-2])
    return first + left_out[0], last - left_out[1]


def _data(proof: BranchCertificate, run: _GrowingTube | None = None) -> dict[str, Any]:
    """Return a tube as plain data; without a run one that has no knots yet."""
    branch, system = proof.branch, proof.branch.system
    kinds = run.kinds if run else []
    return {
        "certificate": "tube",
        "format": FORMAT,
        "model": branch.model.name,
        "params": {k: v for k, v in branch[0].params.items() if k != branch.parameter},
        "parameter": branch.parameter,
        "periods": branch[0].periods,
        "half": bool(system.half),
        "segments": [list(pair) for pair in system.itinerary],
        "knots": run.rows if run else [],
        "events": [[k, kind] for k, found in enumerate(kinds) for kind in found],
        "ends": run.ends if run else [None, None],
        "unchecked": _UNCHECKED + (f"; it goes no further: {run.why}" if run and run.why else ""),
    }


def _from_end(
    proof: BranchCertificate, row: _Row, before: _Row, until: float
) -> _GrowingTube | None:
    """Return the tube from an end of the branch before a knot to another knot, if one is decided."""
    ends = _ends(proof, proof.pieces[0])
    if not ends:
        share = _before(proof.pieces[0])
        run = _GrowingTube(_data(proof), _between(row, before, share), until)
        return run if run.march(row) else None
    for end in ends:
        run = _GrowingTube(_data(proof), row, until)
        if run.finish(before, end):
            run.ends[1] = end
            run = run.turned()
            return run if check_text(json.dumps(_data(proof, run))).yes else None
    return None


def _on(proof: BranchCertificate, k: int, run: _GrowingTube, row: _Row, further: bool) -> None:
    """Let a tube go on through a box of the proof, or to the end of the branch in it."""
    piece = proof.pieces[k]
    if not piece.ends:
        run.march(row, further)
    elif k == len(proof.pieces) - 1:
        ends = _ends(proof, piece)
        if not ends:
            run.march(_between(run.rows[-1], row, _before(piece)))
        for end in ends:
            if run.finish(row, end):
                run.ends[1] = end
                break


def _before(piece: Piece) -> float:
    return _BEFORE if piece.events else _BEFORE_LIMIT


def _ends(proof: BranchCertificate, piece: Piece) -> list[list[Any]]:
    """Return kind and places of the events at which the branch may end in a box: those that are checked."""
    terminal = {end.value for end in TERMINAL}
    labels = [label for label in piece.events if label.split("_")[0] in terminal]
    ends: list[list[Any]] = [
        [label.split("_")[0], _places(proof, piece, label)] for label in labels
    ]
    return [end for end in ends if end[1]]


def _places(proof: BranchCertificate, piece: Piece, label: str) -> list[list[Any]]:
    """Return what vanishes in the itineraries of the checker: loads at stops, or what is touched and when."""
    system, found = proof.branch.system, list[list[Any]]()
    for name in piece.ends:
        i, level = name.segment, 1 if name.surface == "F+" else -1
        if name.what == DURATION:  # the load at the stop before
            level = (-1 if system.half and i == 0 else 1) * (
                1 if system.itinerary[i][1] == "F+" else -1
            )
            i = (i - 1) % len(system.itinerary)
        if name.what in (JOINT, DURATION) and [i, level] not in found:
            found.append([i, level])
    own = next((p for p in proof.proofs if p.event.label == label), None)
    condition = own.location.condition if own is not None and own.location is not None else None
    if found or own is None or condition is None or not condition.within:
        return found
    time = f"{float(own.zero[-2])!r} +/- {_TIMES!r}"
    return [[n.segment, n.surface, time] for n in piece.ends if n.what == INSIDE]
