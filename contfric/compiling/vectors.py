"""Arithmetic with eight numbers at a time: loops are compiled as they stand, and not put into vectors."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.extending import intrinsic

_EIGHT = ir.VectorType(ir.DoubleType(), 8)


def _place(context: Any, builder: Any, kind: Any, value: Any, row: Any, column: Any) -> Any:
    """Return the address of eight numbers of a row of a matrix."""
    array = context.make_array(kind)(context, builder, value)
    _, width = cgutils.unpack_tuple(builder, array.shape, 2)
    at = builder.add(builder.mul(row, width), column)
    return builder.bitcast(builder.gep(array.data, [at]), _EIGHT.as_pointer())


def _subtract_eight(
    typing: Any, target: Any, row: Any, source: Any, j: Any, factor: Any, k: Any
) -> Any:
    """Subtract a multiple of eight numbers of a row of a matrix; rounded as one by one."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        into, row, source, j, factor, k = arguments
        kinds = signature.args
        own = _place(context, builder, kinds[0], into, row, k)
        other = _place(context, builder, kinds[2], source, j, k)
        lane, first = ir.Constant(ir.IntType(32), 0), ir.Constant(_EIGHT, ir.Undefined)
        factors = builder.shuffle_vector(
            builder.insert_element(first, factor, lane),
            first,
            ir.Constant(ir.VectorType(ir.IntType(32), 8), [0] * 8),
        )
        product = builder.fmul(factors, builder.load(other, align=8))
        builder.store(builder.fsub(builder.load(own, align=8), product), own, align=8)
        return context.get_dummy_value()

    integer = types.int64
    return types.void(target, integer, source, integer, types.float64, integer), code


subtract_eight: Any = intrinsic(prefer_literal=False)(_subtract_eight)


def _address(context: Any, builder: Any, kind: Any, value: Any, row: Any) -> tuple[Any, Any, Any]:
    """Return the address of a row of a matrix, and the shape of the matrix."""
    array = context.make_array(kind)(context, builder, value)
    height, width = cgutils.unpack_tuple(builder, array.shape, 2)
    return builder.gep(array.data, [builder.mul(row, width)]), height, width


class _Products:
    """Code that adds ``width`` numbers of a row times a matrix, all terms in registers.

    With ``low`` each number is the sum of two, and so is the result: to twice as many digits.
    """

    def __init__(self, width: int, low: bool) -> None:
        self.width, self.low = width, low
        self.kind = ir.VectorType(ir.DoubleType(), width) if width > 1 else ir.DoubleType()

    def spread(self, builder: Any, number: Any) -> Any:
        """Return a number in all places of a vector."""
        if self.width == 1:
            return number
        first = ir.Constant(self.kind, ir.Undefined)
        first = builder.insert_element(first, number, ir.Constant(ir.IntType(32), 0))
        places = ir.Constant(ir.VectorType(ir.IntType(32), self.width), [0] * self.width)
        return builder.shuffle_vector(first, first, places)

    def part(self, builder: Any, row: Any, k: Any) -> Any:
        """Return the address of the numbers of a row from the column k on."""
        return builder.bitcast(builder.gep(row, [k]), self.kind.as_pointer())

    def fused(self, builder: Any, a: Any, b: Any, c: Any) -> Any:
        """Return ``a b + c``, rounded once."""
        name = "llvm.fma." + (f"v{self.width}f64" if self.width > 1 else "f64")
        kind = ir.FunctionType(self.kind, [self.kind] * 3)
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), [a, b, c])

    def term(self, builder: Any, sums: Any, factors: Any, numbers: Any) -> None:
        """Add a factor times numbers."""
        a, b = self.spread(builder, factors[0]), numbers[0]
        product, before = builder.fmul(a, b), builder.load(sums[0])
        total = builder.fadd(before, product)
        builder.store(total, sums[0])
        if not self.low:
            return
        rest = self.fused(builder, a, b, builder.fneg(product))
        rest = builder.fadd(rest, builder.fmul(a, numbers[1]))
        rest = builder.fadd(rest, builder.fmul(self.spread(builder, factors[1]), b))
        moved = builder.fsub(total, before)  # what the sum has lost
        lost = builder.fadd(
            builder.fsub(before, builder.fsub(total, moved)), builder.fsub(product, moved)
        )
        builder.store(builder.fadd(builder.load(sums[1]), builder.fadd(lost, rest)), sums[1])

    def code(self, context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """Add a row times a matrix, at the columns k and behind, to a row of a target."""
        parts = 2 if self.low else 1
        kinds = signature.args
        at = [a for a in range(len(kinds)) if isinstance(kinds[a], types.Array)]
        row_of = dict.fromkeys(at[:parts], arguments[parts])
        row_of |= dict.fromkeys(at[parts : 2 * parts], arguments[2 * parts + 1])
        zero = context.get_constant(types.intp, 0)
        found = [
            _address(context, builder, kinds[a], arguments[a], row_of.get(a, zero)) for a in at
        ]
        rows = [address for address, _, _ in found]
        _, height, width = found[2 * parts]
        k, one = arguments[-1], ir.Constant(ir.DoubleType(), 0.0)
        targets = [self.part(builder, row, k) for row in rows[:parts]]
        sums = [cgutils.alloca_once(builder, self.kind) for _ in targets]
        for own, target in zip(sums, targets, strict=True):
            builder.store(builder.load(target, align=8), own)
        with cgutils.for_range(builder, height) as loop:
            factors = [
                builder.load(builder.gep(row, [loop.index])) for row in rows[parts : 2 * parts]
            ]
            with builder.if_then(builder.fcmp_unordered("!=", factors[0], one)):
                shift = builder.add(builder.mul(loop.index, width), k)
                numbers = [
                    builder.load(self.part(builder, row, shift), align=8)
                    for row in rows[2 * parts :]
                ]
                self.term(builder, sums, factors, numbers)
        for own, target in zip(sums, targets, strict=True):
            builder.store(builder.load(own), target, align=8)
        return context.get_dummy_value()


def _product(width: int) -> Any:
    products = _Products(width, low=False)

    def add(typing: Any, out: Any, i: Any, rows: Any, r: Any, matrix: Any, k: Any) -> Any:
        integer = types.int64
        return types.void(out, integer, rows, integer, matrix, integer), products.code

    return intrinsic(prefer_literal=False)(add)


def _product_of_pairs(width: int) -> Any:
    products = _Products(width, low=True)

    def add(
        typing: Any,
        out: Any,
        o: Any,
        i: Any,
        rows: Any,
        w: Any,
        r: Any,
        matrix: Any,
        m: Any,
        k: Any,
    ) -> Any:
        integer = types.int64
        kinds = out, o, integer, rows, w, integer, matrix, m, integer
        return types.void(*kinds), products.code

    return intrinsic(prefer_literal=False)(add)


#: add(out, i, rows, r, matrix, k): ``out[i, k:] += rows[r] matrix[:, k:]`` of 8, 4 or 1 numbers.
add_product_8, add_product_4, add_product_1 = (_product(width) for width in (8, 4, 1))
#: The same with the lower halves of each array next to it.
add_pairs_8, add_pairs_4, add_pairs_1 = (_product_of_pairs(width) for width in (8, 4, 1))
