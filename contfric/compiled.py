"""Compiled kernels: numba, cached on disk, with function types fixed beforehand.

Two decorators:

``kernel(signature)``
    an entry point, compiled for one explicit signature and cached on disk;
``helper``
    a small function that is compiled into the kernels that call it, and not cached by itself.

A flow reaches the engine as addresses of functions of the fixed types below (:mod:`contfric.handle`). That is
what lets numba cache the engine: a kernel that takes a jitted function as an ordinary argument would be
compiled anew in every process.

Code comes with the wheel (``_data/kernels``), where the wheel was built with it and it fits; else it is
compiled into the cache: ``$CONTFRIC_CACHE_DIR``, else ``$NUMBA_CACHE_DIR``, else the user's cache folder
(``~/.cache/contfric``). Both have the same folders: one for a digest of all compiled sources, as a kernel
changes with its helpers in other files; below it one for each kernel, with a file for each Python, numba,
llvmlite and processor (:mod:`contfric.compiling.kept`). A damaged file is not used: the kernel is made again.
Where no folder is writable the kernels are compiled in every process: slower, never broken.

What is compiled is said at level INFO of the logger ``contfric.compiled``, before and after.
"""

from __future__ import annotations

import atexit
import gc
import logging
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba import types
from numba.core import config

from contfric.base.resources import SHIPPED_KERNELS, user_cache
from contfric.base.sources import kernels_digest, kernels_folder
from contfric.compiling.announced import announced, time_of
from contfric.compiling.calls import KernelCompiler
from contfric.compiling.helpers import Helper
from contfric.compiling.inlined import part_options
from contfric.compiling.kept import KernelFiles, file_name, writable
from contfric.compiling.targets import shipped_target, target

_log = logging.getLogger(__name__)

F = TypeVar("F", bound=Callable[..., Any])

f8 = types.float64
i8 = types.int64
vector = types.float64[::1]
matrix = types.float64[:, ::1]
blocks = types.float64[:, :, ::1]
indices = types.int64[::1]
table = types.int64[:, ::1]

#: flow(mode, t0, y0, dt, p, which, y1, jac): state after ``dt``; ``jac`` (n, 2 + n + len(which)) holds
#: the derivatives with respect to t0, y0, dt and the parameters ``which``; not filled if it is empty.
flow_signature = types.void(i8, f8, vector, f8, vector, indices, vector, matrix)
#: observe(c, t, y, p, which, grad): observable c; ``grad`` (1 + n + len(which)), not filled if empty.
observe_signature = f8(i8, f8, vector, vector, indices, vector)
#: level(k, p, which, grad): level of surface k; ``grad`` (len(which)), not filled if empty.
level_signature = f8(i8, vector, indices, vector)
#: stationary(mode, c, t0, y0, dt, p, times, values): number of interior stationary points of observable
#: c; their times after the start, ascending, and its values there are written; -1 if they do not fit.
stationary_signature = i8(i8, i8, f8, vector, f8, vector, vector, vector)
#: hit(mode, c, level, on, t0, y0, dt_max, p, y1): the first time after the start at which observable c
#: takes the level (``on``: it starts there), and the state there; negative if not within ``dt_max``.
hit_signature = f8(i8, i8, f8, types.boolean, f8, vector, f8, vector, vector)
#: period(p, which, grad): period of the excitation; 0 for an autonomous model.
period_signature = f8(vector, indices, vector)
#: rate(mode, c, t, y, p, which, grad): rate of observable c along a mode; ``grad`` (1 + n + len(which))
#: holds its derivatives with respect to t, y and the parameters ``which``; not filled if empty.
rate_signature = f8(i8, i8, f8, vector, vector, indices, vector)
#: reset(k, t, y, p, which, y1, jac): state after the reset at surface k; ``jac`` (n, 1 + n + len(which))
#: holds its derivatives with respect to t, y and the parameters ``which``; not filled if it is empty.
reset_signature = types.void(i8, f8, vector, vector, indices, vector, matrix)
#: field(mode, t, y, p, which, out, jac): dy/dt along a mode; ``jac`` as that of reset.
field_signature = reset_signature
#: scale(i, p): natural size of state i.
scale_signature = f8(i8, vector)
#: second(mode, c, t, y, dt, p, which, direction, jac, workspace): derivative of flow's ``jac`` in a direction
#: (1 + n + 1) of (t0, y0, dt); with c >= 0 that of observable c's gradient in a direction of (t, y), in
#: the first row of ``jac``. ``workspace`` holds 8 + n numbers. 0 where a flow has none.
second_signature = i8(i8, i8, f8, vector, f8, vector, indices, vector, matrix, vector)

#: together(count, modes, on, times, states, p, longest, tau, surfaces, ends, jac): for many motions, each in
#: a row, the first surface that is met within ``longest`` (``on``: those that it starts on, as bits), the
#: time until then, the state there, and the derivatives of the flow; -2 as the surface where that is not
#: decided, and is to be asked for motion by motion. A mode below 0 is no motion.
together_signature = types.void(
    i8, indices, indices, vector, matrix, matrix, vector, vector, indices, matrix, blocks
)

#: How an entry point is compiled.
_OPTIONS = {"nogil": True, "error_model": "numpy", "pipeline_class": KernelCompiler}


class Kernel:
    """A compiled entry point: compiled, or loaded from the cache, when it is first needed.

    It is called from Python without numba's look at the types of its arguments: the look costs about
    60 microseconds a call with the engine's arguments, and there is one signature only. What is
    handed over must have exactly the types of the signature. Python finds the compiled function itself
    in the slot of the instance: a method would be a frame of its own for each call.
    """

    __slots__ = ("__call__", "__dict__", "__weakref__")
    __call__: Callable[..., Any]

    def __init__(
        self,
        function: Callable[..., Any],
        signature: Any,
        label: str = "",
        counts: bool = True,
        vectors: bool = False,
    ) -> None:
        self.__wrapped__ = function
        self.__doc__ = function.__doc__
        self.signature = signature
        self._options = _OPTIONS if counts else {**_OPTIONS, "_nrt": False}
        self._optimisation = _VECTORS if vectors else OPTIMISATION
        #: Added to the name of its folder: one function may be compiled for several signatures.
        self.label = label
        self.__call__ = self._first_call

    @property
    def name(self) -> str:
        """The name of its folder in the cache."""
        return f"{self.__wrapped__.__module__}.{self.__wrapped__.__name__}{self.label}"

    def kept(self) -> Path | None:
        """Return the file that its code is loaded from, None if it has to be compiled."""
        return self._files().found()

    def _files(self) -> KernelFiles:
        """Where its code is looked for: with the package, then in the cache."""
        function, shipped = self.__wrapped__, shipped_target()
        digest = kernels_digest(Path(function.__code__.co_filename).parent)
        own = user_cache() / digest / self.name / file_name(function, self.signature, target())
        if shipped is None:
            return KernelFiles([own])
        name = file_name(function, self.signature, shipped)
        return KernelFiles([SHIPPED_KERNELS / digest / self.name / name, own])

    @cached_property
    def dispatcher(self) -> Any:
        """The function as numba knows it."""
        function = self.__wrapped__
        aside = _ASIDE.get(f"{function.__module__}:{function.__name__}")
        if aside is not None:
            if aside.poll() is None:
                _log.info(
                    "compiling %s, once, in another process: %s", self.name, time_of(self.name)
                )
            aside.wait()  # another process is compiling it into the cache
        found = numba.njit(**self._options)(function)
        found._cache = self._files()
        before = config.OPT, config.LOOP_VECTORIZE
        config.OPT, config.LOOP_VECTORIZE = self._optimisation
        # what the compiler makes lives as long as it does: looking for garbage takes a tenth of its time
        collects = gc.isenabled()
        gc.disable()
        try:
            with announced(self.name, Path(found._cache.cache_path), _log):
                found.compile(self.signature)
            found.disable_compile()
        finally:
            config.OPT, config.LOOP_VECTORIZE = before
            if collects:
                gc.enable()
        return found

    @cached_property
    def entry(self) -> Callable[..., Any]:
        """What Python calls."""
        (result,) = self.dispatcher.overloads.values()
        return result.entry_point  # type: ignore[no-any-return]

    @cached_property
    def address(self) -> int:
        """Where the machine code lies: what other compiled code calls."""
        (result,) = self.dispatcher.overloads.values()
        return int(result.library.get_pointer_to_function(result.fndesc.llvm_cfunc_wrapper_name))

    def _first_call(self, *arguments: Any) -> Any:
        """Call the compiled code, from now on without a detour."""
        self.__call__ = entry = self.entry
        return entry(*arguments)


#: Processes that compile a kernel into the cache, by its name "module:kernel".
_ASIDE: dict[str, subprocess.Popen[bytes]] = {}


def compile_aside(kernels: Sequence[str]) -> None:
    """Compile kernels in a second process, those that have to be; who needs one waits for it.

    Parameters
    ----------
    kernels : names "module:kernel"
    """
    if _ASIDE or (os.cpu_count() or 1) < 2 or not sys.executable:
        return
    named = [kernel.split(":") for kernel in kernels]
    absent = [[m, name] for m, name in named if getattr(import_module(m), name).kept() is None]
    if not absent or not writable(kernels_folder()):  # what another process compiles would be lost
        return
    # the same path as here: what lies in the working folder is not imported by accident
    code = f"import sys; sys.path[:] = {sys.path!r}\n" + "".join(
        f"from {module} import {name}; {name}.dispatcher\n" for module, name in absent
    )
    silent = {
        "stdin": subprocess.DEVNULL,
        "stdout": subprocess.DEVNULL,
        "stderr": subprocess.DEVNULL,
    }
    try:
        process = subprocess.Popen([sys.executable, "-c", code], **silent)  # type: ignore[call-overload]
    except OSError:  # no process to be had: they are compiled here, one after the other
        return
    _ASIDE.update(dict.fromkeys(map(":".join, absent), process))
    atexit.register(_end, process)


def _end(process: subprocess.Popen[bytes]) -> None:
    """Do not leave a process after that nobody waits for any more."""
    if process.poll() is None:
        process.terminate()
    process.wait()


#: LLVM's level, and vectorised loops or not: loops are over 3 to 10 numbers here, so that more of
#: either does not run faster (measured: within 2 percent) and takes up to a quarter longer to compile.
OPTIMISATION = type(config.OPT)(1), 0
#: The same for a kernel that loops over many states.
_VECTORS = type(config.OPT)(3), 1


def kernel(signature: Any, counts: bool = True) -> Callable[[Callable[..., Any]], Kernel]:
    """Compile a function for one explicit signature, with a cache on disk where possible.

    Parameters
    ----------
    counts : whether it counts references: one that does not allocate itself can do without
    """
    return lambda function: Kernel(function, signature, counts=counts)


#: A helper is never called from Python or C: its wrappers would take a quarter of the time to compile.
_INSIDE = {
    **{"error_model": "numpy", "nogil": True, "no_cpython_wrapper": True},
    **{"no_cfunc_wrapper": True, **part_options()},
}


def helper(function: F) -> F:
    """Compile a small function into the kernels that call it; it must not allocate.

    Without numba's counts of references, which cost two atomic operations for each array that is
    looked up in a tuple: half of the engine's time. It cannot be called from Python.
    """
    return cast(F, Helper(function, {**_INSIDE, "_nrt": False}))


def inlined_helper(function: F) -> F:
    """Compile a helper so that it is always inlined: for one that is called once, or has little to do.

    A call hands each array over as seven to nine numbers, which may cost more than what is done with them.
    """
    return cast(F, Helper(function, {**_INSIDE, "_nrt": False, "forceinline": True}))


def allocating_helper(function: F) -> F:
    """Compile a function that allocates into the kernels that call it.

    (What numba counts references with is asked for: a helper that calls it would hand on that it has none.)
    """
    return cast(F, Helper(function, {**_INSIDE, "_nrt": True}))
