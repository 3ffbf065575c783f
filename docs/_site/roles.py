"""Docstrings as the site shows them.

Roles become links: ``:func:`contfric.explore` `` leads to that function's entry. A parameter whose meaning
stands in one line, where numpydoc has its type, gets that line as its description, and its type from the
signature.
"""

from __future__ import annotations

import re
from typing import Any

import griffe

_ROLE = re.compile(r":(?:func|class|mod|meth|attr|exc|data):`~?([^`]+)`")
#: ``name : meaning`` with nothing below it, where the meaning is no type.
_TYPE = r"(?:ndarray|arrays?|tuple|list|dict|str|int|float|bool)\b|[A-Z(]"
_ONE_LINE = re.compile(rf"^(\w+(?:, \w+)*) : (?!{_TYPE})(.+)(?=\n\S|\n*\Z)", re.MULTILINE)
_SECTION = re.compile(r"^(?:Parameters|Attributes)\n-+\n(?:.+\n?)+", re.MULTILINE)


class Roles(griffe.Extension):
    """Public names are linked, any other name stands as code; meanings stand where meanings belong."""

    def on_instance(self, *, obj: griffe.Object, **_: Any) -> None:
        """Rewrite the docstring of one object when it is collected."""
        if obj.docstring is not None:
            obj.docstring.value = rewritten(obj.docstring.value)


def rewritten(docstring: str) -> str:
    """Return a docstring with its meanings as descriptions and its roles as links."""
    text = _SECTION.sub(lambda m: _ONE_LINE.sub(r"\1\n    \2", m[0]), docstring)
    return _ROLE.sub(lambda m: _linked(m[1]), text)


def _linked(target: str) -> str:
    import contfric

    name = target.removeprefix("contfric.")
    public = name.split(".", maxsplit=1)[0] in contfric.__all__
    return f"[`{name}`][contfric.{name}]" if public else f"`{target}`"
