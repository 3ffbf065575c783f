"""Errors that a user can act on: what is wrong, where, and what would be valid."""

from __future__ import annotations

import difflib
import math
import operator
import os
from collections.abc import Iterable, Mapping, Sequence
from numbers import Real
from pathlib import Path
from typing import Any

#: Largest whole number that counts something: beyond it a float no longer counts in ones.
_MOST = 2**53
#: Widest range: steps are 1e-10 of it at the least, and squares of it are taken. The narrowest is as small,
#: and a share of its ends, as their rounding must be below its largest steps.
_WIDE, _NARROW = 1e100, 1e-10
#: Most characters of a value in a message.
_SHOWN = 80


class ContfricError(Exception):
    """Base of every error that contfric raises on purpose; its text is one clear message.

    Examples
    --------
    >>> import contfric as cf
    >>> try:
    ...     cf.load("missing.npz")
    ... except cf.ContfricError as error:
    ...     print(error)
    cannot read missing.npz: No such file or directory
    """


class ParameterError(ContfricError):
    """A parameter is unknown, missing, not finite, or outside of the model's domain of validity.

    Examples
    --------
    >>> import contfric as cf
    >>> try:
    ...     cf.find_orbit("coulomb", {"S": 0.5, "S0": 0.4})
    ... except cf.ParameterError as error:
    ...     print(str(error)[16:46])
    needs S0 >= S, got S0 = 0.4, S
    """


class ModelError(ParameterError):
    """A user's model cannot be read or built: the message says where and what would be valid.

    Examples
    --------
    >>> import contfric as cf
    >>> try:
    ...     cf.load_model("missing.yaml")
    ... except cf.ModelError as error:
    ...     print(str(error)[:29])
    there is no file missing.yaml
    """


class NotationError(ContfricError):
    """A signature text, file or segment list cannot be read, or is no closed walk.

    Examples
    --------
    >>> import contfric as cf
    >>> try:
    ...     cf.solve_orbit("coulomb", "5a", {})
    ... except cf.NotationError as error:
    ...     print(str(error)[:21])
    unknown signature '5a
    """


class StudyError(ContfricError):
    """A study file cannot be read or asks for something that does not exist.

    Examples
    --------
    >>> import contfric as cf
    >>> try:
    ...     cf.run_study("missing.yaml")
    ... except cf.StudyError as error:
    ...     print(str(error)[:29])
    there is no file missing.yaml
    """


class ResultFileError(ContfricError):
    """A result file or folder is damaged, missing, or would be overwritten.

    Examples
    --------
    >>> import contfric as cf
    >>> try:
    ...     cf.load("missing.npz")
    ... except cf.ResultFileError as error:
    ...     print(error)
    cannot read missing.npz: No such file or directory
    """


class ConvergenceError(ContfricError):
    """No orbit was found; ``result`` holds the last iterate and its residual when there is one.

    Examples
    --------
    >>> import contfric as cf
    >>> try:
    ...     cf.solve_orbit("coulomb", "1a", {"Omega": 0.8, "S": 0.32, "S0": 0.4})
    ... except cf.ConvergenceError as error:
    ...     print(str(error)[:32])
    no admissible orbit '1a' was fou
    """

    def __init__(self, message: str, result: object | None = None) -> None:
        super().__init__(message)
        self.result = result


class AperiodicError(ConvergenceError):
    """The simulation did not converge to a periodic orbit within its allowance.

    Examples
    --------
    >>> import contfric as cf
    >>> try:
    ...     cf.find_orbit("coulomb", {"Omega": 0.35, "S": 0.05, "S0": 0.4}, longest=200)
    ... except cf.AperiodicError:
    ...     print("chaos, or a period beyond 64")
    chaos, or a period beyond 64
    """


#: More valid names than these are no line to read: then the nearest ones.
_MOST_NAMES, _NEAREST = 24, 12
#: Least likeness of a name that is suggested: 'om' is like 'Omega' (0.57), but 'amplitude' is not like
#: 'multiplier' (0.53). Of two letters one may be wrong.
_ALIKE, _ALIKE_SHORT = 0.55, 0.5


def did_you_mean(given: object, valid: Iterable[str]) -> str:
    """Return ``"; did you mean 'x'?"`` for the closest valid name, and the list of valid names.

    Examples
    --------
    >>> did_you_mean("Omga", ["Omega", "S"])
    "; did you mean 'Omega'? Valid: Omega, S"
    """
    names, text = [str(name) for name in valid], str(given).lower()
    likeness = {  # upper and lower case count as the same
        name: difflib.SequenceMatcher(None, text, name.lower()).ratio() for name in names
    }
    best = max(likeness.values(), default=0.0)
    close = [f"'{name}'" for name in likeness if likeness[name] == best]
    least = _ALIKE if len(str(given)) > 2 else _ALIKE_SHORT
    hint = f"; did you mean {' or '.join(close)}?" if best >= least and len(close) <= 2 else "."
    if len(names) <= _MOST_NAMES:
        return f"{hint} Valid: {', '.join(names)}"
    nearest = sorted(names, key=lambda name: -likeness[name])[:_NEAREST]
    return f"{hint} Valid, of {len(names)}: {', '.join(nearest)} and others"


def whole_number(name: str, value: object, least: int, most: int | None = None) -> int:
    """Return a whole number that a user gave.

    Raises
    ------
    ParameterError
        If it is no whole number, or outside of its limits.

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
    if not least <= number <= (_MOST if most is None else most):
        raise ParameterError(f"{name} is a whole number {limits}, got {shown(value)}")
    return number


def checked_range(name: str, bounds: object) -> tuple[float, float]:
    """Return the range of a parameter: two finite numbers, lower first, that a float can tell apart.

    Raises
    ------
    ParameterError
        If it is no such range, or so wide or narrow that steps along it cannot be resolved.

    Examples
    --------
    >>> checked_range("Omega", (0.3, 1))
    (0.3, 1.0)
    """
    # a set has no order, a mapping has other values, an iterator can be read once
    ordered = isinstance(bounds, Sequence) or hasattr(bounds, "__array__")
    ends = tuple(bounds) if ordered and isinstance(bounds, Iterable) else ()
    if len(ends) != 2 or not all(isinstance(e, Real) and not isinstance(e, bool) for e in ends):
        raise ParameterError(
            f"the range of '{name}' is a pair of numbers (lower, upper), got {shown(bounds)}"
        )
    try:
        low, high = (float(end) for end in ends)
    except OverflowError:  # a whole number of 400 digits
        low = high = math.inf
    if not (math.isfinite(low) and math.isfinite(high)) or not low < high:
        raise ParameterError(
            f"the range of '{name}' must be two finite numbers, lower first, got {shown(bounds)}"
        )
    width, size = high - low, max(abs(low), abs(high))
    if not _NARROW * size <= width or not 1.0 / _WIDE <= width <= _WIDE:
        raise ParameterError(
            f"the range of '{name}', ({low!r}, {high!r}), is {'wider' if width > 1.0 else 'narrower'} than "
            "steps along it can be resolved: give the part of it that is of interest"
        )
    return low, high


def shown(value: object) -> str:
    """Return a value for a message: in one line that is not too long.

    Examples
    --------
    >>> shown(10**400)
    'a whole number of 401 digits'
    """
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) > 10**_SHOWN:
        return f"a whole number of {int(value.bit_length() * math.log10(2)) + 1} digits"
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # it holds such a number
        text = f"a {type(value).__name__} of numbers that are too large"
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."


def real_number(
    name: str, value: object, least: float | None = None, wanted: str = "is a finite number"
) -> float:
    """Return a finite number that a user gave: a float, a whole number that fits, or one of numpy's.

    Parameters
    ----------
    least : what it is not below
    wanted : what it has to be, for the message

    Raises
    ------
    ParameterError
        If it is no finite number, or below its limit.

    Examples
    --------
    >>> real_number("time", 1)
    1.0
    """
    if least is not None:
        wanted = f"{wanted} >= {least:g}"
    try:
        real = isinstance(value, Real) and not isinstance(value, bool)
        number = float(value) if real else math.nan  # type: ignore[arg-type] # Real has __float__
    except OverflowError:  # a whole number of 400 digits
        number = math.inf
    if not math.isfinite(number) or (least is not None and number < least):
        raise ParameterError(f"{name} {wanted}, got {shown(value)}")
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
        If it is no mapping.
    """
    if not isinstance(value, Mapping):
        raise ParameterError(f"{name} is a mapping, such as {example}; got {shown(value)}")
    return value


def items_of(value: object) -> tuple[Any, ...]:
    """Return the items of a list that a user gave; empty if it is no list (a text is not one).

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
        If it is no path.
    """
    if not isinstance(value, (str, os.PathLike)) or not str(value).strip() or "\0" in str(value):
        raise ResultFileError(f"{what} is a path, such as 'results.npz', got {shown(value)}")
    return Path(value)


def number_and(count: int, noun: str, nouns: str = "") -> str:
    """Return a number with its noun, in the singular or the plural.

    Examples
    --------
    >>> number_and(1, "branch", "branches"), number_and(0, "period")
    ('1 branch', '0 periods')
    """
    return f"{count} {noun if count == 1 else nouns or f'{noun}s'}"


def either(one: str, other: str) -> str:
    """Return what a kind of event is in words, where places of one diagram differ in it.

    Examples
    --------
    >>> either("grazing impact", "grazing-sliding")
    'grazing impact or grazing-sliding'
    >>> either("", "grazing")
    'grazing'
    """
    if not one or other in one.split(" or "):
        return one or other
    return f"{one} or {other}"
