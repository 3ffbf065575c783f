"""Numbers of several solutions in one vector of the processor: a type for compiled code.

Loops are compiled as they stand, and not put into vectors (:mod:`contfric.compiled`); a search of roots is no
loop that a compiler would find, either. ``Lanes`` holds a number of each of :data:`LANES` motions. Arithmetic
with it, and with plain numbers, acts on each by itself and is rounded as it would be alone, so that a result
does not depend on which motions stand next to it.
"""

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.extending import intrinsic, models, register_model
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature

#: Solutions side by side: one vector of AVX-512, two of AVX2.
LANES = 8
_BIT = ir.IntType(1)
_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_MASK = ir.VectorType(_BIT, LANES)


class _Lanes(types.Type):  # type: ignore[misc]
    """Numba's type of such a vector, of numbers or of truths."""

    def __init__(self, name: str, model: Any) -> None:
        self.model = model
        super().__init__(name)


lanes, mask = _Lanes("Lanes", _VECTOR), _Lanes("Mask", _MASK)


@register_model(_Lanes)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    """A vector of LLVM."""

    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, fe_type.model)


def _spread(builder: Any, value: Any) -> Any:
    """Return a vector that holds one number in all places; of a vector, itself."""
    if value.type == _VECTOR:
        return value
    first = builder.insert_element(
        ir.Constant(_VECTOR, ir.Undefined), value, ir.Constant(ir.IntType(32), 0)
    )
    places = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(first, ir.Constant(_VECTOR, ir.Undefined), places)


def _operation(sign: Any, result: Any, given: Any, code: Any) -> None:
    """Define what an operator does with vectors: ``code(builder, one, other)``."""
    pairs = [(given, given)]
    if given is lanes:
        pairs += [(lanes, types.float64), (types.float64, lanes)]

    class Template(AbstractTemplate):  # type: ignore[misc]
        key = sign

        def generic(self, args: Any, kws: Any) -> Any:
            return signature(result, *args) if not kws and args in pairs else None

    infer_global(sign)(Template)

    def lowered(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        one, other = (_spread(builder, a) if given is lanes else a for a in args)
        return code(builder, one, other)

    for pair in pairs:
        lower_builtin(sign, *pair)(lowered)


for _sign, _name in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _operation(_sign, lanes, lanes, lambda b, x, y, name=_name: getattr(b, name)(x, y))
for _sign, _name in (
    (operator.lt, "<"),
    (operator.gt, ">"),
    (operator.le, "<="),
    (operator.ge, ">="),
):
    _operation(_sign, mask, lanes, lambda b, x, y, name=_name: b.fcmp_ordered(name, x, y))
_operation(operator.and_, mask, mask, lambda b, x, y: b.and_(x, y))
_operation(operator.or_, mask, mask, lambda b, x, y: b.or_(x, y))


def _intrinsic(name: str) -> Any:
    def found(typing: Any, x: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            kind = ir.FunctionType(_VECTOR, [_VECTOR])
            name_of = f"llvm.{name}.v{LANES}f64"
            return builder.call(cgutils.get_or_insert_function(builder.module, kind, name_of), args)

        return (lanes(x), code) if x is lanes else None

    return intrinsic(prefer_literal=False)(found)


#: Square root and absolute value, number by number.
square_root, absolute = _intrinsic("sqrt"), _intrinsic("fabs")


def _choose(typing: Any, where: Any, one: Any, other: Any) -> Any:
    """Return ``one`` where a truth holds and ``other`` where it does not."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.select(args[0], _spread(builder, args[1]), _spread(builder, args[2]))

    return lanes(where, one, other), code


choose: Any = intrinsic(prefer_literal=False)(_choose)


def _without(typing: Any, one: Any, other: Any) -> Any:
    """Return where the first truth holds and the second does not."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.and_(args[0], builder.not_(args[1]))

    return mask(one, other), code


without: Any = intrinsic(prefer_literal=False)(_without)


def _bits(typing: Any, where: Any) -> Any:
    """Return truths as the bits of a whole number."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.zext(builder.bitcast(args[0], ir.IntType(LANES)), ir.IntType(64))

    return types.int64(where), code


bits: Any = intrinsic(prefer_literal=False)(_bits)


def _place(context: Any, builder: Any, kind: Any, array: Any, row: Any) -> Any:
    own = context.make_array(kind)(context, builder, array)
    _, width = cgutils.unpack_tuple(builder, own.shape, 2)
    at = builder.gep(own.data, [builder.mul(row, width)])
    return builder.bitcast(at, _VECTOR.as_pointer())


def _read(typing: Any, array: Any, row: Any) -> Any:
    """Return the first numbers of a row of a matrix."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.load(_place(context, builder, signature.args[0], *args), align=8)

    return lanes(array, types.int64), code


read: Any = intrinsic(prefer_literal=False)(_read)


def _write(typing: Any, array: Any, row: Any, value: Any) -> Any:
    """Write the first numbers of a row of a matrix."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        builder.store(args[2], _place(context, builder, signature.args[0], *args[:2]), align=8)
        return context.get_dummy_value()

    return types.void(array, types.int64, lanes), code


write: Any = intrinsic(prefer_literal=False)(_write)
