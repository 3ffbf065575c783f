"""Linear algebra in one thread: the matrices of an orbit are too small to be shared.

OpenBLAS, which comes with numpy, gives a matrix of some hundred rows to all cores. At this size that gains
little where they are idle. Where they are not, each call waits for the slowest thread, and others spin: on
two cores that eight processes share, a diagram with orbits of four periods took several times the processor
time that it takes in one thread. Results do not depend on the number of cores in their last bits, either.
"""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy as np

#: What the function is called that returns, or sets, the number of threads; wheels of numpy have the first.
_NAMES = (
    "scipy_openblas_{}_num_threads64_",
    "scipy_openblas_{}_num_threads",
    "openblas_{}_num_threads64_",
    "openblas_{}_num_threads",
)
#: Where wheels keep their libraries, next to the package and in it.
_FOLDERS = ("../numpy.libs", ".dylibs", ".libs")

_lock = threading.Lock()
_depth = 0
_before = 1


@contextmanager
def one_thread() -> Iterator[None]:
    """Do linear algebra in one thread; nothing changes where the library is not known.

    The number of threads is one of the process: it is given back when the last of several, of any threads,
    is done.
    """
    global _depth, _before  # noqa: PLW0603
    control = _control()
    if control is None:
        yield
        return
    ask, tell = control
    with _lock:
        if _depth == 0:
            _before = ask()
            tell(1)
        _depth += 1
    try:
        yield
    finally:
        with _lock:
            _depth -= 1
            if _depth == 0:
                tell(_before)


@cache
def _control() -> tuple[Callable[[], int], Callable[[int], None]] | None:
    """Return the functions of numpy's OpenBLAS that return and set its number of threads."""
    package = Path(np.__file__).parent
    for path in (p for folder in _FOLDERS for p in sorted((package / folder).glob("*openblas*"))):
        try:
            library = ctypes.CDLL(str(path))  # it is loaded already
        except OSError:
            continue
        for name in _NAMES:
            ask = getattr(library, name.format("get"), None)
            tell = getattr(library, name.format("set"), None)
            if ask is not None and tell is not None:
                return ask, tell
    return None
