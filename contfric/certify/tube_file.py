"""The tube of a branch as plain data, for the independent checker.

A file holds the knots between which the boxes are, the events of multipliers that are in them, and the event
at which the branch ends in the first or last of them. The checker makes its own boxes of these knots, which
are shorter than those of the proof: here they are halved until it decides each.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from flint import ctx

from contfric.certify.files import unknowns_of
from contfric.certify.inequalities import DURATION, INSIDE, JOINT
from contfric.certify.piece import Piece
from contfric.continuation.events import TERMINAL, EndReason
from contfric.models.balls.numbers import working
from contfric.verify.curve import Box, check_admissible
from contfric.verify.file import (
    BITS,
    CHECKED_MODELS,
    FORMAT,
    check_text,
    events_between,
    orbits_at,
)
from contfric.verify.motion import Refused, Undecided

if TYPE_CHECKING:
    from contfric.certify.branch import BranchCertificate
    from contfric.continuation.branch import Branch

#: Half-width of the times at which a surface may be touched in the box of an end.
_TIMES = 1e-3
#: How often a box of the proof is halved.
_HALVINGS = 14
#: Share of a branch that is left out next to the BP or PD where it is born: boxes shrink in proportion to the
#: distance from there.
_BORN = 0.02
#: What is in a file and not looked at, for a reader of it.
_UNCHECKED = "what lies between an open end (null) and the event at which the branch ends"

_Row = list[float]
#: Knots, and the kinds of the events between each two.
_Part = tuple[list[_Row], list[list[str]]]


def tubes_of(proof: BranchCertificate) -> list[dict[str, Any]]:
    """Return the tubes along a branch as plain data: one for each run of boxes that the checker decides.

    There are none if the checker does not know the model, or the orbits have holds.
    """
    branch = proof.branch
    if branch.model.name not in CHECKED_MODELS or branch.system.holds:
        return []
    size = len(branch.system.word) * branch[0].joints.shape[1] + 1
    runs: list[tuple[list[Any], _Part]] = []
    joined, kept, zeta = False, _kept(branch), branch.parameter == "zeta"
    for k, piece in enumerate(proof.pieces):
        known = piece.proved and bool(piece.knots) and len(piece.knots[0]) == size
        known = known and kept[0] <= piece.start and piece.stop <= kept[1]
        # the checker's square root of zeta^2 - 1 has no power series at 0
        known = known and not (zeta and min(piece.values) <= 1 <= max(piece.values))
        part, ends = _decided(proof, k) if known else (None, [None, None])
        if part is not None and joined and piece.linked and not ends[0]:
            (first, _), (rows, kinds) = runs[-1]
            runs[-1] = [first, ends[1]], (rows + part[0][1:], kinds + part[1])
        elif part is not None:
            runs.append((ends, part))
        joined = part is not None and not ends[1]
    found = [_data(proof, ends, *part) for ends, part in runs]
    return [tube for tube in found if check_text(json.dumps(tube)).yes]


def _kept(branch: Branch) -> tuple[float, float]:
    """Return the arclength from and up to which a branch is in its file."""
    first, last = float(branch.arc[0]), float(branch.arc[-1])
    born = [end.reason in (EndReason.BP, EndReason.PD) for end in branch.ends]
    left_out = [_BORN * (last - first) * there for there in born]
    return first + left_out[0], last - left_out[1]


def _data(
    proof: BranchCertificate, ends: list[Any], rows: list[_Row], kinds: list[list[str]]
) -> dict[str, Any]:
    branch, system = proof.branch, proof.branch.system
    return {
        "certificate": "tube",
        "format": FORMAT,
        "model": branch.model.name,
        "params": branch[0].params,
        "parameter": branch.parameter,
        "periods": branch[0].periods,
        "half": bool(system.half),
        "segments": [list(pair) for pair in system.word],
        "knots": rows,
        "events": [[k, kind] for k, found in enumerate(kinds) for kind in found],
        "ends": ends,
        "unchecked": _UNCHECKED,
    }


def _decided(proof: BranchCertificate, k: int) -> tuple[_Part | None, list[Any]]:
    """Return a box of the proof as boxes that the checker decides, and the event at each of its ends."""
    piece = proof.pieces[k]
    a, b = ([*unknowns_of(c[:-1].tolist()), float(c[-1])] for c in piece.knots)
    data, cap = _data(proof, [None, None], [], []), ctx.cap
    ctx.cap = 3
    try:
        with working(BITS[0]):
            if not piece.ends:
                return _halved(data, a, b), [None, None]
            for end in _ends(proof, piece):
                if k == 0 and (part := _halved(data, b, a, end)):
                    return (part[0][::-1], part[1][::-1]), [end, None]
                if k == len(proof.pieces) - 1 and (part := _halved(data, a, b, end)):
                    return part, [None, end]
    finally:
        ctx.cap = cap
    return None, [None, None]


def _halved(data: Any, a: _Row, b: _Row, end: Any = None, level: int = 0) -> _Part | None:
    """Return boxes from a to b, or to an end before b, that the checker decides; None if there are none."""
    try:
        first, last = orbits_at(data | {"knots": [a, b]})
        kinds, _ = events_between(data, first, last, end)
        if end:
            check_admissible(*first.orbits(0))
        return [a, b], [[kind for kind in kinds if not end or kind != end[0]]]
    except (Refused, Undecided, ArithmeticError, ValueError):
        if level == _HALVINGS:
            return None
    middle = [(x + y) / 2 for x, y in zip(a, b, strict=True)]
    if end and not _obeys(data, a, middle, b):
        return _halved(data, a, middle, end, level + 1)
    before = _halved(data, a, middle, None, level + 1)
    after = _halved(data, middle, b, end, level + 1) if before else None
    return (before[0] + after[0][1:], before[1] + after[1]) if before and after else None


def _obeys(data: Any, *knots: _Row) -> bool:
    """Tell whether the orbit in the middle of three is admissible."""
    try:
        points: list[Box] = orbits_at(data | {"knots": list(knots)})
        check_admissible(*points[1].orbits(0))
    except (Refused, Undecided, ArithmeticError, ValueError):
        return False
    return True


def _ends(proof: BranchCertificate, piece: Piece) -> list[list[Any]]:
    """Return kind and places of the events at which the branch may end in a box."""
    terminal = {end.value for end in TERMINAL}
    labels = [label for label in piece.events if label.split("_")[0] in terminal]
    return [[label.split("_")[0], _places(proof, piece, label)] for label in labels]


def _places(proof: BranchCertificate, piece: Piece, label: str) -> list[list[Any]]:
    """Return what vanishes in the words of the checker: loads at stops, or what is touched and when."""
    system, found = proof.branch.system, list[list[Any]]()
    for name in piece.ends:
        i, level = name.segment, 1 if name.surface == "F+" else -1
        if name.what == DURATION:  # the load at the stop before
            level = (-1 if system.half and i == 0 else 1) * (1 if system.word[i][1] == "F+" else -1)
            i = (i - 1) % len(system.word)
        if name.what in (JOINT, DURATION) and [i, level] not in found:
            found.append([i, level])
    own = next((p for p in proof.proofs if p.event.label == label), None)
    condition = own.location.condition if own is not None and own.location is not None else None
    if found or own is None or condition is None or not condition.within:
        return found
    time = f"{float(own.zero[-2])!r} +/- {_TIMES!r}"
    return [[n.segment, n.surface, time] for n in piece.ends if n.what == INSIDE]
