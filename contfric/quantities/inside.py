"""Expressions along an orbit: what the names inside of a functional mean, at some shares of a segment."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from contfric.errors import ParameterError, did_you_mean
from contfric.models.definition import FloatArray, Model
from contfric.models.grammar import PI, TIME, Scope, names_in, parse
from contfric.models.quantity_texts import Functional
from contfric.quantities.duals import Dual, Kinks, constant
from contfric.quantities.motion import Segment
from contfric.quantities.panels import Function


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
        named = [o.name for o in model.observables if o.name not in model.states]
        self.observables = [name for name in named if name not in self.definitions]
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
        for name in sorted(names_in(asked.tree)):
            if name not in self.known:
                raise ParameterError(
                    f"in {asked.kind}({asked.text}): model '{self.model.name}' has no '{name}'"
                    f"{did_you_mean(name, self.known)}"
                )

    def function(self, asked: Functional) -> Function:
        """Return the expression of a functional as a function along a segment."""
        names = _leaves(asked.tree, self.definitions)

        def value(segment: Segment, shares: FloatArray, kinks: Kinks) -> Dual:
            time, states = segment.at(shares)
            values: dict[str, Any] = {TIME: time}
            values.update(zip(self.model.states, states, strict=True))
            for k, name in enumerate(self.model.parameter_names):
                if name in names:
                    values[name] = segment.parameter(k, len(shares))
            for name in self.observables:
                if name in names:
                    values[name] = segment.observable(name, time, states)
            scope: Scope[Any] = Scope(kinks.algebra(), values, self.definitions)
            with np.errstate(all="ignore"):
                found = scope.evaluate(asked.tree)
            return found if isinstance(found, Dual) else constant(found, time)

        return value


@lru_cache(maxsize=64)
def definitions_of(model: Model) -> Mapping[str, ast.expr]:
    """Return the named expressions of a model that is declared by its equations; empty of another one."""
    if not model.definition:
        return {}
    from contfric.models.describe import from_text

    parts = from_text(model.definition).names.parts
    return {name: parse(text) for name, text in parts.items()}


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
