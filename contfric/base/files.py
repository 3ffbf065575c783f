"""Files that are written whole or not at all."""

from __future__ import annotations

import csv
import errno
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from contfric.errors import ResultFileError, path_of

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_CLOSED = (errno.EROFS, errno.EACCES, errno.EPERM)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary file in the same folder, which takes the place of ``path`` at the end.

    Until then ``path`` is what it was: a failure or Ctrl-C leaves neither half of a file nor a
    temporary one.

    Raises
    ------
    ResultFileError
        If the file cannot be written; the message says what can be done.

    Examples
    --------
    >>> from tempfile import mkdtemp
    >>> path = Path(mkdtemp()) / "a.txt"
    >>> with replacing(path) as temporary:
    ...     _ = temporary.write_text("whole")
    >>> path.read_text()
    'whole'
    """
    if path.exists() and not path.is_file() and not path.is_dir():
        raise ResultFileError(f"{path} is no ordinary file, and is not replaced: give another name")
    if not path.name:  # "." or "/"
        raise ResultFileError(unwritable(path, IsADirectoryError(errno.EISDIR, "Is a directory")))
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        yield temporary
        _flush(temporary)
        os.replace(temporary, path)
    except OSError as error:
        raise ResultFileError(unwritable(path, error)) from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def write_csv(path: Path, rows: Iterable[Iterable[Any]]) -> None:
    """Write a table as CSV, whole or not at all; its first row are the names of its columns."""
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


def remove_leftovers(path: Path) -> None:
    """Delete what processes that were killed while they wrote a file have left next to it."""
    for part in path.parent.glob(f".{path.stem}.*.part{path.suffix}"):
        with suppress(OSError):
            part.unlink()


def _flush(path: Path) -> None:
    """Have the disk accept the data: some report that they are full only now."""
    descriptor = os.open(path, os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def made_folder(what: str, folder: str | Path) -> Path:
    """Return a folder, which is made where it does not exist.

    Raises
    ------
    ResultFileError
        If it is no path, or cannot be made. ``what`` says what it is for.
    """
    path = path_of(what, folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ResultFileError(unwritable(path, error)) from error
    return path


def unwritable(path: Path, error: OSError) -> str:
    """Return the message for a file or folder that cannot be written: why, and what to do."""
    if error.errno in _FULL:
        remedy = "free some space, or write to another disk"
    elif error.errno in _CLOSED:
        remedy = "the folder is read-only: write to another one"
    elif error.errno in (errno.ENOTDIR, errno.EEXIST, errno.EISDIR):
        remedy = "a file stands where a folder should be, or the other way round: use another name"
    elif error.errno == errno.ENOENT and not path.parent.is_dir():
        remedy = f"make the folder {path.parent} first"
    else:
        remedy = "write to another place"
    return f"cannot write {path}: {error.strerror or error}; {remedy}"
