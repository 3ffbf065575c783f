"""The time limit of a proof."""

from __future__ import annotations

import math
import time

from contfric.errors import ParameterError

#: What is said of a statement that a time limit has ended, or left out.
LATE = "not reached within the time limit"


class TimeOverError(Exception):
    """The time for a proof is over."""


def check_time(until: float) -> None:
    """Raise if some time (that of ``time.time``) is over.

    Raises
    ------
    TimeOverError
        If it is.
    """
    if time.time() > until:
        raise TimeOverError


def latest(time_limit: float | None) -> float:
    """Return when to end, by ``time.time``, for a limit in seconds from now.

    Raises
    ------
    ParameterError
        If the limit is not positive.
    """
    if time_limit is not None and not time_limit > 0:
        raise ParameterError(f"time_limit is a number of seconds above 0, got {time_limit}")
    return math.inf if time_limit is None else time.time() + time_limit
