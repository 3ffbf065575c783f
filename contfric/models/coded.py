"""A model's formulas as tables of numbers: no module is generated for it, and nothing is compiled.

Every mode has to be affine (:mod:`contfric.models.coefficients`); then its matrices, observables and resets
are data for the functions of :mod:`contfric.flow.coded`. Where a mode has a handful of numbers,
straight lines of code are faster; where a model has dozens of modes, compiling them takes minutes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from contfric.models.coefficients import (
    AFFINE,
    CONSTANT,
    ONE,
    Affine,
    Atom,
    Coefficient,
    Product,
    checked,
    constant,
    symbols,
    within,
)
from contfric.models.description import Description, ModeText
from contfric.models.grammar import parse
from contfric.models.not_affine import NotAffineError
from contfric.models.regions import engine_order, known_sides

if TYPE_CHECKING:
    from contfric.flow.interface import CompiledFlow
    from contfric.handle import Bound

Form = list[Affine]
#: Rates of states, over all modes, up to which code is generated: it takes half of the time that tables take,
#: and half a second for each rate to be compiled, once.
_FEW = 24


class Forms:
    """The formulas of a description as affine forms.

    Raises
    ------
    NotAffineError
        With the reason, where one is not affine.
    """

    def __init__(self, description: Description) -> None:
        self.description = description
        if description.kinks or description.method != "explicit":  # other kernels do these
            raise NotAffineError("modes with kinks, or an implicit method")
        names = tuple(p.name for p in description.parameters)
        self._symbols = symbols(description.states, names)
        self._scope = description.names.scope(AFFINE, self._symbols)
        self._read: dict[str, Affine] = {}
        states, surfaces = description.states, engine_order(description)
        self.surfaces = surfaces
        self.observables = [self.form(o.formula) for o in description.observables]
        self.levels = [self._constant(s.level) for s in surfaces]
        self.fields = [self._field(mode) for mode in description.modes]
        self.period = self._constant(description.period or "0")
        self.scales = [self._constant(text) for text in description.spread]
        self.resets = {
            s.name: [self.form(description.resets[s.name].get(state, state)) for state in states]
            for s in surfaces
            if s.name in description.resets
        }

    def form(self, text: str) -> Affine:
        """Return an expression as an affine form; the same text is read once."""
        if text not in self._read:
            self._read[text] = checked(self._scope.evaluate(parse(text)))
        return self._read[text]

    def _field(self, mode: ModeText) -> Form:
        """Return the rates in a mode; on its sides of surfaces signs are known."""
        try:
            return [self.form(rate) for rate in mode.field]
        except NotAffineError:
            scope = self.description.names.scope(within(self._sides(mode)), self._symbols)
            return [checked(scope.evaluate(parse(rate))) for rate in mode.field]

    def _sides(self, mode: ModeText) -> dict[Affine, int]:
        names = [o.name for o in self.description.observables]
        known, found = known_sides(mode, self.surfaces), {}
        for surface, level in zip(self.surfaces, self.levels, strict=True):
            above = self.observables[names.index(surface.observable)] - constant(level)
            if known.get(surface.name, 0) != 0:
                found[above] = known[surface.name]
        return found

    def _constant(self, text: str) -> Coefficient:
        found = self.form(text).constant
        if found is None:
            raise NotAffineError(f"'{text}' depends on the state")
        return found

    def rate(self, mode: int, c: int) -> Affine:
        """Return the part of an observable's rate along a mode that its states make."""
        found = Affine()
        for key, slope in self.observables[c].parts.items():
            if key[0] == "y":
                found = found + self.fields[mode][key[1]].scaled(slope)
        return found

    @property
    def idle(self) -> list[tuple[int, int]]:
        """Pairs (mode, observable) for which the observable never changes along the mode."""
        still = [{key[0] for key in o.parts} <= {"y", "1"} for o in self.observables]
        return [
            (m, c)
            for m in range(len(self.fields))
            for c in range(len(self.observables))
            if still[c] and not self.rate(m, c).parts
        ]


@dataclass
class Tables:
    """The tables of :mod:`contfric.flow.coded`, while they are written.

    Attributes
    ----------
    names : of the parameters
    operations, numbers : what is done with the parameters, in this order
    data : all other tables, by their names
    """

    names: Sequence[str]
    states: int
    operations: list[int] = field(default_factory=list)
    numbers: list[float] = field(default_factory=list)
    data: dict[str, list[Any]] = field(default_factory=dict)
    _known: dict[Any, int] = field(default_factory=dict)
    _waves: dict[Coefficient, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("columns", "harmonics", "operands", "weights", "frequency_at"):
            self.data[name] = []
        for name in ("row_of", "slope_at", "wave_at", "term_at", "places"):
            self.data[name] = [0]
        self.wave(Coefficient())  # the constant is the first harmonic

    @cached_property
    def _kinds(self) -> Mapping[str, int]:
        from contfric.flow.coded.operations import OPERATIONS

        return OPERATIONS

    def _add(self, key: Any, kind: int, *operands: int, c: float = 0.0) -> int:
        self.operations += [*(kind, *operands, 0, 0, 0)[:4]]
        self.numbers.append(c)
        self._known[key] = len(self.numbers) - 1
        return self._known[key]

    def value(self, coefficient: Coefficient) -> int:
        """Return the operation whose result is a coefficient."""
        from contfric.flow.coded.operations import NUMBER, SUM

        if coefficient in self._known:
            return self._known[coefficient]
        known = coefficient.number
        if known is not None:
            return self._add(coefficient, NUMBER, c=known)
        (product, weight), *rest = coefficient.parts
        if not rest and weight == 1.0:
            self._known[coefficient] = self.product(product)
            return self._known[coefficient]
        if not product:  # the number comes first where parts are sorted
            (product, weight), *rest = *rest, (product, weight)
        first, other = self.product(product), self.value(Coefficient(tuple(rest)))
        return self._add(coefficient, SUM, first, other, c=weight)

    def product(self, product: Product) -> int:
        """Return the operation whose result is a product."""
        from contfric.flow.coded.operations import PRODUCT

        if not product:
            return self.value(ONE)
        if product in self._known:
            return self._known[product]
        *before, (atom, power) = product
        last = self._power(atom, power)
        if not before:
            self._known[product] = last
            return last
        return self._add(product, PRODUCT, self.product(tuple(before)), last)

    def _power(self, atom: Atom, power: int) -> int:
        from contfric.flow.coded.operations import WHOLE

        if power == 1:
            return self._atom(atom)
        key = atom, power
        return (
            self._known[key]
            if key in self._known
            else self._add(key, WHOLE, self._atom(atom), power)
        )

    def _atom(self, atom: Atom) -> int:
        from contfric.flow.coded.operations import PARAMETER

        if atom in self._known:
            return self._known[atom]
        if not atom.of:
            return self._add(atom, PARAMETER, self.names.index(atom.name))
        return self._add(atom, self._kinds[atom.name], *map(self.value, atom.of))

    def wave(self, frequency: Coefficient) -> int:
        """Return the number of a frequency."""
        if frequency not in self._waves:
            self._waves[frequency] = len(self._waves)
            self.data["frequency_at"].append(self.value(frequency))
        return self._waves[frequency]

    def group(self, forms: Form) -> int:
        """Write the rows of some affine forms; return the number of their group."""
        data, coefficients, waves = self.data, [], []
        for form in forms:
            for key, c in sorted(
                form.parts.items(), key=lambda item: (item[0][0], str(item[0][1]))
            ):
                if key[0] == "y":
                    data["columns"].append(key[1])
                    coefficients.append(c)
            own = {
                key[1] if key != CONSTANT else Coefficient() for key in form.parts if key[0] != "y"
            }
            for frequency in sorted(own):
                data["harmonics"].append(self.wave(frequency))
                cosine = ("cos", frequency) if frequency else CONSTANT
                waves += [form.parts.get(k, Coefficient()) for k in (cosine, ("sin", frequency))]
            data["slope_at"].append(len(data["columns"]))
            data["wave_at"].append(len(data["harmonics"]))
        for coefficient in (*coefficients, *waves):
            for product, weight in coefficient.parts:
                data["operands"].append(self.product(product))
                data["weights"].append(weight)
            data["term_at"].append(len(data["operands"]))
        data["places"].append(len(data["term_at"]) - 1)
        data["row_of"].append(len(data["slope_at"]) - 1)
        return len(data["places"]) - 2

    def most(self, groups: Sequence[int]) -> int:
        """Return the most coefficients that one of some groups has."""
        places = self.data["places"]
        return max((places[g + 1] - places[g] for g in groups), default=0)


def _returns(forms: Forms, mode: int, held: Sequence[int]) -> list[float]:
    """Return how a state goes back onto the surfaces of a mode: ``G^T (G G^T)^-1``, column by column."""
    if not held:
        return []
    gradients = np.zeros((len(held), len(forms.description.states)))
    names = [o.name for o in forms.description.observables]
    for row, k in enumerate(held):
        for key, slope in forms.observables[
            names.index(forms.surfaces[k].observable)
        ].parts.items():
            if key[0] == "y":
                if slope.number is None:
                    raise NotAffineError("a surface of rest depends on a parameter")
                gradients[row, key[1]] = slope.number
    return [float(x) for x in np.linalg.pinv(gradients).T.ravel()]


@dataclass(frozen=True)
class CodedFunctions:
    """The flow of a model whose formulas are tables, and the field of its modes."""

    flow: CompiledFlow
    field: Bound


@lru_cache(maxsize=64)
def forms_of(definition: str) -> Forms | None:
    """Return the affine forms of a definition, if its formulas are to be tables; else None."""
    from contfric.models.describe import from_text

    description = from_text(definition)
    if len(description.modes) * len(description.states) <= _FEW:
        return None
    try:
        return Forms(description)
    except (NotAffineError, ArithmeticError):
        return None


@lru_cache(maxsize=64)
def coded_functions(definition: str) -> CodedFunctions | None:
    """Return the compiled functions of a definition whose formulas are to be tables; else None."""
    forms = forms_of(definition)
    return None if forms is None else functions_from(forms)


def functions_from(forms: Forms) -> CodedFunctions:
    """Return the compiled functions of affine forms."""
    from contfric.flow.coded.kernels import KERNELS
    from contfric.flow.coded.tables import LAYOUT
    from contfric.flow.integrated import AffineModes, Functions
    from contfric.flow.layouts import AFFINE as HELPERS
    from contfric.handle import Block, Bound

    description = forms.description
    tables = Tables([p.name for p in description.parameters], len(description.states))
    pieces = [tables.group(rows) for rows in forms.fields]
    data = tables.data
    data["observable_of"] = [tables.group([form]) for form in forms.observables]
    data["reset_at"] = [
        tables.group(forms.resets[s.name]) if s.name in forms.resets else 0 for s in forms.surfaces
    ]
    data["level_at"] = [tables.value(level) for level in forms.levels]
    data["scale_at"] = [tables.value(scale) for scale in forms.scales]
    period = tables.value(forms.period)
    slides = _slides(forms, data)
    values = {
        **data,
        "operations": tables.operations,
        "numbers": tables.numbers,
        "values": len(tables.numbers),
        "states": tables.states,
        "waves": len(data["frequency_at"]),
        "parameters": len(tables.names),
        "coefficients": tables.most(range(len(data["places"]) - 1)),
        "period_at": period,
    }
    block = Block(LAYOUT, values)
    bound = {name: Bound(kernel, block) for name, kernel in KERNELS.items()}
    count = len(forms.observables)
    functions = Functions(
        field=bound["field"],
        observe=bound["observe"],
        rate=bound["rate"],
        period=bound["period"],
        scale=bound["scale"],
        onto=bound["onto"],
        modes=len(pieces),
        observables=count,
        slides=slides,
        idle=forms.idle,
        timed=[c for c, o in enumerate(forms.observables) if "y" not in {k[0] for k in o.parts}],
        affine=AffineModes(
            {name: bound[name] for name in HELPERS},
            entries=tables.most([*pieces, *data["observable_of"]]),
            waves=len(data["frequency_at"]),
            closed=pieces,
            seen=range(count),
        ),
    )
    flow = functions.flow(bound["level"], reset=bound["reset"] if forms.resets else None)
    return CodedFunctions(flow, bound["field"])


def _slides(forms: Forms, data: dict[str, list[Any]]) -> list[int]:
    """Write the surfaces that each mode slides on, and the way back; return the modes that do."""
    order = {o.name: c for c, o in enumerate(forms.description.observables)}
    data["seen_at"] = [order[s.observable] for s in forms.surfaces]
    data["surface_at"], data["surfaces"], data["returns"] = [0], [], []
    slides = []
    for m, mode in enumerate(forms.description.modes):
        held = [k for k, s in enumerate(forms.surfaces) if mode.sides.get(s.name) == 0]
        data["surfaces"] += held
        data["returns"] += _returns(forms, m, held)
        data["surface_at"].append(len(data["surfaces"]))
        slides += [m] if held else []
    return slides
