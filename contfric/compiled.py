"""Compiled kernels: numba, cached on disk, with function types fixed beforehand.

Two decorators:

``kernel(signature)``
    an entry point, compiled for one explicit signature and cached on disk;
``helper``
    a small function that is compiled into the kernels that call it, and not cached by itself.

A flow reaches the engine as addresses of functions of the fixed types below (:mod:`contfric.handle`). That is
what lets numba cache the engine: a kernel that takes a jitted function as an ordinary argument would be
compiled anew in every process.

The cache lives in ``$CONTFRIC_CACHE_DIR``, else in ``$NUMBA_CACHE_DIR``, else in the user's cache
folder (``~/.cache/contfric``). Numba renews a cached kernel only when the file of the kernel itself
changes, not when a helper in another file does; so the folder's name carries a digest of all
compiled sources. Each kernel has a folder of its own below that, one for each Python, numba, llvmlite and
processor, with the digests of its files: damaged ones are thrown away, and the kernel is compiled again.
Where no folder is writable the kernels are compiled in every process: slower, never broken.

What is compiled is said at level INFO of the logger ``contfric.compiled``, before and after.
"""

from __future__ import annotations

import atexit
import gc
import hashlib
import logging
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache, cached_property
from pathlib import Path
from time import perf_counter
from typing import Any, TypeVar

import llvmlite
import numba
from llvmlite import binding
from numba import types
from numba.core import config
from numba.core.codegen import get_host_cpu_features
from numba.core.event import Listener, install_listener

from contfric.checked import discard, discard_damaged, list_files
from contfric.errors import ResultFileError
from contfric.inlined import part_options
from contfric.interrupts import held_back
from contfric.resources import user_cache

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
#: reset(k, t, y, p, which, y1, jac): state behind the reset at surface k; ``jac`` (n, 1 + n + len(which))
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

#: How an entry point is compiled, and the files that numba caches it in.
_OPTIONS = {"nogil": True, "error_model": "numpy"}
_CACHED = (".nbi", ".nbc")


class Kernel:
    """A compiled entry point: compiled, or loaded from the cache, when it is first needed.

    It is called from Python without numba's look at the types of its arguments: the look costs about
    60 microseconds a call with the engine's arguments, and there is one signature only. What is
    handed over must have exactly the types of the signature.
    """

    def __init__(self, function: Callable[..., Any], signature: Any, label: str = "") -> None:
        self.__wrapped__ = function
        self.__doc__ = function.__doc__
        self.signature = signature
        #: Added to the name of its folder: one function may be compiled for several signatures.
        self.label = label

    @property
    def name(self) -> str:
        """The name of its folder in the cache."""
        return f"{self.__wrapped__.__module__}.{self.__wrapped__.__name__}{self.label}"

    def cached(self) -> bool:
        """Tell whether it lies in the cache; damaged files are thrown away."""
        try:
            return discard_damaged(self._folder(), _CACHED)
        except OSError:
            return False

    def _folder(self) -> Path:
        target = _target(config.CPU_NAME, config.CPU_FEATURES, config.ENABLE_AVX)
        return cache_folder(Path(self.__wrapped__.__code__.co_filename)) / self.name / target

    @cached_property
    def dispatcher(self) -> Any:
        """The function as numba knows it."""
        function = self.__wrapped__
        aside = _ASIDE.get(f"{function.__module__}:{function.__name__}")
        if aside is not None:
            if aside.poll() is None:
                _log.info("compiling %s, once, in another process", self.name)
            aside.wait()  # another process is compiling it into the cache
        folder = self._folder()
        before = config.CACHE_DIR, config.OPT, config.LOOP_VECTORIZE
        config.CACHE_DIR, config.OPT, config.LOOP_VECTORIZE = str(folder), _OPTIMISATION, _VECTORISE
        # what the compiler makes lives as long as it does: looking for garbage takes a tenth of its time
        collects = gc.isenabled()
        gc.disable()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            return self._from_cache(folder)
        except (OSError, RuntimeError, ResultFileError):  # no folder is writable
            with _announced(f"{self.name}, in every process"):
                return numba.njit(self.signature, **_OPTIONS)(function)
        finally:
            config.CACHE_DIR, config.OPT, config.LOOP_VECTORIZE = before
            if collects:
                gc.enable()

    def _from_cache(self, folder: Path) -> Any:
        """Load the function from its folder, or compile it into that."""
        sound = discard_damaged(folder, _CACHED)
        cached = numba.njit(self.signature, cache=True, **_OPTIONS)
        with _announced(f"{self.name}, once"):
            try:
                found = cached(self.__wrapped__)
            except Exception:  # what unpickling ends in, where the files are of another numba
                if not sound:
                    raise
                discard(folder, _CACHED)
                found = cached(self.__wrapped__)
        if not found.stats.cache_hits:
            list_files(folder, _CACHED)
        return found

    @cached_property
    def _entry(self) -> Callable[..., Any]:
        (result,) = self.dispatcher.overloads.values()
        return result.entry_point  # type: ignore[no-any-return]

    @cached_property
    def address(self) -> int:
        """Where the machine code lies: what other compiled code calls."""
        (result,) = self.dispatcher.overloads.values()
        return int(result.library.get_pointer_to_function(result.fndesc.llvm_cfunc_wrapper_name))

    def __call__(self, *arguments: Any) -> Any:
        """Call the compiled code."""
        return self._entry(*arguments)


@contextmanager
def _announced(what: str) -> Iterator[None]:
    """Log what the block compiles, and its time; nothing where it is loaded from the cache."""
    with held_back() as raise_now:
        passes = _BetweenPasses(raise_now, what)
        with install_listener("numba:run_pass", passes):
            try:
                yield
            finally:
                passes.log_end()


class _BetweenPasses(Listener):  # type: ignore[misc]
    """Lets Ctrl-C through between the passes of numba's compiler, where nothing is half done.

    The first pass is the sign that something is compiled and not loaded.
    """

    def __init__(self, raise_now: Callable[[], None], what: str) -> None:
        self._raise_now = raise_now
        self._what = what
        self._began: float | None = None

    def on_start(self, event: Any) -> None:
        """Raise what has come; say what is compiled."""
        self._raise_now()
        if self._began is None:
            self._began = perf_counter()
            _log.info("compiling %s", self._what)

    def log_end(self) -> None:
        """Say how long it took."""
        if self._began is not None:
            took = perf_counter() - self._began
            _log.info("compiled %s: %.1f s", self._what, took, extra={"seconds": took})

    def on_end(self, event: Any) -> None:
        """Let the pass end."""


#: Processes that compile a kernel into the cache, by its name "module:kernel".
_ASIDE: dict[str, subprocess.Popen[bytes]] = {}


def compile_aside(kernels: Sequence[str]) -> None:
    """Compile kernels in a second process, if nothing is cached yet; who needs one waits for it.

    Parameters
    ----------
    kernels : names "module:kernel"
    """
    folder = cache_folder(Path(__file__))
    cold = not _ASIDE and not folder.exists()
    if not cold or (os.cpu_count() or 1) < 2 or not sys.executable:
        return
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
    except OSError:  # nothing can be cached: what another process compiles would be lost
        return
    if not os.access(folder.parent, os.W_OK):
        return
    # the same path as here: what lies in the working folder is not imported by accident
    code = f"import sys; sys.path[:] = {sys.path!r}\n" + "".join(
        f"from {module} import {name}; {name}.dispatcher\n"
        for module, name in (kernel.split(":") for kernel in kernels)
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
    _ASIDE.update(dict.fromkeys(kernels, process))
    atexit.register(_end, process)


def _end(process: subprocess.Popen[bytes]) -> None:
    """Do not leave a process behind that nobody waits for any more."""
    if process.poll() is None:
        process.terminate()
    process.wait()


#: LLVM's level, and vectorised loops or not: loops are over 3 to 10 numbers here, so that more of
#: either does not run faster (measured: within 2 percent) and takes up to a quarter longer to compile.
_OPTIMISATION, _VECTORISE = type(config.OPT)(1), 0


@cache
def _digest(folder: Path) -> str:
    """Digest of the compiled sources that a kernel in ``folder`` may have been built from."""
    root = Path(__file__).parent
    # a kernel may use any helper of the package, and those of its own folder
    files = sorted(root.rglob("*.py"))
    if folder != root and root not in folder.parents:
        files += sorted(folder.glob("*.py"))
    content = hashlib.sha256()
    for file in files:
        text = file.read_bytes()
        if b"contfric.compiled" in text:
            content.update(text)
    return content.hexdigest()[:16]


def processor() -> str:
    """Return the name of the processor that code is compiled for: this one's, or what numba was told."""
    return str(config.CPU_NAME or binding.get_host_cpu_name())


@cache
def _target(*_told: object) -> str:
    """Digest of what machine code depends on beside its sources; ``_told`` is what numba was told of it."""
    facts = (
        sys.implementation.cache_tag,
        numba.__version__,
        llvmlite.__version__,
        binding.get_process_triple(),
        processor(),
        config.CPU_FEATURES or get_host_cpu_features(),
    )
    return hashlib.sha256(repr(facts).encode()).hexdigest()[:16]


def cache_folder(source: Path) -> Path:
    """Return the folder that the kernels of a source file are cached in."""
    return user_cache() / _digest(source.parent)


def kernel(signature: Any) -> Callable[[Callable[..., Any]], Kernel]:
    """Compile a function for one explicit signature, with a cache on disk where possible."""
    return lambda function: Kernel(function, signature)


#: A helper is never called from Python or C: its wrappers would take a quarter of the time to compile.
_INSIDE = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, **part_options()}


def helper(function: F) -> F:
    """Compile a small function into the kernels that call it; it must not allocate.

    Without numba's counts of references, which cost two atomic operations for each array that is
    looked up in a tuple: half of the engine's time. It cannot be called from Python.
    """
    return numba.njit(error_model="numpy", nogil=True, _nrt=False, **_INSIDE)(function)  # type: ignore[no-any-return]


def inlined_helper(function: F) -> F:
    """Compile a helper so that it is always inlined: for one that is called once, or has little to do.

    A call hands each array over as seven to nine numbers, which may cost more than what is done with them.
    """
    return numba.njit(  # type: ignore[no-any-return]
        error_model="numpy", nogil=True, _nrt=False, forceinline=True, **_INSIDE
    )(function)


def allocating_helper(function: F) -> F:
    """Compile a function that allocates into the kernels that call it.

    (What numba counts references with is asked for: a helper that calls it would hand on that it has none.)
    """
    return numba.njit(error_model="numpy", nogil=True, _nrt=True, **_INSIDE)(function)  # type: ignore[no-any-return]
