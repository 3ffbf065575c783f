"""Public names of a package that are imported when they are first used."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazily(
    package: str, homes: Mapping[str, str]
) -> tuple[list[str], Callable[[str], Any], Callable[[], list[str]]]:
    """Return ``__all__``, ``__getattr__`` and ``__dir__`` of a package.

    Parameters
    ----------
    package : its name
    homes : modules of the package, each with the names that it has, in one text

    Examples
    --------
    >>> names, find, _ = lazily("contfric.orbit", {"orbit": "Orbit Status", "clock": "clocked"})
    >>> names, find("clocked").__name__
    (['Orbit', 'Status', 'clocked'], 'clocked')
    """
    where = {name: f"{package}.{home}" for home, names in homes.items() for name in names.split()}

    def find(name: str) -> Any:
        if name not in where:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        from contfric.base.interrupts import held_back

        with held_back():
            return getattr(import_module(where[name]), name)

    return sorted(where), find, lambda: sorted(where)
