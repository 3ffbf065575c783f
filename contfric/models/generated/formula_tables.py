"""A model's formulas as tables of numbers: no module is generated for it, and nothing is compiled.

Every mode has to be affine (:mod:`contfric.models.language.coefficients`); then its matrices, observables
and resets are data for the functions of :mod:`contfric.flow.coded`. Where a mode has a handful of numbers,
straight lines of code are faster; where a model has dozens of modes, compiling them takes minutes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

from contfric.base.attributes import kept
from contfric.models.described.description import Description, ModeText
from contfric.models.described.reading_back import from_text
from contfric.models.described.regions import engine_order, known_sides
from contfric.models.generated.columns import Column
from contfric.models.language.coefficients import (
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
from contfric.models.language.grammar import parse
from contfric.models.language.not_affine import NotAffineError
from contfric.models.parts import Observable, Surface

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
        states, surfaces = description.states, engine_order(description)
        self.surfaces, self.seen = surfaces, list(description.observables)
        self.observables = [self.form(o.formula) for o in description.observables]
        self.levels = [self._constant(s.level) for s in surfaces]
        self.modes: list[ModeText] = []
        self.fields: list[Form] = []
        for mode in description.modes:
            self.add(mode, {})
        self.period = self._constant(description.period or "0")
        self.scales = [self._constant(text) for text in description.spread]
        self.resets = {
            s.name: [self.form(description.resets[s.name].get(state, state)) for state in states]
            for s in surfaces
            if s.name in description.resets
        }

    def add(self, mode: ModeText, named: Mapping[str, str]) -> None:
        """Read the rates in a mode, which comes after those that are known; they use named expressions."""
        for name, text in named.items():
            self._scope.values[name] = self.form(text)
        self.modes.append(mode)
        self.fields.append(self._field(mode))

    def see(self, surface: Surface, formula: str) -> bool:
        """Read a surface that comes after those that are known; tell whether its observable is new."""
        names = [o.name for o in self.seen]
        self.surfaces.append(surface)
        self.levels.append(self._constant(surface.level))
        if surface.observable in names:
            return False
        self.seen.append(Observable(surface.observable, formula))
        self.observables.append(self.form(formula))
        return True

    @kept
    def form(self, text: str) -> Affine:
        """Return an expression as an affine form; the same text is read once."""
        return checked(self._scope.evaluate(parse(text)))

    def _field(self, mode: ModeText) -> Form:
        """Return the rates in a mode; on its sides of surfaces signs are known."""
        try:
            return [self.form(rate) for rate in mode.field]
        except NotAffineError:
            scope = self.description.names.scope(within(self._sides(mode)), self._symbols)
            return [checked(scope.evaluate(parse(rate))) for rate in mode.field]

    def _sides(self, mode: ModeText) -> dict[Affine, int]:
        names = [o.name for o in self.seen]
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

    def is_idle(self, mode: int, c: int) -> bool:
        """Tell whether an observable never changes along a mode."""
        quiet = {key[0] for key in self.observables[c].parts} <= {"y", "1"}
        return quiet and not self.rate(mode, c).parts


@dataclass
class CodedTables:
    """The tables of :mod:`contfric.flow.coded`, while they are written.

    Attributes
    ----------
    names : of the parameters
    operations, numbers : what is done with the parameters, in this order
    data : all other tables, by their names
    """

    names: Sequence[str]
    states: int
    operations: Column = field(default_factory=Column)
    numbers: Column = field(default_factory=lambda: Column(whole=False))
    data: dict[str, Column] = field(default_factory=dict)
    _known: dict[Any, int] = field(default_factory=dict)
    _waves: dict[Coefficient, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("columns", "harmonics", "operands", "frequency_at"):
            self.data[name] = Column()
        self.data["weights"] = Column(whole=False)
        for name in ("row_of", "slope_at", "wave_at", "term_at", "places"):
            self.data[name] = Column([0])
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


@lru_cache(maxsize=64)
def forms_of(definition: str) -> Forms | None:
    """Return the affine forms of a definition, if its formulas are to be tables; else None."""
    description = from_text(definition)
    if not description.structure and len(description.modes) * len(description.states) <= _FEW:
        return None
    try:
        return Forms(description)
    except (NotAffineError, ArithmeticError):
        return None
