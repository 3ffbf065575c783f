"""Roles in docstrings become links: ``:func:`contfric.explore` `` to that function's entry."""

from __future__ import annotations

import re
from typing import Any

import griffe

_ROLE = re.compile(r":(?:func|class|mod|meth|attr|exc|data):`~?([^`]+)`")


class Roles(griffe.Extension):
    """Public names are linked; any other name stands as code."""

    def on_instance(self, *, obj: griffe.Object, **_: Any) -> None:
        """Rewrite the docstring of one object when it is collected."""
        if obj.docstring is not None:
            obj.docstring.value = _ROLE.sub(lambda m: _linked(m[1]), obj.docstring.value)


def _linked(target: str) -> str:
    import contfric

    name = target.removeprefix("contfric.")
    public = name.split(".", maxsplit=1)[0] in contfric.__all__
    return f"[`{name}`][contfric.{name}]" if public else f"`{target}`"
