"""Errors that a user can act on: what is wrong, where, and what would be valid."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class ContfricError(Exception):
    """Base of every error that contfric raises on purpose; its text is one clear message."""


class ParameterError(ContfricError):
    """A parameter is unknown, missing, not finite, or outside of the model's domain of validity."""


class ModelError(ParameterError):
    """A user's model cannot be read or built: the message says where and what would be valid."""


class NotationError(ContfricError):
    """A signature text, file or segment list cannot be read, or is no closed walk."""


class StudyError(ContfricError):
    """A study file cannot be read or asks for something that does not exist."""


class ResultFileError(ContfricError):
    """A result file or folder is damaged, missing, or would be overwritten."""


class ConvergenceError(ContfricError):
    """No orbit was found; ``result`` holds the last iterate and its residual when there is one."""

    def __init__(self, message: str, result: object | None = None) -> None:
        super().__init__(message)
        self.result = result


class AperiodicError(ConvergenceError):
    """The simulation did not settle on a periodic orbit within its allowance."""


def did_you_mean(word: str, valid: Iterable[str]) -> str:
    """Return ``"; did you mean 'x'?"`` for the closest valid words, and the list of valid words.

    Examples
    --------
    >>> did_you_mean("Omga", ["Omega", "S"])
    "; did you mean 'Omega'? Valid: Omega, S"
    """
    names = [str(name) for name in valid]
    likeness = {name: difflib.SequenceMatcher(None, word, name).ratio() for name in names}
    best = max(likeness.values(), default=0.0)
    close = [f"'{name}'" for name in likeness if likeness[name] == best]
    hint = f"; did you mean {' or '.join(close)}?" if best >= 0.5 and len(close) <= 2 else "."
    return f"{hint} Valid: {', '.join(names)}"


def whole_number(name: str, value: object, least: int, most: int | None = None) -> int:
    """Return a whole number that a user gave.

    Raises
    ------
    ParameterError
        If it is none, or outside of its limits.

    Examples
    --------
    >>> whole_number("max_points", 100, least=2)
    100
    """
    limits = f">= {least}" if most is None else f"from {least} to {most}"
    if isinstance(value, bool) or not isinstance(value, int):
        raise ParameterError(f"{name} is a whole number {limits}, got {value!r}")
    if value < least or (most is not None and value > most):
        raise ParameterError(f"{name} is a whole number {limits}, got {value!r}")
    return value
