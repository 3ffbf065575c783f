"""Machine code of a model's formulas, straight from the module that they are written in.

A generated module (:mod:`contfric.models.generated.generate`) is scalar arithmetic: assignments, branches,
loops over whole numbers. Numba takes a fifth of a second for each of its functions, most of it to find out
types that are known here. This is a translation of that part of Python, and of no more, to LLVM's language,
for numba's code generator, called as :mod:`contfric.compiling.calls` has it: numbers are doubles or 64-bit
integers, arrays are contiguous, indices are not negative and not checked, and arithmetic is that of IEEE 754
(a division by zero is infinite, the root of -1 is no number).
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import chain, islice
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types

from contfric.compiling.calls import entry_type

DOUBLE, WORD, FLAG, HALF = ir.DoubleType(), ir.IntType(64), ir.IntType(1), ir.IntType(32)
#: Functions of ``math`` that LLVM knows; the others are those of the C library, by the same names.
_INTRINSIC = frozenset({"sin", "cos", "exp", "log", "sqrt", "floor"})
_COMPARED = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}


@dataclass(frozen=True)
class Array:
    """An array that a function gets: where its numbers are, and its shape."""

    data: Any
    shape: list[Any]


@dataclass(frozen=True)
class Function:
    """A function of a generated module.

    Attributes
    ----------
    name : in the module
    signature : as numba has it
    symbol : name of the machine code; empty for a helper, which only other functions call
    """

    name: str
    signature: Any
    symbol: str = ""


def translated(
    module: ir.Module, source: str, functions: list[Function], tables: Mapping[str, Any]
) -> None:
    """Translate functions of a module of Python to one of LLVM.

    Parameters
    ----------
    module : of LLVM
    source : the text
    functions : what is translated; helpers before those that call them
    tables : vectors of numbers that the text refers to by name
    """
    trees = {
        node.name: node for node in ast.parse(source).body if isinstance(node, ast.FunctionDef)
    }
    scope: dict[str, Any] = {}
    for key, table in tables.items():
        kind = ir.ArrayType(DOUBLE, len(table))
        value = ir.GlobalVariable(module, kind, f"table_{key}")
        value.initializer = ir.Constant(kind, [float(x) for x in np.asarray(table)])
        value.global_constant, value.linkage = True, "internal"
        scope[key] = value
    for function in functions:
        made = ir.Function(module, entry_type(function.signature), function.symbol or function.name)
        if not function.symbol:
            made.linkage = "internal"
        scope[function.name] = made
        _Body(module, made, scope).write(trees[function.name], function.signature)


class _Body:
    """Writes one function."""

    def __init__(self, module: Any, function: Any, scope: Mapping[str, Any]) -> None:
        self.module, self.function, self.scope = module, function, scope
        self.builder = ir.IRBuilder(function.append_basic_block())
        self.names: dict[str, Any] = {}

    def write(self, tree: ast.FunctionDef, signature: Any) -> None:
        """Write the whole function."""
        given = iter(self.function.args)
        for argument, kind in zip(tree.args.args, signature.args, strict=True):
            if isinstance(kind, types.Array):
                data, *shape = islice(given, 1 + kind.ndim)
                self.names[argument.arg] = Array(data, shape)
            else:
                self.store(argument.arg, next(given))
        self.block(tree.body)
        if not self.builder.block.is_terminated:
            self.leave(None)

    # ------------------------------------------------------------------------------------ statements

    def block(self, statements: list[ast.stmt]) -> None:
        """Write statements, up to one that leaves the function."""
        for node in statements:
            if self.builder.block.is_terminated:
                return
            write: Callable[[Any], None] = getattr(self, f"write_{type(node).__name__}")
            write(node)

    def write_Pass(self, _: ast.Pass) -> None:
        """Write nothing."""

    def write_Expr(self, node: ast.Expr) -> None:
        """Write a call whose value is not used."""
        self.value(node.value)

    def write_Assign(self, node: ast.Assign) -> None:
        """Write an assignment; all values of several are taken before any is stored."""
        (target,) = node.targets
        if isinstance(target, ast.Tuple):
            assert isinstance(node.value, ast.Tuple)
            values = [self.value(e) for e in node.value.elts]
            for each, value in zip(target.elts, values, strict=True):
                self.assign(each, value)
        else:
            self.assign(target, self.value(node.value))

    def write_AugAssign(self, node: ast.AugAssign) -> None:
        """Write ``a += b`` and the like."""
        self.assign(node.target, self.combined(node.op, self.value(node.target), node.value))

    def write_If(self, node: ast.If) -> None:
        """Write a branch."""
        blocks = [self.function.append_basic_block() for _ in range(3)]
        self.builder.cbranch(self.value(node.test), blocks[0], blocks[1])
        for block, body in zip(blocks, (node.body, node.orelse), strict=False):
            self.builder.position_at_end(block)
            self.block(body)
            if not self.builder.block.is_terminated:
                self.builder.branch(blocks[2])
        self.builder.position_at_end(blocks[2])

    def write_For(self, node: ast.For) -> None:
        """Write a loop over ``range(n)``."""
        assert isinstance(node.iter, ast.Call)
        assert isinstance(node.target, ast.Name)
        stop = self.value(node.iter.args[0])
        self.store(node.target.id, ir.Constant(WORD, 0))
        head, body, end = (self.function.append_basic_block() for _ in range(3))
        self.builder.branch(head)
        self.builder.position_at_end(head)
        k = self.builder.load(self.names[node.target.id])
        self.builder.cbranch(self.builder.icmp_signed("<", k, stop), body, end)
        self.builder.position_at_end(body)
        self.block(node.body)
        k = self.builder.load(self.names[node.target.id])
        self.store(node.target.id, self.builder.add(k, ir.Constant(WORD, 1)))
        self.builder.branch(head)
        self.builder.position_at_end(end)

    def write_Return(self, node: ast.Return) -> None:
        """Leave the function."""
        self.leave(None if node.value is None else self.value(node.value))

    def leave(self, value: Any) -> None:
        """Return a value; numba's functions without one return no address."""
        kind = self.function.function_type.return_type
        self.builder.ret(ir.Constant(kind, None) if value is None else value)

    def assign(self, target: ast.expr, value: Any) -> None:
        """Store a value under a name, or in an array."""
        if isinstance(target, ast.Name):
            self.store(target.id, value)
        else:
            place = self.place(target)
            whole = place.type.pointee == WORD
            self.builder.store(value if whole else self.number(value), place)

    def store(self, name: str, value: Any) -> None:
        """Store a value under a name, which is on the stack: LLVM keeps it in a register."""
        if name not in self.names:
            with self.builder.goto_entry_block():
                self.names[name] = self.builder.alloca(value.type)
        self.builder.store(value, self.names[name])

    # ------------------------------------------------------------------------------------ expressions

    def value(self, node: ast.expr) -> Any:
        """Return the value of an expression: a double, a whole number, a flag, or an array."""
        write: Callable[[Any], Any] = getattr(self, f"value_{type(node).__name__}")
        return write(node)

    def number(self, value: Any) -> Any:
        """Return a value as a double."""
        return value if value.type == DOUBLE else self.builder.sitofp(value, DOUBLE)

    def value_Constant(self, node: ast.Constant) -> Any:
        """Return a number."""
        return ir.Constant(WORD if isinstance(node.value, int) else DOUBLE, node.value)

    def value_Name(self, node: ast.Name) -> Any:
        """Return what has a name."""
        found = self.names.get(node.id) or self.none(node.id)
        return found if isinstance(found, Array) else self.builder.load(found)

    def none(self, name: str) -> Array:
        """Return an array without elements."""
        kind = {"NO_INDICES": WORD, "NO_NUMBERS": DOUBLE}[name]
        return Array(ir.Constant(kind.as_pointer(), None), [ir.Constant(WORD, 0)])

    def value_Attribute(self, node: ast.Attribute) -> Any:
        """Return a constant of ``math``."""
        return ir.Constant(DOUBLE, getattr(math, node.attr))

    def value_Subscript(self, node: ast.Subscript) -> Any:
        """Return a number of an array, or of its shape."""
        inner = node.value
        if isinstance(inner, ast.Attribute):  # a.shape[k]
            assert isinstance(node.slice, ast.Constant)
            return self.array(inner.value).shape[int(node.slice.value)]  # type: ignore[arg-type]
        return self.builder.load(self.place(node))

    def array(self, node: ast.expr) -> Array:
        """Return the array that has a name."""
        assert isinstance(node, ast.Name)
        found = self.names[node.id]
        assert isinstance(found, Array)
        return found

    def place(self, node: ast.expr) -> Any:
        """Return the address of ``a[i]``, ``a[i, j]`` or ``a[i][j]``."""
        found: list[Any] = []
        while isinstance(node, ast.Subscript):
            each = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
            found = [self.value(e) for e in each] + found
            node = node.value
        assert isinstance(node, ast.Name)
        if node.id in self.scope:
            return self.builder.gep(self.scope[node.id], [ir.Constant(HALF, 0), *found], True)
        array = self.array(node)
        at = found[0]
        for size, index in zip(array.shape[1:], found[1:], strict=True):
            at = self.builder.add(self.builder.mul(at, size), index)
        return self.builder.gep(array.data, [at], True)

    def value_UnaryOp(self, node: ast.UnaryOp) -> Any:
        """Return minus a value."""
        assert isinstance(node.op, ast.USub)
        value = self.value(node.operand)
        return self.builder.fneg(value) if value.type == DOUBLE else self.builder.neg(value)

    def value_BinOp(self, node: ast.BinOp) -> Any:
        """Return a sum, product, quotient or power."""
        return self.combined(node.op, self.value(node.left), node.right)

    def combined(self, operator: ast.operator, a: Any, right: ast.expr) -> Any:
        """Return two values combined."""
        exponent = right.value if isinstance(right, ast.Constant) else None
        if isinstance(operator, ast.Pow) and isinstance(exponent, int):
            return self.whole_power(self.number(a), exponent)
        b, builder = self.value(right), self.builder
        whole = a.type == WORD and b.type == WORD and not isinstance(operator, (ast.Div, ast.Pow))
        if whole:
            found = {ast.Add: builder.add, ast.Sub: builder.sub, ast.Mult: builder.mul}
            return found[type(operator)](a, b)
        a, b = self.number(a), self.number(b)
        if isinstance(operator, ast.Pow):
            return builder.call(self.module.declare_intrinsic("llvm.pow", [DOUBLE]), [a, b])
        kinds = {ast.Add: builder.fadd, ast.Sub: builder.fsub, ast.Mult: builder.fmul}
        return kinds.get(type(operator), builder.fdiv)(a, b)

    def whole_power(self, base: Any, exponent: int) -> Any:
        """Return a positive whole power, by squares."""
        found = None
        while exponent:
            if exponent & 1:
                found = base if found is None else self.builder.fmul(found, base)
            exponent >>= 1
            base = self.builder.fmul(base, base) if exponent else base
        return found

    def value_Compare(self, node: ast.Compare) -> Any:
        """Return a flag: one comparison, or ``a < x < b``."""
        values = [self.value(e) for e in (node.left, *node.comparators)]
        found = None
        for operator, a, b in zip(node.ops, values, values[1:], strict=False):
            sign = _COMPARED[type(operator)]
            if a.type == WORD and b.type == WORD:
                flag = self.builder.icmp_signed(sign, a, b)
            else:  # what is no number is different from all, and neither more nor less
                compare = self.builder.fcmp_unordered if sign == "!=" else self.builder.fcmp_ordered
                flag = compare(sign, self.number(a), self.number(b))
            found = flag if found is None else self.builder.and_(found, flag)
        return found

    def value_BoolOp(self, node: ast.BoolOp) -> Any:
        """Return a flag: any of some, all of which have a value whatever the others are."""
        assert isinstance(node.op, ast.Or)
        found, *others = (self.value(e) for e in node.values)
        for other in others:
            found = self.builder.or_(found, other)
        return found

    def value_IfExp(self, node: ast.IfExp) -> Any:
        """Return ``a if d else b``; only the one that is wanted is computed."""
        blocks = [self.function.append_basic_block() for _ in range(3)]
        self.builder.cbranch(self.value(node.test), blocks[0], blocks[1])
        ends = []
        for block, each in zip(blocks, (node.body, node.orelse), strict=False):
            self.builder.position_at_end(block)
            ends.append((self.number(self.value(each)), self.builder.block))
            self.builder.branch(blocks[2])
        self.builder.position_at_end(blocks[2])
        found = self.builder.phi(DOUBLE)
        for value, block in ends:
            found.add_incoming(value, block)
        return found

    def value_Call(self, node: ast.Call) -> Any:
        """Return the value of a function of ``math``, or of a helper."""
        arguments = [self.value(e) for e in node.args]
        if isinstance(node.func, ast.Name) and node.func.id in self.scope:
            flat = [[a.data, *a.shape] if isinstance(a, Array) else [a] for a in arguments]
            return self.builder.call(self.scope[node.func.id], [*chain.from_iterable(flat)])
        arguments = [self.number(e) for e in arguments]
        name = "fabs" if isinstance(node.func, ast.Name) else node.func.attr  # type: ignore[attr-defined]
        if name in _INTRINSIC or name == "fabs":
            return self.builder.call(
                self.module.declare_intrinsic(f"llvm.{name}", [DOUBLE]), arguments
            )
        known = self.module.globals.get(name)
        kind = ir.FunctionType(DOUBLE, [DOUBLE] * len(arguments))
        return self.builder.call(known or ir.Function(self.module, kind, name), arguments)
