"""The tube of a branch as plain data, for the independent checker.

A file holds the knots between which the boxes are, the events of multipliers that are in them, and the event
at which the branch ends in the first or last of them. The checker makes its own boxes of these knots.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from contfric.certify.inequalities import DURATION, INSIDE, JOINT
from contfric.certify.piece import Piece
from contfric.continuation.events import TERMINAL
from contfric.verify.curves.file import check_text
from contfric.verify.file import CHECKED_MODELS

if TYPE_CHECKING:
    from contfric.certify.branch import BranchCertificate

#: Half-width of the times at which a surface may be touched in the box of an end.
_TIMES = 1e-3
#: What is in a file and not looked at, for a reader of it.
_UNCHECKED = "what lies between an open end (null) and the event at which the branch ends"


def tubes_of(proof: BranchCertificate) -> list[dict[str, Any]]:
    """Return the tubes along a branch as plain data: one for each run of linked boxes.

    There are none if the checker does not know the model, or the orbits have holds. Boxes with a damping of 1
    or more are left out: the square root of ``1 - zeta^2`` is no power series with real coefficients there.
    So is a tube that the checker does not decide, which would spoil its file.
    """
    branch = proof.branch
    size = len(branch.system.itinerary) * branch[0].joints.shape[1] + 1
    if branch.model.name not in CHECKED_MODELS or branch.system.holds:
        return []
    runs: list[list[Piece]] = [[]]
    for piece in proof.pieces:
        known = piece.proved and bool(piece.knots) and len(piece.knots[0]) == size
        damping = piece.values if branch.parameter == "zeta" else [branch[0].params["zeta"]]
        known = known and max(damping) < 1
        if not (known and piece.linked):
            runs.append([])
        if known:
            runs[-1].append(piece)
    found = [_tube(proof, run) for run in runs if run]
    return [tube for tube in found if check_text(json.dumps(tube)).yes]


def _tube(proof: BranchCertificate, run: list[Piece]) -> dict[str, Any]:
    first, last = (_end(proof, run, k) for k in (0, -1))
    if run[0].ends and first is None:
        run = run[1:] or run
    if run[-1].ends and last is None:
        run = run[:-1] or run
    return _data(proof, run, [first, last])


def _data(proof: BranchCertificate, run: list[Piece], ends: list[Any]) -> dict[str, Any]:
    branch, system = proof.branch, proof.branch.system
    orbit = branch[0]
    columns = [j for j in range(orbit.joints.size + 1) if j % orbit.joints.shape[1] != 2]
    knots = [run[0].knots[0], *(piece.knots[1] for piece in run)]
    flip = "BP" if system.half else "PD"
    events = [
        [k, kind]
        for k, piece in enumerate(run)
        for kind, there in (
            ("SN", piece.folds == 1),
            (flip, piece.flips == 1),
            ("NS", piece.tori and any(label.startswith("NS") for label in piece.events)),
        )
        if there
    ]
    return {
        "certificate": "tube",
        "format": 1,
        "model": branch.model.name,
        "params": orbit.params,
        "parameter": branch.parameter,
        "periods": orbit.periods,
        "half": bool(system.half),
        "segments": [list(pair) for pair in system.itinerary],
        "knots": [knot[columns].tolist() for knot in knots],
        "events": events,
        "ends": ends,
        "unchecked": _UNCHECKED,
    }


def _end(proof: BranchCertificate, run: list[Piece], k: int) -> list[Any] | None:
    """Return kind and place of the event at which the branch ends in a box, if the checker confirms it."""
    piece = run[k]
    for label in piece.events:
        kind = label.split("_")[0]
        if not piece.ends or kind not in {end.value for end in TERMINAL}:
            continue
        at = _places(proof, piece, label)
        ends = [[kind, at], None] if k == 0 else [None, [kind, at]]
        if check_text(json.dumps(_data(proof, [piece], ends))).yes:
            return [kind, at]
    return None


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
