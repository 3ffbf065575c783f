"""Calls of compiled functions by their addresses: an array goes as its data and its shape.

Numba hands an array over as seven words or more (who owns it, its size, strides). After an address there is
a wrapper, which gets all of them on the stack and copies them there once more for the function: 40 words
for the level of a surface, in pairs that the processor cannot forward from the stores before. That took
twice as long as the short functions of a model themselves. All arrays here are contiguous numbers that the
caller holds. So the *entry* of a function takes the address of the first number and the lengths, in
registers where they fit; the rest follows from them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.extending import models, register_model
from numba.core.imputils import lower_builtin
from numba.core.lowering import Lower
from numba.core.registry import cpu_target
from numba.core.typed_passes import NativeLowering
from numba.core.typing import Signature, signature

_WORD = ir.IntType(64)


def entry_type(typed: Signature) -> Any:
    """Return LLVM's type of the entry of a function."""
    kinds: list[Any] = []
    value_type = cpu_target.target_context.get_value_type
    for kind in typed.args:
        if isinstance(kind, types.Array):
            kinds += [value_type(kind.dtype).as_pointer(), *[_WORD] * kind.ndim]
        else:
            kinds.append(value_type(kind))
    return ir.FunctionType(value_type(typed.return_type), kinds)


def as_entry_takes(context: Any, builder: Any, kinds: Sequence[Any], values: Sequence[Any]) -> Any:
    """Return arguments as an entry takes them."""
    found: list[Any] = []
    for kind, value in zip(kinds, values, strict=True):
        if isinstance(kind, types.Array):
            array = context.make_array(kind)(context, builder, value)
            found += [array.data, *cgutils.unpack_tuple(builder, array.shape)]
        else:
            found.append(value)
    return found


def as_function_takes(
    context: Any, builder: Any, kinds: Sequence[Any], values: Sequence[Any]
) -> Any:
    """Return the arguments of an entry as its function takes them."""
    found, given = [], iter(values)
    for kind in kinds:
        if not isinstance(kind, types.Array):
            found.append(next(given))
            continue
        data, shape = next(given), [next(given) for _ in range(kind.ndim)]
        each = ir.Constant(_WORD, context.get_abi_sizeof(context.get_data_type(kind.dtype)))
        steps, size = [], each
        for length in reversed(shape):
            steps.append(size)
            size = builder.mul(size, length)
        array = context.make_array(kind)(context, builder)
        none = context.get_constant_null(types.MemInfoPointer(types.voidptr))
        context.populate_array(
            array,
            data=data,
            shape=shape,
            strides=steps[::-1],
            itemsize=each,
            meminfo=none,
        )
        found.append(array._getvalue())
    return found


class Code(types.Callable):  # type: ignore[misc]
    """Numba's type of the address of an entry.

    Parameters
    ----------
    typed : signature of its function
    """

    def __init__(self, typed: Signature) -> None:
        self.typed = typed
        super().__init__(f"Code({typed})")

    def get_call_type(self, context: Any, args: Any, kws: Any) -> Any:
        """Return the signature; the address is an argument of its own."""
        return signature(self.typed.return_type, *self.typed.args, recvr=self)

    def get_call_signatures(self) -> Any:
        """Return the one that there is."""
        return [self.typed], False

    def get_impl_key(self, sig: Any) -> Any:
        """Return what the call below stands under."""
        return type(self)


@register_model(Code)
class _CodeModel(models.PrimitiveModel):  # type: ignore[misc]
    """An address."""

    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, entry_type(fe_type.typed).as_pointer())


@lower_builtin(Code, Code, types.VarArg(types.Any))  # type: ignore[untyped-decorator]
def _call(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    code, *values = args
    return builder.call(code, as_entry_takes(context, builder, sig.args[1:], values))


class _LowerWithEntry(Lower):  # type: ignore[misc]
    """Writes the entry in the place of numba's wrapper for C; kernels raise nothing that it would hand on."""

    def create_cfunc_wrapper(self) -> None:
        """Write it."""
        context, made = self.context, self.fndesc
        kinds = made.argtypes
        module = context.create_module("entry")
        inner = ir.Function(
            module, context.call_conv.get_function_type(made.restype, kinds), made.llvm_func_name
        )
        entry = ir.Function(
            module, entry_type(signature(made.restype, *kinds)), made.llvm_cfunc_wrapper_name
        )
        builder = ir.IRBuilder(entry.append_basic_block())
        values = as_function_takes(context, builder, kinds, entry.args)
        _, result = context.call_conv.call_function(builder, inner, made.restype, kinds, values)
        builder.ret(result)
        self.library.add_ir_module(module)


@register_pass(mutates_CFG=True, analysis_only=False)
class _WithEntry(NativeLowering):  # type: ignore[misc]
    """Numba's lowering, with the entry."""

    _name = "contfric_with_entry"

    @property
    def lowering_class(self) -> Any:
        """What writes the function."""
        return _LowerWithEntry


class KernelCompiler(CompilerBase):  # type: ignore[misc]
    """Numba's pipeline for kernels."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.passes = [
            (_WithEntry if each is NativeLowering else each, what) for each, what in passes.passes
        ]
        passes.finalize()
        return [passes]
