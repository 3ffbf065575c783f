"""The functions of one generated module: compiled together, kept in one file, called by their addresses.

They are translated without numba's compiler (:mod:`contfric.models.generated.native`), all of a model in the
time that it takes for one or two of them. The file lies where those of kernels do
(:mod:`contfric.compiled`), and fits what they fit.
"""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable
from contextlib import suppress
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np
from llvmlite import binding
from numba import types
from numba.core import config
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target

from contfric.base.checked import read_checked, read_sealed, write_checked
from contfric.base.interrupts import held_back
from contfric.base.resources import SHIPPED_KERNELS, user_cache
from contfric.base.sources import kernels_digest
from contfric.compiled import (
    OPTIMISATION,
    F,
    Kernel,
    field_signature,
    level_signature,
    observe_signature,
    period_signature,
    rate_signature,
    scale_signature,
)
from contfric.compiling.announced import timed
from contfric.compiling.kept import SUFFIX
from contfric.compiling.targets import Target, shipped_target, target
from contfric.errors import ResultFileError
from contfric.handle import Block, HandleType
from contfric.models.generated.native import Function, translated

_log = logging.getLogger("contfric.compiled")
#: What is loaded stays: a second copy of the same names would lie next to it.
_LOADED: dict[str, Any] = {}


def _called(handle, arguments):  # type: ignore[no-untyped-def]
    return handle.code(*arguments)


@cache
def caller(signature: Any) -> Kernel:
    """Return the kernel by which Python calls functions of a signature; compiled once for all of them."""
    layout = {"code": signature}
    handle = HandleType(f"code of {signature}", layout)
    name = hashlib.sha256(str(signature).encode()).hexdigest()[:8]
    takes = signature.return_type(handle, types.Tuple(signature.args))
    return Kernel(_called, takes, label=f"-{name}")


def callers() -> list[Kernel]:
    """Return the kernels by which Python calls the functions of models."""
    called = (field_signature, level_signature, observe_signature)
    return [caller(s) for s in (*called, period_signature, rate_signature, scale_signature)]


class Formula(Kernel):
    """A function of a generated module, as the engine and Python take it.

    Parameters
    ----------
    function, signature : as written, and its type
    unit : that it is compiled with
    """

    def __init__(self, function: Callable[..., Any], signature: Any, unit: GeneratedUnit) -> None:
        super().__init__(function, signature)
        self._unit = unit

    @cached_property
    def address(self) -> int:
        """Where the machine code lies."""
        return self._unit.address_of(self.__wrapped__.__name__)

    @cached_property
    def _called(self) -> tuple[Callable[..., Any], Block]:
        return caller(self.signature).entry, Block({"code": self.signature}, {"code": self})

    def __call__(self, *arguments: Any) -> Any:
        """Call the compiled code."""
        enter, block = self._called
        return enter(block.address, arguments)


class GeneratedUnit(Kernel):
    """The functions of a generated module.

    Parameters
    ----------
    module, file : name and path of the module

    Attributes
    ----------
    tables : vectors of numbers that the functions refer to by name
    """

    def __init__(self, module: str, file: str) -> None:
        self._module, self._file = module, Path(file)
        self._functions: list[Function] = []
        self.tables: dict[str, np.ndarray] = {}

    def kernel(self, signature: Any) -> Callable[[Callable[..., Any]], Formula]:
        """Decorate a function that the engine, or Python, calls."""

        def made(function: Callable[..., Any]) -> Formula:
            name = function.__name__
            self._functions.append(Function(name, signature, f"{self._module}.{name}"))
            return Formula(function, signature, self)

        return made

    def helper(self, signature: Any) -> Callable[[F], F]:
        """Decorate a function that only others of the module call."""

        def made(function: F) -> F:
            self._functions.append(Function(function.__name__, signature))
            return function

        return made

    @property
    def name(self) -> str:
        """The name of its folder in the cache."""
        return f"{self._module}.functions"

    def kept(self) -> Path | None:
        """Return the file that the code is loaded from, None if it has to be compiled."""
        for file in self._paths():
            with suppress(OSError, ResultFileError):
                read_checked(file)
                return file
        return None

    def _paths(self) -> list[Path]:
        """Where the code is looked for: with the package, then in the cache."""
        digest, shipped = kernels_digest(self._file.parent), shipped_target()
        found = [user_cache() / digest / self.name / _file_name(target())]
        if shipped is not None:
            found.insert(0, SHIPPED_KERNELS / digest / self.name / _file_name(shipped))
        return found

    def address_of(self, function: str) -> int:
        """Return where the machine code of a function lies."""
        return int(self.dispatcher.get_pointer_to_function(f"{self._module}.{function}"))

    @cached_property
    def dispatcher(self) -> Any:
        """The library that numba's code generator made, or made anew from what is kept."""
        key = f"{self.name} {target().digest}"
        with held_back(), global_compiler_lock:
            if key not in _LOADED:
                _LOADED[key] = self._loaded() or self._compiled()
        return _LOADED[key]

    def _loaded(self) -> Any:
        symbols = [f.symbol for f in self._functions if f.symbol]
        stub = "\n".join(f'define void @"{symbol}"() {{ ret void }}' for symbol in symbols)
        for file in self._paths():
            with suppress(OSError, ResultFileError):
                parts = read_checked(file), binding.parse_assembly(stub).as_bitcode()
                codegen = cpu_target.target_context.codegen()
                return codegen.unserialize_library((self.name, "object", parts))
        return None

    def _compiled(self) -> Any:
        file = self._paths()[-1]
        library = cpu_target.target_context.codegen().create_library(self.name)
        before = config.OPT, config.LOOP_VECTORIZE
        config.OPT, config.LOOP_VECTORIZE = OPTIMISATION
        try:
            with timed(self.name, file.parent, _log):
                module = library.create_ir_module(self.name)
                translated(module, read_sealed(self._file), self._functions, self.tables)
                library.enable_object_caching()
                library.add_ir_module(module)
                library.finalize()
        finally:
            config.OPT, config.LOOP_VECTORIZE = before
        with suppress(OSError, ResultFileError):  # compiled in every process, then
            file.parent.mkdir(parents=True, exist_ok=True)
            write_checked(file, library._get_compiled_object())
        return library


def _file_name(made_for: Target) -> str:
    return made_for.digest + SUFFIX
