"""Exit codes of the command line."""

from __future__ import annotations

from enum import IntEnum


class Exit(IntEnum):
    """Exit codes."""

    DONE = 0
    FAILED = 1
    BAD_INPUT = 2
    INTERRUPTED = 130  # as shells have it: 128 + SIGINT
    BROKEN_PIPE = 141  # 128 + SIGPIPE
