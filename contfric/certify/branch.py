"""Prove a branch: a tube of overlapping boxes along it.

In each box (:mod:`contfric.certify.tubes.tube`) the orbits are one smooth curve, and neighbours hold the same
one: the end of each box lies inside of the next. So between the first and the last box of a stretch there
is one curve, and inside of the boxes no second one. In each box every inequality holds over the whole of
every segment, the parameter is monotone, or a fold may be in it, and no multiplier of a turn is -1, or
one may be. Boxes are halved until all of that is decided, or too short. What is left is listed: at the
ends of a branch, where an inequality vanishes, and about its events.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from contfric.base.shown import Shown
from contfric.certify.certificate import Certificate
from contfric.certify.events import EventCertificate, certify_event
from contfric.certify.orbit import certify_orbit, with_inequalities
from contfric.certify.tubes.piece import Piece
from contfric.certify.tubes.tracing import Tracer
from contfric.certify.verdict import Finding, Verdict
from contfric.continuation.branch import Branch
from contfric.errors import ParameterError
from contfric.events.bifurcation import TERMINAL, EndReason
from contfric.models.balls.numbers import working

#: Bits: rounding of 1e-24 is nothing to boxes that are 1e-7 long.
_BITS = 80


#: What is counted in a piece, and kinds of the events that it may be.
_COUNTED: tuple[tuple[str, set[str], Callable[[Piece], int]], ...] = (
    ("folds", {"SN"}, lambda piece: piece.folds),
    ("flips", {"PD", "BP"}, lambda piece: piece.flips),
    ("tori", {"NS"}, lambda piece: piece.tori),
)
_MISSED = {
    "folds": "a fold may be there",
    "flips": "a multiplier -1 may be there",
    "tori": "a pair of multipliers may be on the unit circle",
}
#: Reasons of ends that are events.
_AT_EVENTS = frozenset({EndReason[kind.value] for kind in TERMINAL} | {EndReason.BP, EndReason.PD})


def _runs(pieces: tuple[Piece, ...], count: Callable[[Piece], int]) -> list[list[Piece]]:
    """Return the runs of neighbouring pieces in which something may be."""
    groups = itertools.groupby(pieces, key=lambda piece: count(piece) > 0)
    return [list(group) for there, group in groups if there]


@dataclass(frozen=True, eq=False, repr=False)
class BranchCertificate(Shown):
    """What was proved of a branch.

    Attributes
    ----------
    branch : Branch
        The printed branch.
    pieces : tuple of Piece
        Along the branch, in its order.
    ended : str
        What ended the work before all was tried; empty if nothing did.
    points : tuple of Certificate
        Those of its printed orbits, in its order.
    proofs : tuple of EventCertificate
        Those of its events.
    held : frozenset of int
        Numbers of orbits that are alone by the tube that holds them; not within their stated error, which is
        large next to a PD or BP.
    """

    branch: Branch
    pieces: tuple[Piece, ...]
    ended: str = ""
    points: tuple[Certificate, ...] = ()
    proofs: tuple[EventCertificate, ...] = ()
    held: frozenset[int] = frozenset()

    @property
    def points_proved(self) -> int:
        """How many of the printed orbits are proved, with their stability; at an event none can be."""
        numbered = enumerate(self.points)
        return sum(p.proved or (k in self.held and p.proved_but_unique) for k, p in numbered)

    def save(self, path: Any) -> None:
        """Write the certificates of all printed orbits and events, and its tubes, for ``contfric verify``.

        Raises
        ------
        ParameterError
            If there is nothing that the checker knows.
        ResultFileError
            If the file cannot be written.
        """
        from contfric.certify.diagram_certificate import LEFT_OUT, UNCHECKED
        from contfric.certify.files import checkable, checked, write_data
        from contfric.certify.tubes.tube_file import tubes_of

        parts = [*checkable([*self.proofs, *self.points]), *tubes_of(self)]
        if not parts:
            raise ParameterError(
                "there is nothing to write: no proof of this branch is one that the checker knows"
            )
        data = {"certificate": "diagram", "format": 1, "checkable": parts, "unchecked": UNCHECKED}
        reasons = [(proof.event.label, checked(proof)[1]) for proof in self.proofs if proof.proved]
        data[LEFT_OUT] = [f"{label}: {why}" for label, why in reasons if why]
        write_data(data, path)

    @property
    def covered(self) -> float:
        """Share of the arclength on which the branch is proved to be one curve of admissible orbits."""
        return self._share([p for p in self.pieces if p.proved])

    @property
    def regular(self) -> float:
        """Share of the arclength on which it has neither a fold nor a multiplier -1 in addition."""
        return self._share([p for p in self.pieces if p.regular])

    def _share(self, pieces: Sequence[Piece]) -> float:
        whole = sum(p.stop - p.start for p in self.pieces)
        return sum(p.stop - p.start for p in pieces) / whole if whole else 0.0

    @property
    def proved(self) -> bool:
        """Whether the proved pieces are one curve: nothing is left but at the ends of the branch."""
        inner = [k for k, piece in enumerate(self.pieces) if piece.proved]
        if not inner:
            return False
        within = self.pieces[inner[0] : inner[-1] + 1]
        return all(piece.proved for piece in within) and all(p.linked for p in within[1:])

    @property
    def events(self) -> tuple[str, ...]:
        """Labels of the proved events that its tube holds."""
        return tuple(dict.fromkeys(label for piece in self.pieces for label in piece.events))

    @property
    def complete(self) -> bool:
        """Whether it is one curve of admissible orbits from end to end, with proved events only."""
        linked = all(piece.linked for piece in self.pieces[1:])
        return bool(self.pieces) and linked and not self.gaps and not self.open

    @property
    def open(self) -> list[str]:
        """Where an event of multipliers may be that is not proved, and ends without a proved one."""
        found = []
        # orbits with holds have no multipliers: of the events of a curve they have folds only
        for name, kinds, count in _COUNTED[:1] if self.branch.system.holds else _COUNTED:
            for run in _runs(self.pieces, count):
                known = {label.split("_")[0] for piece in run for label in piece.events}
                if not known & kinds or (name != "tori" and len(run) > 1):
                    at = f"{run[0].values[0]:.12g} to {run[-1].values[1]:.12g}"
                    found.append(f"{self.branch.parameter} from {at}: {_MISSED[name]}")
        for piece, end in zip((self.pieces[0], self.pieces[-1]), self.branch.ends, strict=True):
            if end.reason in _AT_EVENTS and not piece.events:
                found.append(f"no proved event at the end '{end}'")
        return found

    @property
    def gaps(self) -> list[str]:
        """What is not proved, a line each: where, and why."""
        return [
            f"{self.branch.parameter} from {p.values[0]:.12g} to {p.values[1]:.12g}: {p.why}"
            for p in self.pieces
            if not p.proved
        ]

    @property
    def why(self) -> str:
        """What is not proved, in one line; empty if all is but the ends."""
        return "" if self.proved else "; ".join(self.gaps[:3]) or "pieces are not linked"

    def __repr__(self) -> str:
        return (
            f"<Certificate of {self.branch!r}: {'proved' if self.proved else 'not whole'}, "
            f"{100 * self.covered:.4g} % of the arclength, {len(self.pieces)} boxes>"
        )


def certify_points(
    branch: Branch, until: float = math.inf, inside: bool = True
) -> list[Certificate]:
    """Prove the printed orbits of a branch, each by itself; see :func:`certify_orbit`."""
    points = list[Certificate]()
    for orbit in branch:
        if time.time() > until:
            break
        points.append(certify_orbit(orbit, inside, until))
    return points


def certify_branch(
    branch: Branch,
    until: float = math.inf,
    progress: Callable[[str], None] | None = None,
    points: Sequence[Certificate] | None = None,
) -> BranchCertificate:
    """Prove what can be proved of a branch.

    Parameters
    ----------
    until : when to end, by ``time.time``; what is left then is listed as such
    progress : called with one line of text now and then
    points : certificates of its printed orbits, if they are known. If not, all but their inequalities is
        proved first; those hold in the tube, and are looked at where there is no tube. With a time limit they
        may not come to it, so that all of an orbit is proved first.

    Raises
    ------
    ParameterError
        If proofs are not offered for the model.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5})
    >>> certify_branch(cf.continue_orbit(orbit, "Omega", (0.495, 0.505))).proved
    True
    """
    like = branch[len(branch) // 2]
    proofs = [certify_event(event, branch.parameter, until, like) for event in branch.bifurcations]
    if points is None:
        points = certify_points(branch, until, inside=until < math.inf)
    with working(_BITS):
        tracer = Tracer(branch, proofs, until, points)
        pieces = cover(tracer, progress)
    points = [
        replace(point, admissible=Finding(Verdict.PROVED))  # all orbits of its box are
        if k in tracer.obeying
        else with_inequalities(point, until)
        for k, point in enumerate(points)
    ]
    held = frozenset(tracer.held)
    return BranchCertificate(
        branch, tuple(pieces), tracer.ended, tuple(points), tuple(proofs), held
    )


def _parts(tracer: Tracer) -> list[tuple[int, int]]:
    """Return the parts of a branch in the order in which they are to be covered: numbers of their points.

    Where its period has no bound towards its start (near a saddle, say) its equations may be nearly singular
    for many steps, whose boxes would take all the time. So it is covered from the first printed orbit on that
    is proved to be alone, and then from parts next to that towards the start. At most limits of the parameter
    only the first orbits, which one step covers, are not alone.
    """
    start = min(tracer.unique, default=0)
    at_event = tracer.flips[0] is not None or (tracer.has_edge(0) and not tracer.is_limit(0))
    if at_event or (tracer.is_limit(0) and start <= tracer.after(0)):
        start = 0
    last = len(tracer.branch) - 1
    parts = [(start, last)] if start < last else []
    while start > 0:
        parts.append((start // 2, start))
        start //= 2
    return parts


def cover(tracer: Tracer, progress: Callable[[str], None] | None = None) -> list[Piece]:
    """Return the pieces of a branch, in its order, whatever part of it is covered first."""
    pieces, branch, begun = list[Piece](), tracer.branch, None
    for start, stop in _parts(tracer):
        part, k = list[Piece](), start
        tracer.begin()
        while k < stop:
            if tracer.is_twice(k):
                k += 1
                continue
            found, k = tracer.step(k, stop)
            part += found
            if progress is not None:
                progress(f"{branch.name}, step {k} of {len(branch) - 1}, {tracer.count} boxes")
        if begun is not None and pieces[0].exists:
            pieces[0] = tracer.linked(pieces[0], begun)
        pieces, begun = part + pieces, tracer.begun
    return pieces
