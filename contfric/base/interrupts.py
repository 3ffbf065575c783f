"""Ctrl-C where Python would lose it, or break by it.

Python raises ``KeyboardInterrupt`` wherever it is. In the midst of an import that leaves a package half
loaded, which cannot be imported again before the process ends (scipy's cannot). While a compiler works,
whose callbacks come from C, it is printed and dropped, or leaves memory owned twice: the process dies later.
There it is held back until it can do no harm.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from types import FrameType
from typing import Any


@contextmanager
def held_back() -> Iterator[Callable[[], None]]:
    """Hold Ctrl-C back until the block is done, or calls what it is given.

    Yields
    ------
    callable
        Raises what has come until then; to be called where nothing is half done.

    Examples
    --------
    >>> with held_back():
    ...     from scipy import ndimage
    """
    came: list[tuple[int, FrameType | None]] = []
    before = _exchanged(lambda number, frame: came.append((number, frame)))

    def now() -> None:
        if came and callable(before):
            before(*came.pop())

    try:
        yield now
    finally:
        if before is not None:
            signal.signal(signal.SIGINT, before)
    now()


def _exchanged(handler: Any) -> Any:
    """Set a handler of Ctrl-C and return the one before; None, and nothing is set, where Python has none."""
    if threading.current_thread() is not threading.main_thread():
        return None  # signals are handled in the main thread only
    before = signal.getsignal(signal.SIGINT)
    if not callable(before):  # ignored, or ends the process at once
        return None
    signal.signal(signal.SIGINT, handler)
    return before


@cache
def whole(package: str) -> Any:
    """Return a package, all of which is imported: Ctrl-C waits until it is.

    Examples
    --------
    >>> round(whole("scipy.optimize").brentq(lambda x: x * x - 2.0, 1.0, 2.0), 6)
    1.414214
    """
    with held_back():
        return import_module(package)
