"""Progress on stderr: one line that is written over, and only where somebody watches."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Callable
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
            self._write("")

    def show(self, text: str) -> None:
        """Show a text unless the last one is too recent."""
        now = time.monotonic() - self._start
        if self._shown and now - self._last >= _INTERVAL:
            self._last = now
            width = shutil.get_terminal_size().columns - 1
            self._write(f"{now:6.1f} s  {text}"[:width])

    @staticmethod
    def _write(text: str) -> None:
        # \r and ESC[K: from the start of the line, erase to its end
        sys.stderr.write(f"\r\x1b[K{text}")
        sys.stderr.flush()
