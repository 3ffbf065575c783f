"""The flow of a model whose formulas are tables (:mod:`.formula_tables`); modes may come later."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from contfric.models.described.description import ModeText
from contfric.models.generated.columns import Column
from contfric.models.generated.formula_tables import CodedTables, Forms, forms_of
from contfric.models.language.not_affine import NotAffineError
from contfric.models.parts import Surface

if TYPE_CHECKING:
    from contfric.flow.integrated import Functions
    from contfric.flow.interface import CompiledFlow
    from contfric.handle import Block, Bound

#: Modes and observables that the table has space for at first; either is doubled when it is full.
_SPACE = 64


class CodedFlow:
    """The compiled functions of affine forms.

    Observables and resets are the first groups of the tables, the modes follow: a mode or a surface that is
    added is the last, and what is there stays where it is.
    """

    def __init__(self, forms: Forms) -> None:
        self._forms, self._declared = forms, len(forms.observables)
        description = forms.description
        self._tables = CodedTables(
            [p.name for p in description.parameters], len(description.states)
        )
        tables, data = self._tables, self._tables.data
        order = {o.name: c for c, o in enumerate(description.observables)}
        data["observable_of"] = Column([tables.group([form]) for form in forms.observables])
        data["reset_at"] = Column(
            tables.group(forms.resets[s.name]) if s.name in forms.resets else 0
            for s in forms.surfaces
        )
        data["level_at"] = Column([tables.value(level) for level in forms.levels])
        data["scale_at"] = Column([tables.value(scale) for scale in forms.scales])
        data["seen_at"] = Column([order[s.observable] for s in forms.surfaces])
        data["surface_at"], data["surfaces"] = Column([0]), Column()
        data["returns"], data["group_of"] = Column(whole=False), Column()
        self._period = tables.value(forms.period)
        self._most = tables.most(range(len(data["places"]) - 1))
        self._slides: list[bool] = []
        self._idle = np.zeros((_SPACE, _SPACE), dtype=np.int64)  # modes, observables
        for mode in range(len(forms.fields)):
            self._write(mode)

    def _write(self, m: int) -> None:
        """Write the rates in a mode, the surfaces that it slides on, and the way back to these."""
        sides, data = self._forms.modes[m].sides, self._tables.data
        data["group_of"].append(self._tables.group(self._forms.fields[m]))
        held = [k for k, s in enumerate(self._forms.surfaces) if sides.get(s.name) == 0]
        data["surfaces"] += held
        data["returns"] += _returns(self._forms, held)
        data["surface_at"].append(len(data["surfaces"]))
        self._most = max(self._most, self._tables.most([data["group_of"][m]]))
        self._slides.append(bool(held))
        bounds = {s.observable for s in self._forms.surfaces if s.name in sides}
        for c, observable in enumerate(self._forms.seen):
            self._note(m, c, asked=c < self._declared or observable.name in bounds)

    def _note(self, m: int, c: int, asked: bool) -> None:
        """Write whether an observable never changes along a mode; of those that bound no mode none asks."""
        rows, columns = self._idle.shape
        if m >= rows or c >= columns:
            more = ((0, rows * (m >= rows)), (0, columns * (c >= columns)))
            self._idle = np.pad(self._idle, more)
        self._idle[m, c] = asked and self._forms.is_idle(m, c)

    def add(self, mode: ModeText, named: Mapping[str, str]) -> None:
        """Add a mode, with what its rates name. The functions and their addresses stay the same."""
        self._forms.add(mode, named)
        self._write(len(self._forms.fields) - 1)
        self._renew()

    def see(self, surface: Surface, formula: str) -> None:
        """Add a surface, and its observable where that is new."""
        forms, data, tables = self._forms, self._tables.data, self._tables
        if forms.see(surface, formula):
            c, group = len(forms.observables) - 1, tables.group([forms.observables[-1]])
            data["observable_of"].append(group)
            self._most = max(self._most, tables.most([group]))
            for m, mode in enumerate(forms.modes):
                self._note(m, c, asked=surface.name in mode.sides)
        data["seen_at"].append([o.name for o in forms.seen].index(surface.observable))
        data["level_at"].append(tables.value(forms.levels[-1]))
        data["reset_at"].append(0)
        self._renew()

    def _renew(self) -> None:
        """Hand grown tables over to the compiled functions."""
        if "_functions" in self.__dict__:
            self._block.renew(self._values())
            modes, stride = self._idle.shape
            none, one = (np.full(max(modes, stride), k, dtype=np.int64) for k in (0, 1))
            no_pairs = np.zeros(modes * stride, dtype=np.int64)
            still: dict[str, Any] = {"closed": none, "slides": none, "seen": none, "timed": none}
            still |= {"idle": no_pairs, "sides": no_pairs, "observables": stride}
            timed, slides = none.copy(), none.copy()
            timed[self._timed] = 1
            slides[: len(self._slides)] = self._slides
            moving = {**still, "closed": one, "seen": one, "timed": timed, "slides": slides}
            moving |= {"idle": self._idle.ravel(), "entries_count": self._most}
            self._functions.grow(moving, still)

    def _values(self) -> dict[str, Any]:
        tables, data = self._tables, self._tables.data
        return {
            **{name: column.array for name, column in data.items()},
            "operations": tables.operations.array,
            "numbers": tables.numbers.array,
            "values": len(tables.numbers),
            "states": tables.states,
            "waves": len(data["frequency_at"]),
            "parameters": len(tables.names),
            "coefficients": self._most,
            "period_at": self._period,
        }

    @cached_property
    def _block(self) -> Block:
        from contfric.flow.coded.tables import LAYOUT
        from contfric.handle import Block

        return Block(LAYOUT, self._values())

    @cached_property
    def _bound(self) -> dict[str, Bound]:
        from contfric.flow.coded.kernels import KERNELS
        from contfric.handle import Bound

        return {name: Bound(kernel, self._block) for name, kernel in KERNELS.items()}

    @cached_property
    def _functions(self) -> Functions:
        from contfric.flow.integrated import AffineModes, Functions
        from contfric.flow.layouts import AFFINE as HELPERS

        forms, bound = self._forms, self._bound
        count, modes = len(forms.observables), len(forms.fields)
        return Functions(
            field=bound["field"],
            observe=bound["observe"],
            rate=bound["rate"],
            period=bound["period"],
            scale=bound["scale"],
            onto=bound["onto"],
            modes=modes,
            observables=count,
            slides=[m for m in range(modes) if self._slides[m]],
            idle={(m, c) for m in range(modes) for c in range(count) if self._idle[m, c]},
            timed=self._timed,
            affine=AffineModes(
                {name: bound[name] for name in HELPERS},
                entries=self._most,
                waves=len(self._tables.data["frequency_at"]),
                closed=range(modes),
                seen=range(count),
            ),
        )

    @cached_property
    def _timed(self) -> list[int]:
        """The observables of time alone, of those that were there first: others are not told apart."""
        states_in = [{key[0] for key in o.parts} for o in self._forms.observables]
        return [c for c, kinds in enumerate(states_in) if "y" not in kinds]

    @property
    def field(self) -> Bound:
        """The field of the modes."""
        return self._bound["field"]

    @property
    def onto(self) -> Bound:
        """The way back onto the surfaces that a mode slides on."""
        return self._bound["onto"]

    @cached_property
    def flow(self) -> CompiledFlow:
        """The flow."""
        reset = self._bound["reset"] if self._forms.resets else None
        return self._functions.flow(self._bound["level"], reset=reset)


def _returns(forms: Forms, held: Sequence[int]) -> list[float]:
    """Return how a state goes back onto the surfaces of a mode: ``G^T (G G^T)^-1``, column by column."""
    if not held:
        return []
    gradients = np.zeros((len(held), len(forms.description.states)))
    names = [o.name for o in forms.seen]
    for row, k in enumerate(held):
        for key, slope in forms.observables[
            names.index(forms.surfaces[k].observable)
        ].parts.items():
            if key[0] == "y":
                if slope.number is None:
                    raise NotAffineError("a surface of rest depends on a parameter")
                gradients[row, key[1]] = slope.number
    return [float(x) for x in np.linalg.pinv(gradients).T.ravel()]


@lru_cache(maxsize=64)
def coded_flow(definition: str) -> CodedFlow | None:
    """Return the compiled functions of a definition whose formulas are to be tables; else None."""
    forms = forms_of(definition)
    return None if forms is None else CodedFlow(forms)
