"""Ctrl-C where Python would lose it, or break by it.

Python raises ``KeyboardInterrupt`` wherever it is. In the midst of an import that leaves a package half
loaded, which cannot be imported again before the process ends (scipy's cannot). Within a callback of C code,
of which the compiler has some while it loads a kernel, it is printed or dropped, and the program goes on.
"""

from __future__ import annotations

import signal
import threading
from _thread import interrupt_main
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

#: Time after which Ctrl-C is raised again where nothing has come of it (s): shorter than anybody notices.
_AGAIN = 0.2


@contextmanager
def after_import() -> Iterator[None]:
    """Hold Ctrl-C back until the imports in this block are done.

    Examples
    --------
    >>> with after_import():
    ...     from scipy import ndimage
    """
    came: list[tuple[int, FrameType | None]] = []
    before = _exchanged(lambda number, frame: came.append((number, frame)))
    try:
        yield
    finally:
        _restore(before)
    if came and callable(before):
        before(*came[-1])


@contextmanager
def never_lost() -> Iterator[None]:
    """Let Ctrl-C act at once, and again until the block ends if C code swallows it.

    Examples
    --------
    >>> with never_lost():
    ...     pass
    """
    came: list[tuple[int, FrameType | None]] = []
    again: list[threading.Timer] = []

    def noted(number: int, frame: FrameType | None) -> None:
        came.append((number, frame))
        again.append(threading.Timer(_AGAIN, _raise_in_main, (number,)))
        again[-1].daemon = True
        again[-1].start()
        if callable(before):
            before(number, frame)

    before = _exchanged(noted)
    failure = None
    try:
        yield
    except Exception as error:  # what became of the callback that was left: Ctrl-C goes first
        failure = error
    finally:
        for timer in again:
            timer.cancel()
        _restore(before)
    if came and callable(before):
        before(*came[-1])
    if failure is not None:
        raise failure


def _raise_in_main(number: int) -> None:
    """Send a signal to the main thread, out of system calls too where there are such signals."""
    main = threading.main_thread().ident
    if main is not None and hasattr(signal, "pthread_kill"):
        signal.pthread_kill(main, number)
    else:
        interrupt_main(signal.Signals(number))


def _exchanged(handler: Any) -> Any:
    """Set a handler of Ctrl-C and return the one before; None, and nothing is set, where Python has none."""
    if threading.current_thread() is not threading.main_thread():
        return None  # signals are handled in the main thread only
    before = signal.getsignal(signal.SIGINT)
    if not callable(before):  # ignored, or ends the process at once
        return None
    signal.signal(signal.SIGINT, handler)
    return before


def _restore(before: Any) -> None:
    if before is not None:
        signal.signal(signal.SIGINT, before)
