"""Linear algebra in one thread: the matrices of an orbit are too small to be shared.

OpenBLAS, which comes with numpy, gives a matrix of some hundred rows to all cores. At this size that gains
little where they are idle. Where they are not, each call waits for the slowest thread, and others spin: on
two cores that eight processes share, a diagram with orbits of four periods took several times the processor
time that it takes in one thread. Results do not depend on the number of cores in their last bits, either.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

#: Held by the block that has set the number of threads.
_limited = threading.Lock()


@contextmanager
def one_thread() -> Iterator[None]:
    """Do linear algebra in one thread; nothing changes where the library is not known.

    The number of threads is one of the process: of several blocks the first sets it, and gives it back.
    """
    if not _limited.acquire(blocking=False):
        yield
        return
    try:
        with libraries().limit(limits=1, user_api="blas"):
            yield
    finally:
        _limited.release()


@cache
def libraries() -> ThreadpoolController:
    """Return the libraries of linear algebra that are loaded, numpy's among them."""
    import numpy.linalg  # noqa: F401
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
