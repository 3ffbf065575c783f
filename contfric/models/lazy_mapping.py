"""Mappings whose values are made when they are first asked for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

T = TypeVar("T")


class Made(dict[Any, T]):
    """A mapping whose values are made when they are first asked for.

    Parameters
    ----------
    make, has : the value of a key, and whether there is one
    """

    def __init__(self, make: Callable[[Any], T], has: Callable[[Any], bool]) -> None:
        super().__init__()
        self._make, self._has = make, has

    def __missing__(self, key: Any) -> T:
        if not self._has(key):
            raise KeyError(key)
        self[key] = self._make(key)
        return self[key]

    def __contains__(self, key: object) -> bool:
        return self._has(key)

    def get(self, key: Any, default: Any = None) -> Any:
        """Return the value of a key, or the default if it has none."""
        return self[key] if self._has(key) else default
