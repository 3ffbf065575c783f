"""The state of an exploration of a plane: curves, sections, points whose curves wait to be followed."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from contfric.atlas.diagram import Diagram
from contfric.base.arrays import FloatArray
from contfric.curves.curve import Curve
from contfric.curves.half_curve import CurveSide
from contfric.curves.problem import Problem
from contfric.curves.ranges import PlaneRanges
from contfric.curves.special import SpecialPoint
from contfric.events.bifurcation import Kind

Progress = Callable[[str], None]


@dataclass(eq=False)
class PlaneExploration:
    """State of one exploration of a plane."""

    box: PlaneRanges
    vector: FloatArray
    kinds: frozenset[Kind]
    max_periods: int
    max_curves: int
    largest: float
    progress: Progress | None
    curves: list[Curve] = field(default_factory=list)
    sections: list[Diagram] = field(default_factory=list)
    waiting: deque[tuple[SpecialPoint, Problem]] = field(default_factory=deque)
    unread: deque[Curve] = field(default_factory=deque)
    notes: list[str] = field(default_factory=list)
    complete: bool = True

    def say(self, text: str) -> None:
        """Report progress."""
        if self.progress is not None:
            self.progress(text)

    @property
    def full(self) -> bool:
        """Whether no more curves may be computed."""
        return len(self.curves) >= self.max_curves

    def add(self, curve: Curve, sides: Sequence[CurveSide]) -> None:
        """Register a curve, and let what leaves its points of codimension two wait."""
        self.curves.append(curve)
        self.unread.append(curve)
        self.say(f"curve {len(self.curves)}: {curve!r}")
        for side in sides:
            piece: CurveSide | None = side
            while piece is not None:
                self.waiting.extend((special, piece.problem) for special in piece.special)
                piece = piece.following

    def wants(self, problem: Problem) -> bool:
        """Tell whether a curve is of the kinds and periods asked for."""
        return problem.kind in self.kinds and problem.system.periods <= self.max_periods
