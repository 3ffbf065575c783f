"""Progress on stderr: one line that is written over, and only where somebody watches."""

from __future__ import annotations

import logging
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType

#: Seconds between two updates: faster is not read.
_INTERVAL = 0.1


class ProgressLine:
    """Shows the last text with the time since the start; use it as a context manager.

    How much is still to be found is not known beforehand, so there is no estimate of what is left.

    Parameters
    ----------
    quiet : bool
        Whether to show nothing; nothing is shown either if stderr is no terminal.
    """

    def __init__(self, quiet: bool = False) -> None:
        self._shown = not quiet and sys.stderr.isatty()
        self._start = time.monotonic()
        self._last = -_INTERVAL

    def __enter__(self) -> Callable[[str], None]:
        return self.show

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._shown:
            _write("")

    def show(self, text: str) -> None:
        """Show a text unless the last one is too recent."""
        now = time.monotonic() - self._start
        if self._shown and now - self._last >= _INTERVAL:
            self._last = now
            _write(f"{now:6.1f} s  {text}")


class _Compiling(logging.Handler):
    """Shows what is compiled while it is, after the seconds that compiling took before."""

    _before = 0.0

    def emit(self, record: logging.LogRecord) -> None:
        seconds = getattr(record, "seconds", None)  # what has been compiled says how long it took
        if seconds is None:
            _write(f"{self._before:6.1f} s  {record.getMessage()}")
        else:
            self._before += seconds
            _write("")


@contextmanager
def compiling_shown(quiet: bool = False) -> Iterator[None]:
    """Show what is compiled while the block runs, if stderr is a terminal.

    Parameters
    ----------
    quiet : bool
        Whether to show nothing.
    """
    if quiet or not sys.stderr.isatty():
        yield
        return
    logger, handler = logging.getLogger("contfric"), _Compiling(logging.INFO)
    level = logger.level
    logger.addHandler(handler)
    logger.setLevel(min(level or logging.INFO, logging.INFO))
    try:
        yield
    finally:
        logger.setLevel(level)
        logger.removeHandler(handler)


def _write(text: str) -> None:
    """Write over the line of the terminal, and no further than its width."""
    width = shutil.get_terminal_size().columns - 1
    # \r and ESC[K: from the start of the line, erase to its end
    sys.stderr.write(f"\r\x1b[K{text[:width]}")
    sys.stderr.flush()
