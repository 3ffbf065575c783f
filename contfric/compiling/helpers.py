"""Helpers before numba knows them: what is loaded from the cache needs none of them.

Numba takes a tenth of a millisecond to make a function its own, and a run from the shell imports some
hundreds of helpers without compiling a single one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import numba


class Helper:
    """A function that numba takes over when a kernel that calls it is compiled.

    Parameters
    ----------
    function, options : what is compiled, and how
    """

    def __init__(self, function: Callable[..., Any], options: Mapping[str, Any]) -> None:
        self.py_func, self._options = function, options
        self.__doc__, self.__name__ = function.__doc__, function.__name__
        self.__module__ = function.__module__

    @cached_property
    def dispatcher(self) -> Any:
        """The function as numba knows it."""
        return numba.njit(**self._options)(self.py_func)

    @property
    def _numba_type_(self) -> Any:
        """Its type in compiled code, which numba asks for by this name."""
        return self.dispatcher._numba_type_
