"""The meaning of names in a model's expressions, and where each is allowed."""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

from contfric.base.attributes import kept
from contfric.base.yaml_lines import Address
from contfric.errors import ModelError, did_you_mean
from contfric.models.entries import EntryError
from contfric.models.language.grammar import (
    PERIOD,
    PI,
    TIME,
    Algebra,
    Scope,
    check_name,
    names_in,
    parse,
)

T = TypeVar("T")
#: A period that is the parameter T itself, or that in another unit of time.
_IS_T = re.compile(rf"\s*({PERIOD}|\({PERIOD}\)/[\d.e+-]+)\s*")


@dataclass(frozen=True)
class Names:
    """States, parameters and named parts of expressions (definitions and observables)."""

    states: tuple[str, ...]
    parameters: tuple[str, ...]
    define: Mapping[str, str]
    observables: Mapping[str, str]

    @classmethod
    def of(
        cls,
        states: tuple[str, ...],
        parameters: tuple[str, ...],
        define: Mapping[str, str],
        observables: Mapping[str, str],
    ) -> Names:
        """Return the names; an observable that is a state itself needs no second one."""
        return cls(states, parameters, define, observables)

    @cached_property
    def parts(self) -> dict[str, str]:
        """Names that stand for an expression."""
        named = {**self.define, **self.observables}
        return {name: text for name, text in named.items() if name not in self.states}

    def check_names(self, period: str) -> None:
        """Refuse names that expressions cannot use, or that mean two things.

        A parameter T is welcome where it is the period, whatever unit of time that is counted in; and
        anything may be called T, such as a temperature, where there is no excitation.
        """
        own_period = _IS_T.fullmatch(period) is not None
        taken: dict[str, str] = {}
        groups: tuple[tuple[str, tuple[str, ...], str], ...] = (
            ("states", self.states, "state"),
            ("parameters", self.parameters, "parameter"),
            ("define", tuple(self.define), "definition"),
            ("observables", tuple(self.observables), "observable"),
        )
        for key, names, what in groups:
            for index, name in enumerate(names):
                address: Address = (key, index if key == "states" else name)
                try:
                    parameter = what == "parameter" and own_period
                    if not (name == PERIOD and (parameter or not period)):
                        check_name(name, what)
                except ModelError as error:
                    raise EntryError(address, str(error)) from None
                itself = what == "observable" and self.observables[name].strip() == name
                if name in taken and not (itself and name in self.states):
                    raise EntryError(
                        address, f"the {what} '{name}' has the name of a {taken[name]}"
                    )
                taken.setdefault(name, what)

    def check(
        self,
        address: Address,
        text: str,
        autonomous: bool = False,
        only_parameters: bool = False,
    ) -> None:
        """Read an expression and look all of its names up."""
        try:
            found = self.leaves_of(text)
        except ModelError as error:
            raise EntryError(address, str(error)) from None
        if only_parameters:
            foreign = found - {*self.parameters, PI}
            if foreign:
                raise EntryError(
                    address,
                    f"'{text}' depends on '{sorted(foreign)[0]}': only parameters can stand here",
                )
        elif autonomous and TIME in found:
            raise EntryError(
                address,
                "t stands in an expression of an autonomous model: give the 'period' of the "
                "excitation in place of 'autonomous'",
            )
        if PERIOD in found and PERIOD not in (*self.states, *self.parameters):
            raise EntryError(address, "the period T can only stand in the symmetry")

    @kept
    def leaves_of(self, text: str) -> frozenset[str]:
        """Return the states, parameters and t that an expression depends on; each text is read once.

        Modes of a structure differ in few of their rates.

        Raises
        ------
        ModelError
            If it is no expression, or for a name that is not known.
        """
        return frozenset(self.leaves(parse(text), ()))

    def leaves(self, tree: ast.expr, above: tuple[str, ...]) -> set[str]:
        """Return the states, parameters and t that an expression depends on."""
        found: set[str] = set()
        known = (*self.states, *self.parameters, TIME, PI)
        known = known if PERIOD in self.parts else (*known, PERIOD)
        for name in names_in(tree):
            if name in known:
                found.add(name)
            elif name in above:
                raise ModelError(f"'{name}' is defined by itself: {' -> '.join((*above, name))}")
            elif name in self.parts:
                found |= self.leaves(parse(self.parts[name]), (*above, name))
            else:
                hint = did_you_mean(name, (*known, *self.parts))
                raise ModelError(f"unknown name '{name}'{hint}")
        return found

    def scope(self, algebra: Algebra[T], values: Mapping[str, T]) -> Scope[T]:
        """Return the scope of all names, with the values of states, parameters and t."""
        return Scope(algebra, dict(values), self.trees)

    @cached_property
    def trees(self) -> dict[str, ast.expr]:
        """The expressions of all named parts, read."""
        return {name: parse(text) for name, text in self.parts.items()}
