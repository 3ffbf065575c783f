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
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from flint import arb

from contfric.base.shown import Shown
from contfric.certify.chain import Chain, Segments, segments_of
from contfric.certify.closing import closing_of, is_symmetry
from contfric.certify.extended import Builder
from contfric.certify.inequalities import inequalities
from contfric.certify.phases import in_phases
from contfric.certify.tube import Box, are_linked, box_between, solved
from contfric.certify.verdict import Finding, Verdict, all_of
from contfric.certify.zeros import Closing
from contfric.continuation.branch import Branch
from contfric.models.balls.build import ball_model
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector, working

#: Bits: rounding of 1e-24 is nothing to boxes that are 1e-7 long.
_BITS = 80
#: Halvings of a step of the branch: events are left with as little about them.
_HALVINGS = 12
#: Shortest step that is halved, as a share of the branch: what is about events is left so short.
_SHORTEST = 1e-5
#: A box is tried only if it is at most this much longer than the last one that was proved.
_GROWTH = 2.5
#: Most boxes that are tried along a branch: some minutes of work.
_MOST = 30_000


@dataclass(frozen=True, eq=False)
class Piece:
    """A stretch of a branch, and what was proved of it.

    Attributes
    ----------
    start, stop : where it is, in arclength of the branch
    values : the parameter at its ends
    exists : there is one curve of solutions in a box about it
    admissible : every orbit of it obeys every inequality
    monotone : the parameter is monotone along it (no SN)
    no_flip : no multiplier of a turn is -1 (no PD, no BP of a half)
    linked : it goes on in the next piece
    """

    start: float
    stop: float
    values: tuple[float, float]
    exists: bool
    admissible: Finding
    monotone: bool = False
    no_flip: bool = False
    linked: bool = True

    @property
    def proved(self) -> bool:
        """Whether it is one curve of admissible orbits."""
        return self.exists and self.admissible.proved

    @property
    def why(self) -> str:
        """What is not proved; empty if all is."""
        return "" if self.proved else self.admissible.why


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
        found = (p for p in self.pieces if p.proved and p.monotone and p.no_flip)
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
    with working(_BITS):
        tracer, pieces, steps = _Tracer(branch, until), [], len(branch) - 1
        for k in range(steps):
            pieces += tracer.step(k)
            if progress is not None:
                progress(f"{branch.name}, step {k + 1} of {steps}, {tracer.count} boxes")
    return BranchCertificate(branch, tuple(pieces), tracer.ended)


class _Tracer:
    """Covers the steps of a branch with boxes."""

    def __init__(self, branch: Branch, until: float) -> None:
        self.branch, self.parameter, self.until = branch, branch.parameter, until
        half = branch.system.half
        orbit = branch[len(branch) // 2]
        self.orbit = orbit
        low, high = float(branch.values.min()), float(branch.values.max())
        exact = self._model(arb(low))
        between = replace(exact, slopes=self._model(arb(low).union(arb(high))).slopes)
        self.whole = half and not is_symmetry(orbit, segments_of(orbit.system), between)
        self.system = orbit.as_whole().system if self.whole else orbit.system
        self.segments: Segments = segments_of(self.system)
        self.build: Builder = self._build
        self.last: Box | None = None
        self.count, self.ended, self.length = 0, "", math.inf
        self.shortest = _SHORTEST * float(branch.arc[-1] - branch.arc[0])

    def _model(self, value: arb) -> BallModel:
        return ball_model(self.branch.model, self.orbit.params, self.parameter, value)

    def _build(self, value: arb) -> BallModel:
        return in_phases(self._model(value))

    def _closing(self, model: BallModel) -> Closing:
        return closing_of(self.segments, model, self.system.half)

    def _point(self, k: int) -> Vector:
        orbit = self.branch[k].as_whole() if self.whole else self.branch[k]
        value = arb(float(self.branch.values[k]))
        period, found = (
            self._model(value).period,
            [[arb(float(c)) for c in row] for row in orbit.joints],
        )
        if not period.is_zero():
            for joint in found:
                joint[0] *= 2 * arb.pi() / period
        return [*(c.mid() for joint in found for c in joint), value]

    def step(self, k: int) -> list[Piece]:
        """Cover the step from point k to the next one."""
        first, last = self._point(k), self._point(k + 1)
        arcs = (float(self.branch.arc[k]), float(self.branch.arc[k + 1]))
        if not self._goes_on():
            return [self._nothing(arcs, first, last)]
        plane = [b - a for a, b in zip(first, last, strict=True)]
        ends = [solved(self.segments, self.build, point, plane) for point in (first, last)]
        if ends[0] is None or ends[1] is None:
            return [self._nothing(arcs, first, last)]
        return self._cover(ends[0], ends[1], arcs, 0)

    def _goes_on(self) -> bool:
        """Tell whether more boxes may be tried; else it is said what ended the work."""
        if time.time() > self.until:
            self.ended = "the time limit ended it"
        elif self.count >= _MOST:
            self.ended = f"{_MOST} boxes were tried"
        return not self.ended

    def _nothing(self, arcs: tuple[float, float], first: Vector, last: Vector) -> Piece:
        self.last = None
        why = Finding(Verdict.UNDECIDED, self.ended or "no box")
        return Piece(*arcs, (float(first[-1].mid()), float(last[-1].mid())), False, why)

    def _cover(
        self, first: Vector, last: Vector, arcs: tuple[float, float], level: int
    ) -> list[Piece]:
        length = arcs[1] - arcs[0]
        splits = level < _HALVINGS and length > self.shortest and self._goes_on()
        if length > _GROWTH * self.length and splits:
            halves = self._halves(first, last, arcs, level)
            if halves is not None:
                return halves
        self.count += 1
        box = box_between(self.segments, self.build, first, last)
        admissible = Finding(Verdict.UNDECIDED, "no box") if box is None else self._admissible(box)
        whole = box is not None and admissible.proved and box.monotone and box.no_flip
        refuted = admissible.verdict is Verdict.REFUTED  # by all orbits of the box
        if not (whole or refuted) and splits:
            self.length = length / 2
            halves = self._halves(first, last, arcs, level)
            if halves is not None:
                return halves
        self.length = max(self.length, length) if whole else math.inf
        if box is None:
            return [self._nothing(arcs, first, last)]
        linked = self.last is None or are_linked(self.segments, self.build, self.last, box)
        self.last = box
        values = (float(first[-1].mid()), float(last[-1].mid()))
        return [Piece(*arcs, values, True, admissible, box.monotone, box.no_flip, linked)]

    def _halves(
        self, first: Vector, last: Vector, arcs: tuple[float, float], level: int
    ) -> list[Piece] | None:
        plane = [b - a for a, b in zip(first, last, strict=True)]
        middle = [((a + b) / 2).mid() for a, b in zip(first, last, strict=True)]
        point = solved(self.segments, self.build, middle, plane)
        if point is None:
            return None
        between = 0.5 * (arcs[0] + arcs[1])
        return [
            *self._cover(first, point, (arcs[0], between), level + 1),
            *self._cover(point, last, (between, arcs[1]), level + 1),
        ]

    def _admissible(self, box: Box) -> Finding:
        model = replace(self.build(box.all[-1]), slopes=None)
        chain = Chain(self.segments, model)
        joints = chain.joints(box.all[:-1])
        found = inequalities(chain, self.system, joints, self._closing(model))
        for inequality in found:
            if not inequality.finding.proved:
                return inequality.named(self.system)
        return all_of([])
