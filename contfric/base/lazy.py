"""Public names of a package that are imported when they are first used."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module
from typing import Any


def lazily(package: str) -> tuple[list[str], Callable[[str], Any], Callable[[], list[str]]]:
    """Return ``__all__``, ``__getattr__`` and ``__dir__`` of a package.

    Its lazy names stand once, where type checkers read them: in its source, in lines that say
    ``from MODULE import NAME as NAME`` below ``if TYPE_CHECKING``.

    Examples
    --------
    >>> names, find, _ = lazily("contfric.study")
    >>> names[:2], find("Plan").__name__
    (['Plan', 'Study'], 'Plan')
    """
    source = sys.modules[package].__spec__.loader.get_source(package)  # type: ignore[union-attr]
    where = {}
    for line in source.splitlines():
        words = line.split()
        if line.startswith("    from ") and words[4:5] == ["as"] and words[3] == words[5]:
            where[words[3]] = words[1]

    def find(name: str) -> Any:
        if name not in where:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        from contfric.base.interrupts import held_back

        with held_back():
            return getattr(import_module(where[name]), name)

    return sorted(where), find, lambda: sorted(where)
