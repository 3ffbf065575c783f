"""The region of each field: the surfaces that bound it, and whether a state is inside.

Modes of one field are one mode (:mod:`contfric.models.deriving.sections`): a section through an equilibrium
means nothing to it. A mode with kinks has a region for each combination of their sides.

sympy is imported where formulas are asked for: results are saved and loaded without it.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.equilibria.fields import Fields
from contfric.errors import ParameterError
from contfric.models.definition import Domain, Model

#: On a surface: this near, relative to what the height is made of. Equilibria are solved to about 1e-14 times
#: their condition; nothing that moves apart is told apart below it.
_ON = 1e-10


@dataclass(frozen=True, eq=False)
class Heights:
    """Heights above all surfaces (observable less level) and the kinks, as functions.

    Attributes
    ----------
    names : surfaces in the order of the model, then the observables of kinks
    value : function of (y, p): all heights, shape (surfaces + kinks,)
    """

    names: tuple[str, ...]
    value: Callable[[FloatArray, FloatArray], FloatArray]
    _slopes: Callable[[FloatArray, FloatArray], FloatArray]

    def slopes(self, y: FloatArray, p: FloatArray) -> FloatArray:
        """Return their gradients by the states, shape (surfaces + kinks, n)."""
        return self._slopes(y, p).reshape(len(self.names), -1)


@dataclass(frozen=True, eq=False)
class ModeRegion:
    """A mode (one side of its kinks), its field, and where it holds.

    Attributes
    ----------
    mode : name of the mode; the first one of those that are one
    kinks : side of each kink
    on : surfaces that the mode lies on
    """

    model: Model
    mode: str
    kinks: Mapping[str, int]
    on: tuple[str, ...]
    fields: Fields
    heights: Heights

    @cached_property
    def domains(self) -> tuple[Domain, ...]:
        """The domains of the mode."""
        return tuple(d for d in self.model.domains if d.mode == self.mode)

    @cached_property
    def _wraps(self) -> frozenset[str]:
        return frozenset(r.surface for r in self.model.resets if r.wraps)

    def sides(self, domain: Domain) -> dict[str, int]:
        """Return the sides of a domain, and of the kinks; an angle that begins again bounds nothing."""
        own = {s: v for s, v in domain.signs.items() if s not in self._wraps and s not in self.on}
        return {**own, **self.kinks}

    def bounds(self, domain: Domain, name: str) -> bool:
        """Tell whether a surface (or kink) bounds the region next to a domain of it."""
        if name in self.kinks:
            return True
        if name in self._wraps or name in self.on:
            return False
        flipped = {**domain.signs, name: -domain.signs[name]}
        return not any(d.signs == flipped for d in self.domains)

    def near(self, y: FloatArray, p: FloatArray) -> dict[str, float]:
        """Return the height of each surface and kink; exactly 0 on one."""
        values, slopes = self.heights.value(y, p), self.heights.slopes(y, p)
        size = np.abs(slopes) @ (np.abs(y) + scale_of(self.model, p)) + 1e-300
        on = np.abs(values) <= _ON * size
        return dict(zip(self.heights.names, np.where(on, 0.0, values).tolist(), strict=True))

    def domain_of(self, y: FloatArray, p: FloatArray) -> tuple[Domain, tuple[str, ...]]:
        """Return the domain nearest to a state, and the surfaces on whose wrong side it is; none inside."""
        near = self.near(y, p)
        found = []
        for domain in self.domains:
            sides = self.sides(domain)
            wrong = tuple(s for s, side in sides.items() if near[s] * side < 0.0)
            found.append((len(wrong), wrong, domain))
        _, wrong, domain = min(found, key=lambda item: item[0])
        return domain, wrong

    def touched(self, y: FloatArray, p: FloatArray) -> tuple[str, ...]:
        """Return the surfaces and kinks that bound the region and that a state is on."""
        near, (domain, _) = self.near(y, p), self.domain_of(y, p)
        names = (s for s in self.sides(domain) if near[s] == 0.0 and self.bounds(domain, s))
        return tuple(names)

    def attracts(self, y: FloatArray, p: FloatArray) -> bool:
        """Tell whether the fields on both sides of the surface of the mode lead to it.

        They do where sliding is derived. A static limit above the kinetic one holds what they would carry
        off.
        """
        if len(self.on) != 1:
            return True  # of two surfaces sliding is derived only where both switches drive back
        (surface,), (domain, _) = self.on, self.domain_of(y, p)
        slope = self.heights.slopes(y, p)[self.heights.names.index(surface)]
        for side in (1, -1):
            signs = {**domain.signs, surface: side}
            modes = {d.mode for d in self.model.domains if d.signs == signs}
            for region in regions_of(self.model):
                if region.mode in modes and region.kinks == self.kinks and not region.on:
                    rate = float(slope @ region.fields.value(y, p))
                    if side * rate > _ON * float(np.abs(slope) @ scale_of(self.model, p)):
                        return False
        return True


def scale_of(model: Model, p: FloatArray) -> FloatArray:
    """Return the natural size of each state: its spread, 1 where it has none."""
    widths = np.abs(model.spread(model.mapping(p)))
    return np.where((widths > 0.0) & np.isfinite(widths), widths, 1.0)


@lru_cache(maxsize=32)
def regions_of(model: Model) -> tuple[ModeRegion, ...]:
    """Return the regions of a model, in the order of its modes.

    Raises
    ------
    ParameterError
        If the model is not declared by formulas.
    """
    import sympy

    from contfric.models.generated.symbols import Formulas
    from contfric.models.language.numbers import function_of_numbers

    if not model.definition:
        raise ParameterError(
            f"equilibria of '{model.name}' are found from its formulas, and it is not declared by formulas: "
            "write it as a YAML file or a class"
        )
    description = model.description
    formulas = Formulas(description)
    still = {formulas.t: sympy.Integer(0)}
    heights_of, seen = formulas.heights(), (o.name for o in description.observables)
    observables = dict(zip(seen, formulas.observables(), strict=True))
    above = {s.name: heights_of[s.name] for s in model.surfaces}
    above |= {name: observables[name] for name in description.kinks}
    above = {name: formula.xreplace(still) for name, formula in above.items()}
    args, texts = [list(formulas.y), list(formulas.p)], list(above.values())
    heights = Heights(
        tuple(above),
        function_of_numbers(args, texts),
        function_of_numbers(args, [[h.diff(s) for s in formulas.y] for h in texts]),
    )
    whole = {d.mode for d in model.domains}
    fields, found = formulas.fields, []
    for k, (mode, bits) in enumerate(itertools.product(description.modes, formulas.pieces)):
        if mode.name not in whole:
            continue
        on = tuple(s for s, side in mode.sides.items() if side == 0)
        field = [f.xreplace(still) for f in fields[k]]
        parts = [*field, *(above[s] for s in on)]
        own = Fields(
            tuple(formulas.y),
            tuple(formulas.p),
            tuple(field),
            tuple(above[s] for s in on),
            all(not f.diff(s).free_symbols & set(formulas.y) for f in parts for s in formulas.y),
        )
        kinks = dict(zip(description.kinks, bits, strict=True))
        found.append(ModeRegion(model, mode.name, kinks, on, own, heights))
    return tuple(found)


def check_no_excitation(model: Model, params: Mapping[str, float], active: str = "") -> None:
    """Check that time plays no part at some parameters, whatever one of them is.

    Raises
    ------
    ParameterError
        If it does.
    """
    if model.autonomous or not model.definition:
        return
    from contfric.models.generated.symbols import Formulas

    formulas = Formulas(model.description)
    known = {
        symbol: params[p.name]
        for symbol, p in zip(formulas.p, formulas.description.parameters, strict=True)
        if p.name != active
    }
    every = [*itertools.chain.from_iterable(formulas.fields), *formulas.observables()]
    if any(formulas.t in formula.subs(known).free_symbols for formula in every):
        raise ParameterError(
            f"model '{model.name}' is excited at these parameters, and has no equilibria: switch the "
            "excitation off (its amplitude 0), or take a model that is 'autonomous'"
        )
