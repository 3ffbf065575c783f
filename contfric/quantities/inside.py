"""Expressions along an orbit: what the names inside of a functional mean, at some shares of a segment."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.errors import ParameterError, did_you_mean
from contfric.models.definition import Model
from contfric.models.deriving.growing_model import ComposedModel
from contfric.models.language.grammar import PI, TIME, Scope, names_in, parse
from contfric.models.language.quantity_texts import FORCE_OF, WORK, Functional, no_contact
from contfric.quantities.duals import Dual, Kinks, constant
from contfric.quantities.motion import Place
from contfric.quantities.panels import Function
from contfric.quantities.tape import Tape, tape_of

if TYPE_CHECKING:
    from contfric.models.structures.contact_laws import ContactLaws


class Inside:
    """The names of a model inside of functionals: time, states, parameters, observables, definitions.

    Parameters
    ----------
    model : Model

    Examples
    --------
    >>> from contfric.models import load_model
    >>> Inside(load_model("coulomb")).known
    ('t', 'x', 'v', 'u', 'Omega', 'S', 'S0', 'h', 'zeta', 'pi')
    """

    def __init__(self, model: Model) -> None:
        self.model = model
        self.definitions = definitions_of(model)
        self.laws = {law.name: law for law in laws_of(model)}
        named = [o.name for o in model.observables if o.name not in model.states]
        self.observables = [name for name in named if name not in self.definitions]
        self._functions: WeakKeyDictionary[Functional, Function] = WeakKeyDictionary()
        self._tapes: WeakKeyDictionary[Functional, Tape] = WeakKeyDictionary()
        self.known = tuple(
            dict.fromkeys(
                (TIME, *model.states, *named, *self.definitions, *model.parameter_names, PI)
            )
        )

    def check(self, asked: Functional) -> None:
        """Refuse an expression with names that the model does not have.

        Raises
        ------
        ParameterError
            If there is one.
        """
        for name in sorted(asked.contacts - set(self.laws)):
            raise ParameterError(f"model '{self.model.name}': {no_contact(name, tuple(self.laws))}")
        if asked.kind == WORK:
            return
        for name in sorted(names_in(asked.tree)):
            if name not in self.known and not name.startswith(FORCE_OF):
                raise ParameterError(
                    f"in {asked.kind}({asked.text}): model '{self.model.name}' has no '{name}'"
                    f"{did_you_mean(name, self.known)}"
                )

    def function(self, asked: Functional) -> Function:
        """Return the expression of a functional as a function along a segment."""
        known = self._functions.get(asked)
        if known is None:
            known = self.along(partial(_always, asked.tree), asked.contacts)
            self._functions[asked] = known
        return known

    def tape(self, asked: Functional) -> Tape:
        """Return what is integrated for a functional as operations for compiled code."""
        known = self._tapes.get(asked)
        if known is None:
            known = self.tape_of_all((asked,))
            self._tapes[asked] = known
        return known

    def tape_of_all(self, asked: Iterable[Functional]) -> Tape:
        """Return what is integrated for several functionals, one after the other, as one tape."""
        trees = [(functional.tree, functional.kind) for functional in asked]
        return tape_of(self.model, trees, self.definitions, self.observables)

    def power(self, contact: str) -> Function:
        """Return the power that a contact dissipates as a function along a segment."""
        return self.along(lambda mode: parse(self.laws[contact].power(mode)))

    def variants(self, asked: Functional) -> list[Function]:
        """Return the expression of a functional with each law of its contacts, as if it held everywhere."""
        found = []
        for contact in sorted(asked.contacts):
            texts = self.laws[contact].texts
            for text in {t for key, t in texts.items() if key.startswith("force")}:
                own = {FORCE_OF + contact: parse(text)}
                found.append(self.along(lambda _: asked.tree, asked.contacts - {contact}, own))
        return found

    def powers(self, contact: str) -> list[Function]:
        """Return the powers of all laws of a contact, each as if it held everywhere."""
        texts = {t for key, t in self.laws[contact].texts.items() if key.startswith("power")}
        return [self.along(partial(_always, parse(text))) for text in texts]

    def loss(self, contact: str) -> Function:
        """Return the energy that an impact takes, as a function of the state before it."""
        return self.along(lambda _: parse(self.laws[contact].loss))

    def along(
        self,
        tree_in: Callable[[str], ast.expr],
        contacts: frozenset[str] = frozenset(),
        given: Mapping[str, ast.expr] | None = None,
    ) -> Function:
        """Return an expression, that of each mode, as a function along a segment.

        Parameters
        ----------
        contacts : whose forces it is made of
        given : further named expressions
        """
        known: dict[str, tuple[ast.expr, dict[str, ast.expr], set[str]]] = {}

        def prepared(mode: str) -> tuple[ast.expr, dict[str, ast.expr], set[str]]:
            tree = tree_in(mode)
            forces = {FORCE_OF + c: parse(self.laws[c].force(mode)) for c in contacts}
            defined = {**self.definitions, **forces, **(given or {})}
            return tree, defined, _leaves(tree, defined)

        def value(place: Place, shares: FloatArray, kinks: Kinks) -> Dual:
            if place.mode not in known:  # looked for once
                known[place.mode] = prepared(place.mode)
            tree, defined, names = known[place.mode]
            time, states = place.at(shares)
            values: dict[str, Any] = {TIME: time}
            values.update(zip(self.model.states, states, strict=True))
            for k, name in enumerate(self.model.parameter_names):
                if name in names:
                    values[name] = place.parameter(k, len(shares))
            for name in self.observables:
                if name in names:
                    values[name] = place.observable(name, time, states)
            scope: Scope[Any] = Scope(kinks.algebra(), values, defined)
            with np.errstate(all="ignore"):
                found = scope.evaluate(tree)
            return found if isinstance(found, Dual) else constant(found, time)

        return value


@lru_cache(maxsize=64)
def inside_of(model: Model) -> Inside:
    """Return the names of a model inside of functionals: looked up once a model."""
    return Inside(model)


@lru_cache(maxsize=64)
def definitions_of(model: Model) -> Mapping[str, ast.expr]:
    """Return the named expressions of a model that is declared by its equations; empty of another one."""
    if not model.definition:
        return {}

    parts = model.description.names.parts
    return {name: parse(text) for name, text in parts.items()}


def _always(tree: ast.expr, _: str) -> ast.expr:
    return tree


@lru_cache(maxsize=64)
def laws_of(model: Model) -> tuple[ContactLaws, ...]:
    """Return the laws of the contacts of a structure; none of another model."""
    if not model.definition:
        return ()
    if isinstance(model, ComposedModel):
        return model.composition.laws

    return model.description.laws


def _leaves(tree: ast.expr, definitions: Mapping[str, ast.expr]) -> set[str]:
    """Return all names that an expression depends on, through definitions too."""
    found: set[str] = set()
    waiting = [tree]
    while waiting:
        for name in names_in(waiting.pop()) - found:
            found.add(name)
            if name in definitions:
                waiting.append(definitions[name])
    return found
