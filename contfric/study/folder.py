"""The folder of a run: never overwritten unasked, and without what an earlier run has left."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from contfric.base.files import remove_leftovers, unwritable
from contfric.errors import ResultFileError
from contfric.study.plan import RECORD, RESULT_FILES

#: Files that a message names.
_SHOWN = 4


@dataclass(frozen=True)
class Folder:
    """A folder that is ready to take results: whether this run made it, and what was in it."""

    path: Path
    made: bool
    earlier: tuple[str, ...] = ()

    def discard_if_empty(self) -> None:
        """Remove the folder if this run made it and left nothing in it."""
        if self.made:
            with suppress(OSError):
                self.path.rmdir()

    def remove_stale(self, written: Iterable[str]) -> None:
        """Remove result files of an earlier run that this one has not replaced."""
        kept = {*written, RECORD}
        for name in {*RESULT_FILES, *self.earlier} - kept:
            with suppress(OSError):
                (self.path / name).unlink()

    def remove_leftovers(self, names: Iterable[str]) -> None:
        """Remove the halves of files that a killed run has left."""
        for name in names:
            remove_leftovers(self.path / name)

    def free_name(self, stem: str) -> Path:
        """Return a file name that is not taken yet: ``stem.npz``, ``stem-2.npz``, ..."""
        path, number = self.path / f"{stem}.npz", 2
        while path.exists():
            path, number = self.path / f"{stem}-{number}.npz", number + 1
        return path


def open_folder(path: Path, files: Iterable[str], force: bool) -> Folder:
    """Return a folder for the results of a run; it is made if it does not exist.

    Parameters
    ----------
    files : iterable of str
        Names of the files that the run writes.
    force : bool
        Whether results of an earlier run may be replaced (a run that goes on replaces its own).

    Raises
    ------
    ResultFileError
        If the folder holds results and ``force`` is False, or cannot be written.
    """
    holding = [name for name in dict.fromkeys([*RESULT_FILES, *files]) if (path / name).exists()]
    if holding and not force:
        raise ResultFileError(
            f"{path} holds results of an earlier run ({_first(holding)}): give another folder (--out DIR, "
            "out=...), or replace them (--force, force=True)"
        )
    made = not path.exists()
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as error:
        raise ResultFileError(unwritable(path, error)) from error
    return Folder(path, made, _earlier_files(path))


def _first(names: list[str]) -> str:
    """Return some names for a message."""
    left = len(names) - _SHOWN
    return ", ".join(names[:_SHOWN]) + (f" and {left} others" if left > 0 else "")


def _earlier_files(path: Path) -> tuple[str, ...]:
    """Return the files that the record of an earlier run names, before this run replaces it."""
    try:
        names = json.loads((path / RECORD).read_text(encoding="utf-8"))["files"]
        return tuple(n for n in names if isinstance(n, str) and Path(n).name == n)
    except (OSError, ValueError, KeyError, TypeError):
        return ()
