"""The number of processors and the free memory, and a check that a request fits into it."""

from __future__ import annotations

import os

from contfric.errors import ParameterError

#: Memory that is taken for granted where the system does not tell (bytes).
_ASSUMED = 2**36


def processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def available() -> int:
    """Return the memory of this machine in bytes."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # no POSIX system
        return _ASSUMED


def must_fit(what: str, size: int) -> None:
    """Raise an error if something is larger than the memory.

    Raises
    ------
    ParameterError
        If it is.

    Examples
    --------
    >>> must_fit("a grid of 3 x 4 points", 12 * 30)
    """
    if size > available():
        raise ParameterError(
            f"{what} needs about {size / 2**30:.3g} GB, and this machine has {available() / 2**30:.3g} GB: "
            "ask for less"
        )
