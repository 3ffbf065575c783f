"""Turn a branch into a theorem: a tube of overlapping boxes along it.

In each box (:mod:`contfric.certify.tube`) the orbits are one smooth curve, and neighbours hold the same
one: the end of each box lies inside of the next. So between the first and the last box of a stretch there
is one curve, and inside of the boxes no second one. In each box every inequality holds over the whole of
every segment, the parameter is monotone, or a fold may be in it, and no multiplier of a turn is -1, or
one may be. Boxes are halved until all of that is decided, or too short. What is left is listed: at the
ends of a branch, where an inequality vanishes, and about its events.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from contfric.certify.events import certify_event
from contfric.certify.piece import Piece
from contfric.certify.tracing import Tracer
from contfric.continuation.branch import Branch
from contfric.models.balls.numbers import working
from contfric.shown import Shown

#: Bits: rounding of 1e-24 is nothing to boxes that are 1e-7 long.
_BITS = 80


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
    """

    branch: Branch
    pieces: tuple[Piece, ...]
    ended: str = ""

    @property
    def covered(self) -> float:
        """Share of the arclength on which the branch is proved to be one curve of admissible orbits."""
        whole = sum(p.stop - p.start for p in self.pieces)
        return sum(p.stop - p.start for p in self.pieces if p.proved) / whole if whole else 0.0

    @property
    def regular(self) -> float:
        """Share of the arclength on which it has neither a fold nor a multiplier -1 in addition."""
        whole = sum(p.stop - p.start for p in self.pieces)
        found = (p for p in self.pieces if p.regular)
        return sum(p.stop - p.start for p in found) / whole if whole else 0.0

    @property
    def proved(self) -> bool:
        """Whether the proved pieces are one curve: nothing is left but at the ends of the branch."""
        inner = [k for k, piece in enumerate(self.pieces) if piece.proved]
        if not inner:
            return False
        within = self.pieces[inner[0] : inner[-1] + 1]
        return all(piece.proved for piece in within) and all(p.linked for p in within[:-1])

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


def certify_branch(
    branch: Branch, until: float = math.inf, progress: Callable[[str], None] | None = None
) -> BranchCertificate:
    """Prove what can be proved of a branch.

    Parameters
    ----------
    until : when to end, by ``time.time``; what is left then is listed as such
    progress : hears how far it is

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
    proofs = [certify_event(event, branch.parameter) for event in branch.bifurcations]
    with working(_BITS):
        tracer = Tracer(branch, proofs, until)
        pieces, steps = [], len(branch) - 1
        for k in range(steps):
            pieces += tracer.step(k)
            if progress is not None:
                progress(f"{branch.name}, step {k + 1} of {steps}, {tracer.count} boxes")
    return BranchCertificate(branch, tuple(pieces), tracer.ended)
