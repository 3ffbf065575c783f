"""The arguments of a call as bytes that distinguish it from other calls; a user's function by its code.

A function is no data that could be read again, but a result depends on what it does. So it is identified
by its compiled code and the values that it uses: constants, defaults, what it closes over, and what it
names of its module: numbers, texts, arrays, and other functions, these in the same way. Of another module
its name counts: a change there goes unseen.
"""

from __future__ import annotations

import functools
import json
from types import CellType, CodeType, FunctionType
from typing import Any

import numpy as np

from contfric.remember.stored import Writer

#: Values of a module that a function may use as data.
_PLAIN = (bool, int, float, complex, str, tuple, list, dict, set, frozenset, np.ndarray, np.generic)


class Question(Writer):
    """Writes what a call is asked, functions by their code."""

    def _node(self, value: Any) -> Any:
        if isinstance(value, FunctionType | CodeType | functools.partial):
            seen = self._places.get(id(value))
            return seen if seen is not None else self._of_function(value)
        return super()._node(value)

    def _of_function(self, value: FunctionType | CodeType | functools.partial[Any]) -> Any:
        self._places[id(value)] = ["seen", len(self.objects)]
        self.objects.append(value)
        if isinstance(value, functools.partial):
            return ["partial", *map(self._node, (value.func, value.args, value.keywords))]
        if isinstance(value, CodeType):
            names = value.co_names, value.co_varnames, value.co_freevars
            return ["code", value.co_code.hex(), *map(self._constant, value.co_consts), *names]
        return [
            "function",
            *(f"{value.__module__}:{value.__qualname__}", self._node(value.__code__)),
            *(self._node(value.__defaults__), self._node(value.__kwdefaults__)),
            *map(self._closed_over, value.__closure__ or ()),
            *(self._global(value, name) for name in sorted(_names_of(value.__code__))),
        ]

    def _closed_over(self, cell: CellType) -> Any:
        try:
            return self._node(cell.cell_contents)
        except ValueError:  # nothing yet
            return None

    def _constant(self, value: Any) -> Any:
        if isinstance(value, CodeType):
            return self._node(value)
        if isinstance(value, frozenset):  # its order is that of a process
            return ["frozenset", *sorted(map(self._constant, value), key=json.dumps)]
        if isinstance(value, tuple):
            return ["tuple", *map(self._constant, value)]
        return repr(value)

    def _global(self, function: FunctionType, name: str) -> Any:
        value = function.__globals__.get(name)
        own = isinstance(value, FunctionType) and value.__module__ == function.__module__
        return [name, self._node(value) if own or isinstance(value, _PLAIN) else None]


def _names_of(code: CodeType) -> set[str]:
    """Return the names that code uses, with those of functions within it."""
    inner = (_names_of(c) for c in code.co_consts if isinstance(c, CodeType))
    return set(code.co_names).union(*inner)
