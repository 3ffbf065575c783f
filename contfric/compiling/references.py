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
        """Return the type of a member, None if there is none of that name."""
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
    place = cgutils.gep_inbounds(builder, value, 0, reference.target.fields.index(name))
    kind = reference.type_of(name)
    if isinstance(kind, Reference):
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
