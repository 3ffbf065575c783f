"""Public names of a package that are imported when they are first used."""

from __future__ import annotations

import sys
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
            found = getattr(import_module(where[name]), name)
        vars(sys.modules[package])[name] = found  # the next look-up costs nothing
        return found

    return sorted(where), find, lambda: sorted(where)
