"""Factors of an expression: the sign of a product is known where those of its factors are.

Reid's spring has ``sign(x*v)``, or ``where(x*v > 0, k1, k2)``, with modes by the sides of x and of v.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from contfric.models.language.grammar import Scope

T = TypeVar("T")


def of_product(scope: Scope[T], function: Callable[[T], T], node: ast.expr) -> T:
    """Return the sign or size of an expression: of a product, the product of those of its factors."""
    (first, _), *others = factors(node, scope.defines)
    found: Any = function(scope.evaluate(first))
    for tree, below in others:
        value: Any = function(scope.evaluate(tree))
        found = scope.algebra.divide(found, value) if below else found * value
    return found  # type: ignore[no-any-return]


def difference(scope: Scope[T], left: ast.expr, right: ast.expr) -> T:
    """Return ``left - right``, of which a condition asks the sign; of a product compared with 0, its sign."""
    if _is_zero(right) and len(factors(left, scope.defines)) > 1:
        return of_product(scope, scope.algebra.functions["sign"], left)
    if _is_zero(left) and len(factors(right, scope.defines)) > 1:
        return -of_product(scope, scope.algebra.functions["sign"], right)  # type: ignore[operator, no-any-return]
    return scope.evaluate(left) - scope.evaluate(right)  # type: ignore[operator, no-any-return]


def _is_zero(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and node.value == 0


def factors(node: ast.expr, defines: Mapping[str, ast.expr]) -> list[tuple[ast.expr, bool]]:
    """Return the factors of a tree, with whether each is divided by; names are looked up in definitions.

    Examples
    --------
    >>> tree = ast.parse("x*y/(2*z)", mode="eval").body
    >>> [(ast.unparse(factor), below) for factor, below in factors(tree, {})]
    [('x', False), ('y', False), ('2', True), ('z', True)]
    """
    while isinstance(node, ast.Name) and node.id in defines:
        name, node = node.id, defines[node.id]
        defines = {k: v for k, v in defines.items() if k != name}  # by itself none is defined
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return [(ast.Constant(-1), False), *factors(node.operand, defines)]
    if not isinstance(node, ast.BinOp) or not isinstance(node.op, (ast.Mult, ast.Div)):
        return [(node, False)]
    divides = isinstance(node.op, ast.Div)
    right = factors(node.right, defines)
    return [*factors(node.left, defines), *((tree, below != divides) for tree, below in right)]
