"""A block of memory known by its address: functions, tables and numbers, handed over as one integer.

Integrators, searches of roots and the closed form of affine modes are compiled once, for all models; a
model's own are its formulas, a few short functions. A *handle* is the address of a block with their
addresses; ``motion.field(...)`` in compiled code loads the address of the field and calls it. In the same
way the engine gets the functions of a flow. What a block has is its *layout*, which is part of the
handle's type; so may be helpers and numbers that are known when a kernel is compiled.

A kernel whose first argument is a handle becomes one without it by *binding*: a few machine instructions
that put the address before the other arguments (:class:`Bound`), made without numba's compiler.

Python hands an address over like any integer. Each of numba's own first-class functions is looked up in
Python at every call, and an interrupt that comes just then is lost.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.compiler_lock import global_compiler_lock
from numba.core.extending import NativeValue, infer_getattr, models, register_model, unbox
from numba.core.imputils import lower_getattr_generic
from numba.core.registry import cpu_target
from numba.core.typing import Signature
from numba.core.typing.templates import AttributeTemplate

from contfric.compiled import Kernel, f8, i8
from contfric.compiling.calls import Code, entry_type

#: What a block may hold: a function (its signature), whole numbers, numbers, a number, or the address of
#: another block of the same layout.
TABLE, WEIGHTS, ITSELF = types.CPointer(types.int64), types.CPointer(types.float64), "itself"
_ARRAYS = (TABLE, WEIGHTS)
Layout = Mapping[str, Any]


#: All types of handles by their names.
_KNOWN: dict[str, HandleType] = {}


class HandleType(types.Type):  # type: ignore[misc]
    """Numba's type of a handle.

    Parameters
    ----------
    name : the same in every process, as it is part of the names of compiled code
    layout : what each member of the block is, in their order
    members : helpers and whole numbers that are no part of the block, but of the type
    """

    def __init__(self, name: str, layout: Layout, members: Mapping[str, Any] | None = None) -> None:
        self.layout, self.members = layout, members or {}
        self.places = {member: k for k, member in enumerate(layout)}
        super().__init__(f"Handle({name})")
        _KNOWN[self.name] = self

    def __reduce__(self) -> tuple[Any, ...]:
        """Refer to the name: cached code must not carry the helpers, of which it is made."""
        return _known, (self.name,)

    def type_of(self, name: str) -> Any:
        """Return the type of a member, None where no member has that name."""
        member = self.members.get(name)
        if member is not None:
            return types.int64 if isinstance(member, int) else member._numba_type_
        kind = self.layout.get(name)
        if isinstance(kind, Signature):
            return Code(kind)
        return self if kind is ITSELF else kind


def _known(name: str) -> HandleType:
    return _KNOWN[name]


@register_model(HandleType)
class _HandleModel(models.PrimitiveModel):  # type: ignore[misc]
    """An address."""

    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, ir.IntType(64))


@unbox(HandleType)  # type: ignore[untyped-decorator]
def _unboxed(typ: Any, value: Any, c: Any) -> NativeValue:
    return NativeValue(c.pyapi.long_as_longlong(value))


@infer_getattr
class _HandleMembers(AttributeTemplate):  # type: ignore[misc]
    """What an attribute of a handle is."""

    key = HandleType

    def generic_resolve(self, handle: HandleType, name: str) -> Any:
        return handle.type_of(name)


@lower_getattr_generic(HandleType)  # type: ignore[untyped-decorator]
def _member(context: Any, builder: Any, handle: HandleType, value: Any, name: str) -> Any:
    member = handle.members.get(name)
    if member is not None:
        number = isinstance(member, int)
        return context.get_constant(i8, member) if number else context.get_dummy_value()
    kind = context.get_value_type(handle.type_of(name))
    place = builder.add(value, ir.Constant(value.type, 8 * handle.places[name]))
    return builder.load(builder.inttoptr(place, kind.as_pointer()))


def with_handle(signature: Any, handle: HandleType) -> Any:
    """Return a signature with a handle before the other arguments."""
    return signature.return_type(handle, *signature.args)


class Block:
    """The memory after a handle; what it points to lives as long as it does.

    Parameters
    ----------
    layout : of its handle's type
    values : kernels, tables, numbers and blocks by their names; a function that is not given must not be
        called, and a number that is not given is 0
    """

    def __init__(self, layout: Layout, values: Mapping[str, Any]) -> None:
        self._layout = layout
        self._values = self._arrays(values)
        self._memory = np.zeros(len(layout), dtype=np.int64)

    def renew(self, values: Mapping[str, Any]) -> None:
        """Put other tables and numbers in the place of some; the address stays. No kernel may be running."""
        self._values |= self._arrays(values)
        if "address" in self.__dict__:
            self._write()

    def _arrays(self, values: Mapping[str, Any]) -> dict[str, Any]:
        kinds, layout = {TABLE: np.int64, WEIGHTS: np.float64}, self._layout
        return {
            name: np.asarray(value, dtype=kinds[layout[name]]) if layout[name] in kinds else value
            for name, value in values.items()
        }

    @cached_property
    def address(self) -> int:
        """Where it lies; its functions are compiled, or loaded, when that is first asked for."""
        self._write()
        return int(self._memory.ctypes.data)

    def _write(self) -> None:
        for k, (name, kind) in enumerate(self._layout.items()):
            value = self._values.get(name)
            if value is None:
                continue
            if kind is f8:
                self._memory.view(np.float64)[k] = value
            elif kind is i8:
                self._memory[k] = value
            else:
                self._memory[k] = value.ctypes.data if kind in _ARRAYS else value.address


class Bound:
    """A kernel with the handle of a model put before its other arguments.

    Parameters
    ----------
    kernel : its first argument is a handle
    block : of the model
    """

    def __init__(self, kernel: Kernel, block: Block) -> None:
        self._kernel, self._block = kernel, block
        self.signature = kernel.signature.return_type(*kernel.signature.args[1:])

    def __call__(self, *arguments: Any) -> Any:
        """Call the compiled code."""
        return self._kernel(self._block.address, *arguments)

    @property
    def address(self) -> int:
        """Where the machine code lies."""
        return self._code[0]

    @cached_property
    def _code(self) -> tuple[int, Any]:
        """The address of the machine code, and what keeps it alive."""
        context = cpu_target.target_context
        inner, outer = (entry_type(s) for s in (self._kernel.signature, self.signature))
        name = f"contfric_bound_{id(self)}"
        library = context.codegen().create_library(name)
        module = library.create_ir_module(name)
        function = ir.Function(module, outer, name)
        builder = ir.IRBuilder(function.append_basic_block())
        itinerary = ir.IntType(64)
        code = builder.inttoptr(ir.Constant(itinerary, self._kernel.address), inner.as_pointer())
        handle = ir.Constant(itinerary, self._block.address)
        builder.ret(builder.call(code, [handle, *function.args]))
        with global_compiler_lock:
            library.add_ir_module(module)
            library.finalize()
            return int(library.get_pointer_to_function(name)), library
