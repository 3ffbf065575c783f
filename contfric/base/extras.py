"""Packages that are not installed with contfric, and asked for where they are used."""

from __future__ import annotations

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


def need_pandas() -> None:
    """See that pandas can be imported.

    Raises
    ------
    MissingPackageError
        If it is not installed.
    """
    _need("pandas", "tables", "pandas")


def need_bokeh() -> None:
    """See that bokeh can be imported.

    Raises
    ------
    MissingPackageError
        If it is not installed.
    """
    _need("bokeh", "live diagrams", "live")


def need_flint() -> None:
    """See that python-flint can be imported.

    Raises
    ------
    MissingPackageError
        If it is not installed.
    """
    _need("flint", "proofs", "certify")


def need_xarray() -> None:
    """See that xarray can be imported.

    Raises
    ------
    MissingPackageError
        If it is not installed.
    """
    _need("xarray", "labelled arrays", "xarray")
