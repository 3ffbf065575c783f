"""Named tuples by reference in compiled code: a call hands over one address, not every member.

Numba passes a named tuple by value: each array is seven to nine numbers, and a layout with its workspace some
hundreds, which every call that is not inlined writes to the stack and reads back. That was a quarter of the
cost of a branch, and it grew with each member. A reference is the address of the tuple, and
``way.layout.modes`` loads what it names. A member that is a named tuple is a reference itself.

Nothing counts references here: :func:`by_reference` belongs into a helper (:mod:`contfric.compiled`), whose
caller holds the tuple as long as the helper runs.
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.core import cgutils
from numba.core.extending import infer_getattr, intrinsic, models, register_model
from numba.core.imputils import impl_ret_borrowed, lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate


class Reference(types.Type):  # type: ignore[misc]
    """Numba's type of the address of a named tuple.

    Parameters
    ----------
    target : type of the named tuple
    """

    def __init__(self, target: Any) -> None:
        self.target = target
        super().__init__(f"Reference({target})")

    def type_of(self, name: str) -> Any:
        """Return the type of a member, None where no member has that name."""
        if name not in self.target.fields:
            return None
        kind = self.target.types[self.target.fields.index(name)]
        return Reference(kind) if isinstance(kind, types.BaseNamedTuple) else kind


@register_model(Reference)
class _ReferenceModel(models.PrimitiveModel):  # type: ignore[misc]
    """An address."""

    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, dmm.lookup(fe_type.target).get_value_type().as_pointer())


@infer_getattr
class _Members(AttributeTemplate):  # type: ignore[misc]
    """What an attribute of a reference is."""

    key = Reference

    def generic_resolve(self, reference: Reference, name: str) -> Any:
        return reference.type_of(name)


@lower_getattr_generic(Reference)  # type: ignore[untyped-decorator]
def _member(context: Any, builder: Any, reference: Reference, value: Any, name: str) -> Any:
    index, kind = reference.target.fields.index(name), reference.type_of(name)
    place = cgutils.gep_inbounds(builder, value, 0, index)
    if kind is not reference.target.types[index]:  # a named tuple that lies there
        return place
    return impl_ret_borrowed(context, builder, kind, builder.load(place))


def _itself(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return arguments[0]


def _refer(typing: Any, value: Any) -> Any:
    if isinstance(value, Reference):
        return value(value), _itself

    def place(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return cgutils.alloca_once_value(builder, arguments[0])

    return Reference(value)(value), place


#: ``by_reference(value)``: a reference to a named tuple that the caller of this helper holds; of a reference,
#: itself.
by_reference: Any = intrinsic(_refer)


def _words(context: Any, kind: Any) -> int:
    return -(-int(context.get_abi_sizeof(context.get_value_type(kind))) // 8)


def _words_of(typing: Any, value: Any) -> Any:
    """Return how many whole numbers a named tuple takes in memory."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return context.get_constant(types.int64, _words(context, value))

    return types.int64(value), code


words_of: Any = intrinsic(prefer_literal=False)(_words_of)


def _address(context: Any, builder: Any, kinds: Any, arguments: Any, target: Any) -> Any:
    """Return where the named tuple number k lies in memory."""
    memory = context.make_array(kinds[0])(context, builder, arguments[0])
    words = context.get_constant(types.int64, _words(context, target))
    at = builder.gep(memory.data, [builder.mul(arguments[1], words)])
    return builder.bitcast(at, context.get_value_type(target).as_pointer())


def _store_at(typing: Any, memory: Any, k: Any, value: Any) -> Any:
    """Store a named tuple as number k in memory of whole numbers; its arrays must live as long."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.store(arguments[2], _address(context, builder, signature.args, arguments, value))
        return context.get_dummy_value()

    return types.void(memory, types.int64, value), code


store_at: Any = intrinsic(prefer_literal=False)(_store_at)


def _reference_at(typing: Any, memory: Any, k: Any, like: Any) -> Any:
    """Return the reference to number k of those that were stored; ``like`` is a reference to one of them."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _address(context, builder, signature.args, arguments, like.target)

    return like(memory, types.int64, like), code


reference_at: Any = intrinsic(prefer_literal=False)(_reference_at)
