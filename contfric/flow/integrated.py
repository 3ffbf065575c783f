"""A flow from the functions of a model: its fields, its observables, and what else is its own.

To write a model by hand, write its functions as kernels (decorated with
:func:`contfric.compiled.kernel`). There are n states; ``which`` lists the m parameters that are
differentiated by; whatever has no space (an array of length 0) is not filled.

1. ``field(mode, t, y, p, which, out, jac)`` (``field_signature``): write dy/dt to ``out`` (n,) and, if
   ``jac`` (n, 1 + n + m) has rows, its derivatives by t, y and ``p[which]``. A mode is one smooth field: it
   is evaluated a little beyond the surfaces that bound it, so that ``|v|`` is ``v`` in the mode with v > 0,
   and not ``abs(v)``.
2. ``observe(c, t, y, p, which, grad)``: return observable c; its derivatives to ``grad`` (1 + n + m,).
3. ``rate(mode, c, t, y, p, which, grad)``: return the rate of observable c along a mode; the same
   gradient.
4. ``period(p, which, grad)``: return the period of the excitation, or 0; ``grad`` (m,).
   The field and the observables must have this period.
5. ``scale(i, p)`` (``scale_signature``): return the natural size of state i, the unit of its absolute
   tolerance. A state that is multiplied by a stiffness of 1000 in the field has the scale 1/1000. Negative:
   the size of a state that is known to a share of itself, with no absolute tolerance (its range begins at 0).
6. ``level(k, p, which, grad)``: return the level of surface k.

Then ``Functions(field=field, ...).flow(level)`` is the flow, a ``CompiledFlow``. ``tests/integrated`` has
such modules. Only these functions are compiled for the model; the integrators are compiled once for all.

What breaks down (a state beyond all numbers, too many steps, a field that is no number) is handed back
as states that are no numbers, and as -1 stationary points; the engine says so.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import Any

import numpy as np

from contfric.compiled import Kernel
from contfric.flow.general import FlowKind, kernels_of, still
from contfric.flow.integration.dop853 import POWER
from contfric.flow.interface import CompiledFlow
from contfric.flow.layouts import MODEL
from contfric.flow.linear.kept import NUMBERS
from contfric.handle import Block, Bound


class Method(str, Enum):
    """How a solution is integrated."""

    EXPLICIT = "explicit"
    IMPLICIT = "implicit"
    AUTOMATIC = "automatic"


#: Error that a step may make, relative to a state and relative to its scale: the error of a segment is
#: about as large (docs/integration.md), and Newton's method on a chain of segments sees a smooth map.
TOLERANCE = 1e-12


@dataclass(frozen=True)
class AffineModes:
    """The modes that are affine, and their functions (:mod:`contfric.models.generated.linear_code`).

    Attributes
    ----------
    functions : by their names, ``entries`` to ``look`` (:mod:`contfric.flow.layouts`)
    entries, waves : most coefficients of a mode or an observable, and number of frequencies
    closed, seen : the pieces of modes, and the observables, that are affine
    """

    functions: Mapping[str, Kernel | Bound]
    entries: int
    waves: int
    closed: Collection[int]
    seen: Collection[int]


@dataclass(frozen=True)
class Functions:
    """What solutions are found from.

    Attributes
    ----------
    field, observe, rate, period, scale : the functions that the module describes
    modes, observables : how many there are
    method : ``explicit`` (order 8), or ``automatic`` where a mode is stiff: it changes to the implicit
        method and back as the solution asks for it
    relative, absolute : error that a step may make relative to a state, and to its scale
    sides : for (mode, observable): the side, 1 or -1, of a level of the observable that segments of the
        mode which start on it leave to; one that leaves to the other side hits at once
    kinks : the observables that vanish where the field has a kink (:mod:`contfric.flow.integration.kinked`);
    ``field``
        and ``rate`` take pieces of modes then
    slides, onto : modes that slide, and ``onto(mode, t, y, p, which, y1, jac)``, which puts a state on their
        surfaces
    idle : pairs (mode, observable) for which the observable keeps its value along the mode
    timed : observables of time alone
    affine : modes in closed form, if there are any; for the explicit method

    Raises
    ------
    ValueError
        For an unknown method; if a mode slides and ``onto`` is missing; if modes are in closed form and the
        method is not explicit, whose kernels alone know it.
    """

    field: Kernel | Bound
    observe: Kernel | Bound
    rate: Kernel | Bound
    period: Kernel | Bound
    scale: Kernel | Bound
    modes: int
    observables: int
    method: Method = Method.EXPLICIT
    relative: float = TOLERANCE
    absolute: float = TOLERANCE
    sides: Mapping[tuple[int, int], int] = dataclasses.field(default_factory=dict)
    kinks: Sequence[int] = ()
    slides: Collection[int] = ()
    onto: Kernel | Bound | None = None
    idle: Collection[tuple[int, int]] = ()
    timed: Collection[int] = ()
    affine: AffineModes | None = None

    def __post_init__(self) -> None:
        method = Method(self.method)
        if self.slides and self.onto is None:
            raise ValueError("modes slide: 'onto' has to put a state on their surfaces")
        if self.affine is not None and method is not Method.EXPLICIT:
            raise ValueError(f"modes in closed form need the explicit method, not '{method.value}'")

    @property
    def in_closed_form(self) -> bool:
        """Whether no mode is integrated: all are affine, and no kink cuts them."""
        return self.affine is not None and not self.kinks and len(self.affine.closed) == self.modes

    @property
    def kind(self) -> FlowKind:
        """Which kernels the solutions are found by."""
        return FlowKind.PLAIN if Method(self.method) is Method.EXPLICIT else FlowKind.STIFF

    def flow(self, level: Kernel | Bound, **others: Any) -> CompiledFlow:
        """Return the flow.

        Parameters
        ----------
        level : levels of the surfaces
        others : ``rate`` along modes, where that of pieces is another function; ``reset``
        """
        flow, hit, stationary = (Bound(kernel, self.block) for kernel in kernels_of(self.kind))
        rate = others.pop("rate", self.rate)
        own = flow, self.observe, level, stationary, hit, self.period, rate
        return CompiledFlow(*own, made_of=self, **others)

    @cached_property
    def block(self) -> Block:
        """The memory that a handle of these functions points to."""
        names = ("field", "observe", "rate", "period", "scale", "onto")
        values: dict[str, Any] = {name: getattr(self, name) for name in names}
        if self.affine is not None:
            values |= self.affine.functions
            values["memory"] = np.zeros(NUMBERS)
        if self.timed:
            values["clock"] = self._clock.block
        return Block(MODEL, {**values, **self._tables(), **self._numbers()})

    @cached_property
    def _clock(self) -> Functions:
        pieces = self.modes << len(self.kinks)
        none: dict[str, Any] = {"sides": {}, "kinks": (), "slides": (), "idle": (), "timed": ()}
        return dataclasses.replace(self, field=still, modes=pieces, affine=None, **none)

    def grow(self, tables: Mapping[str, Any], none: Mapping[str, Any]) -> None:
        """Put tables of more modes in the place of those of the block, which kernels are bound to.

        Parameters
        ----------
        none : tables as long, of zeros, for the clock
        """
        self.block.renew(tables)
        if self.timed:
            self._clock.block.renew(none)

    def _tables(self) -> dict[str, list[int]]:
        pieces = range(self.modes << len(self.kinks))
        modes, observables = range(self.modes), range(self.observables)
        closed, seen = (self.affine.closed, self.affine.seen) if self.affine else ((), ())
        return {
            "closed": [int(piece in closed) for piece in pieces],
            "seen": [int(c in seen) for c in observables],
            "slides": [int(mode in self.slides) for mode in modes],
            "idle": [int((mode, c) in self.idle) for mode in modes for c in observables],
            "timed": [int(c in self.timed) for c in observables],
            "sides": [self.sides.get((mode, c), 0) for mode in modes for c in observables],
            "kink_of": list(self.kinks),
        }

    def _numbers(self) -> dict[str, float]:
        return {
            "relative": float(self.relative),
            "absolute": float(self.absolute),
            "looseness": (max(self.relative, self.absolute) / 1e-12) ** (1.0 / POWER),
            "implicit": int(Method(self.method) is Method.IMPLICIT),
            "kinks": len(self.kinks),
            "observables": self.observables,
            "entries_count": self.affine.entries if self.affine else 0,
            "waves_count": self.affine.waves if self.affine else 0,
            "carries": int(self.affine is not None and "carry" in self.affine.functions),
        }
