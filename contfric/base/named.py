"""Mappings from names to values that say which name was meant."""

from __future__ import annotations

from typing import TypeVar

from contfric.errors import ParameterError, did_you_mean, shown

_Value = TypeVar("_Value")


class UnknownNameError(ParameterError, KeyError):
    """A mapping has no such name; a ``KeyError``, as of any other mapping."""

    def __str__(self) -> str:
        return str(self.args[0])  # a KeyError shows the representation of its text


class Named(dict[str, _Value]):
    """A dictionary whose error for a name that it does not have shows the valid ones.

    Examples
    --------
    >>> Named(Omega=0.5, S=0.3)["omega"]
    Traceback (most recent call last):
    contfric.base.named.UnknownNameError: there is no 'omega'; did you mean 'Omega'? Valid: Omega, S
    """

    def __missing__(self, name: object) -> _Value:
        raise UnknownNameError(f"there is no {shown(name)}{did_you_mean(name, self)}")
