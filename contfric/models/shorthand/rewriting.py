"""Expressions of a model's data, each put in the place of another one."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

from contfric.base.yaml_lines import Address
from contfric.models.described.reset_modes import FROM, TO

#: A way down to expressions: a key, and None for all keys of a mapping.
Place: TypeAlias = tuple[str | None, ...]
#: Formulas that all modes share; those of each mode; and what else are expressions, of parameters only.
SHARED: tuple[Place, ...] = (
    *(("define", None), ("observables", None), ("field", None), ("resets", None, None)),
)
OF_MODES: tuple[Place, ...] = (("modes", None, "field", None),)
OTHERS: tuple[Place, ...] = (
    *(("period",), ("spread", None), ("surfaces", None, "level"), ("quantities", None)),
    *(("forces", None, "texts", None), ("forces", None, "rest"), ("forces", None, "at")),
)


def tree_of(text: str) -> ast.Expression | None:
    """Return an expression as a tree; None where it is not valid: whoever reads it says why."""
    try:
        return ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None


def rewritten(
    data: Mapping[str, Any], places: Sequence[Place], change: Callable[[Any, Address], Any]
) -> dict[str, Any]:
    """Return a model's data with ``change(expression, address)`` in the place of each expression.

    Examples
    --------
    >>> data = {"modes": {"slide": {"field": {"x": "v"}}}}
    >>> rewritten(data, OF_MODES, lambda text, address: f"2*{text}")
    {'modes': {'slide': {'field': {'x': '2*v'}}}}
    """
    found = dict(data)
    for place in places:
        found = _below(found, place, (), change)
    return found


def _below(value: Any, place: Place, address: Address, change: Callable[..., Any]) -> Any:
    if address[:1] == ("resets",) and address[2:] in ((TO,), (FROM,)):
        return value  # names of modes
    if not place:
        return (
            [change(v, address) for v in value]
            if isinstance(value, list)
            else change(value, address)
        )
    if not isinstance(value, Mapping):
        return value
    return {
        k: _below(v, place[1:], (*address, str(k)), change) if place[0] in (None, k) else v
        for k, v in value.items()
    }
