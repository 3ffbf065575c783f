"""Errors that a user can act on: what is wrong, where, and what would be valid."""

from __future__ import annotations

import difflib
import math
import operator
import os
import reprlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any


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


def did_you_mean(word: object, valid: Iterable[str]) -> str:
    """Return ``"; did you mean 'x'?"`` for the closest valid words, and the list of valid words.

    Examples
    --------
    >>> did_you_mean("Omga", ["Omega", "S"])
    "; did you mean 'Omega'? Valid: Omega, S"
    """
    names, word = [str(name) for name in valid], str(word)
    likeness = {  # a slip of the shift key is none
        name: difflib.SequenceMatcher(None, word.lower(), name.lower()).ratio() for name in names
    }
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
    try:
        if isinstance(value, bool):
            raise TypeError
        number = operator.index(value)  # type: ignore[arg-type] # whole numbers of numpy count
    except TypeError:
        raise ParameterError(f"{name} is a whole number {limits}, got {shown(value)}") from None
    if number < least or (most is not None and number > most):
        raise ParameterError(f"{name} is a whole number {limits}, got {shown(value)}")
    return number


def shown(value: object) -> str:
    """Return what a user gave as one line, shortened.

    Examples
    --------
    >>> shown("0.5")
    "'0.5'"
    """
    return " ".join(reprlib.repr(value).split())


def real_number(name: str, value: object, least: float | None = None) -> float:
    """Return a finite number that a user gave.

    Raises
    ------
    ParameterError
        If it is none, or below its limit.

    Examples
    --------
    >>> real_number("time", 1)
    1.0
    """
    wanted = "a finite number" if least is None else f"a finite number >= {least:g}"
    try:
        if isinstance(value, (bool, str, bytes)):
            raise TypeError
        number = float(value)  # type: ignore[arg-type] # numbers of numpy count
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(f"{name} is {wanted}, got {shown(value)}") from None
    if not math.isfinite(number) or (least is not None and number < least):
        raise ParameterError(f"{name} is {wanted}, got {shown(value)}")
    return number


def truth(name: str, value: object) -> bool:
    """Return True or False that a user gave.

    Raises
    ------
    ParameterError
        If it is neither.
    """
    if type(value).__name__ not in ("bool", "bool_"):  # the second is numpy's
        raise ParameterError(f"{name} is True or False, got {shown(value)}")
    return bool(value)


def mapping_of(name: str, value: object, example: str) -> Mapping[Any, Any]:
    """Return a mapping that a user gave.

    Raises
    ------
    ParameterError
        If it is none.
    """
    if not isinstance(value, Mapping):
        raise ParameterError(f"{name} is a mapping, such as {example}; got {shown(value)}")
    return value


def items_of(value: object) -> tuple[Any, ...]:
    """Return the items of a list that a user gave; empty if it is none (a text is none).

    Examples
    --------
    >>> items_of(["SN", "BP"]), items_of("SN"), items_of(3)
    (('SN', 'BP'), (), ())
    """
    if isinstance(value, (str, bytes)):
        return ()
    try:
        return tuple(value)  # type: ignore[arg-type] # arrays without a length are no lists, too
    except TypeError:
        return ()


def function_of(name: str, value: object) -> None:
    """Check a function that a user gave, or None.

    Raises
    ------
    ParameterError
        If it can be neither called nor left out.
    """
    if value is not None and not callable(value):
        raise ParameterError(
            f"{name} is a function of one text, such as print, or None; got {shown(value)}"
        )


def path_of(what: str, value: object) -> Path:
    """Return a path that a user gave.

    Raises
    ------
    ResultFileError
        If it is none.
    """
    if not isinstance(value, (str, os.PathLike)) or not str(value).strip() or "\0" in str(value):
        raise ResultFileError(f"{what} is a path, such as 'results.npz', got {shown(value)}")
    return Path(value)
