"""A folder in which a call keeps what it has finished: the same call goes on from it, to the same bits."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from contfric.base.files import made_folder
from contfric.errors import ResultFileError
from contfric.remember.journal import Journal, belongs, keeping, program

#: The journal in it.
_NAME = "parts"


@contextmanager
def kept_in(folder: str | Path | None) -> Iterator[None]:
    """Keep remembered calls of the block in a folder; without one nothing changes.

    Each of them stands under all that it depends on, so one folder may be given to several calls.

    Raises
    ------
    ResultFileError
        If it is no path, cannot be written, is in use, or holds parts that another version has made.
    """
    if folder is None:
        yield
        return
    path = made_folder("the folder of finished parts", folder)
    file = path / _NAME
    if file.exists() and not (file.is_file() and belongs(file, program())):
        raise ResultFileError(
            f"{path} holds parts of another version of contfric, numpy, scipy or numba: use another folder"
        )
    journal = Journal(file, program())
    try:
        with keeping(journal):
            yield
    finally:
        journal.close()
