"""Memory after a pointer in compiled code: as an array, and with a lock where several threads run."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.extending import intrinsic

_FREE, _TAKEN = ir.Constant(ir.IntType(64), 0), ir.Constant(ir.IntType(64), 1)


def _try_lock(typing: Any, place: Any) -> Any:
    """Take the lock at a pointer to numbers, zero where it is free; tell whether it was free."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        word = builder.bitcast(arguments[0], ir.IntType(64).as_pointer())
        found = builder.cmpxchg(word, _FREE, _TAKEN, "acquire", "monotonic")
        return builder.zext(builder.extract_value(found, 1), ir.IntType(8))

    return types.uint8(place), code


def _unlock(typing: Any, place: Any) -> Any:
    """Give the lock back."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        word = builder.bitcast(arguments[0], ir.IntType(64).as_pointer())
        builder.store_atomic(_FREE, word, "release", align=8)
        return context.get_dummy_value()

    return types.void(place), code


def _numbers_at(typing: Any, place: Any, size: Any) -> Any:
    """Return the numbers at a pointer as an array, whose memory nothing counts references to."""
    kind = types.Array(types.float64, 1, "C")

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(kind)(context, builder)
        data, count = arguments
        word = context.get_constant(types.intp, 8)
        shape = cgutils.pack_array(builder, [count])
        strides = cgutils.pack_array(builder, [word])
        context.populate_array(
            array, data=data, shape=shape, strides=strides, itemsize=word, meminfo=None
        )
        return array._getvalue()

    return kind(place, types.int64), code


try_lock: Any = intrinsic(prefer_literal=False)(_try_lock)
unlock: Any = intrinsic(prefer_literal=False)(_unlock)
numbers_at: Any = intrinsic(prefer_literal=False)(_numbers_at)
