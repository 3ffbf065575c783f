"""Packages that are not installed with contfric, and asked for where they are used."""

from __future__ import annotations

from contfric.errors import ContfricError


class MissingPackageError(ContfricError, ImportError):
    """A package is needed that was not installed; the message says how to get it."""


def need_pandas() -> None:
    """See that pandas can be imported.

    Raises
    ------
    MissingPackageError
        If it is not installed.
    """
    try:
        import pandas  # noqa: F401
    except ImportError as error:
        raise MissingPackageError(
            f"tables need pandas ({error}): pip install 'contfric[pandas]'"
        ) from None


def need_bokeh() -> None:
    """See that bokeh can be imported.

    Raises
    ------
    MissingPackageError
        If it is not installed.
    """
    try:
        import bokeh  # noqa: F401
    except ImportError as error:
        raise MissingPackageError(
            f"live diagrams need bokeh ({error}): pip install 'contfric[live]'"
        ) from None
