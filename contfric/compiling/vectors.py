"""Arithmetic with eight numbers at a time: loops are compiled as they stand, and not put into vectors."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.extending import intrinsic
from numba.np.arrayobj import make_array

_EIGHT = ir.VectorType(ir.DoubleType(), 8)


def _place(context: Any, builder: Any, kind: Any, value: Any, row: Any, column: Any) -> Any:
    """Return the address of eight numbers of a row of a matrix."""
    array = make_array(kind)(context, builder, value)
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
