"""Packages that are not installed with contfric, and asked for where they are used."""

from __future__ import annotations

from functools import partial
from importlib import import_module

from contfric.errors import ContfricError


class MissingPackageError(ContfricError, ImportError):
    """A package is needed that was not installed; the message says how to get it."""


def _need(package: str, what: str, extra: str) -> None:
    try:
        import_module(package)
    except ImportError as error:
        raise MissingPackageError(
            f"{what} need {package} ({error}): pip install 'contfric[{extra}]'"
        ) from None


# Each sees that a package can be imported, and raises MissingPackageError if it is not installed.
need_pandas = partial(_need, "pandas", "tables", "pandas")
need_bokeh = partial(_need, "bokeh", "live diagrams", "live")
need_flint = partial(_need, "flint", "proofs", "certify")
need_xarray = partial(_need, "xarray", "labelled arrays", "xarray")
