"""The checkpoint of a run: what was computed so far, in its folder, until the run has ended well.

It is the journal of the run (:mod:`contfric.remember.journal`), which belongs to one study and one version of
the program: the same command goes on from it, and replaces what an interrupted run has written.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from contfric.base.resources import user_cache
from contfric.errors import ContfricError, ResultFileError
from contfric.quantities.registry import functions_in
from contfric.remember.journal import Journal, belongs, digest_of, keeping, program
from contfric.remember.questions import Question
from contfric.remember.stored import UnstorableError
from contfric.study.read import Study

#: The journal, in the folder of the run.
CHECKPOINT = "checkpoint"
#: Seconds after which a checkpoint in the user's cache is forgotten: a month.
_FORGOTTEN = 30 * 86400


def key_of(study: Study) -> str:
    """Return a digest of everything that a study computes from, and of the program."""
    asked = json.dumps(study.as_dict(), sort_keys=True, default=str)
    try:
        functions = list(functions_in(study.as_dict()))
        started = Question().bytes_of(
            (study.model, study.params, study.signature, study.orbit, functions)
        )
    except UnstorableError:
        started = repr((study.model.name, study.params, study.signature, study.orbit)).encode()
    return digest_of(asked.encode() + started + program().encode()).hex()


def goes_on(path: Path, key: str) -> bool:
    """Tell whether a folder holds the checkpoint of the same study, from which its run can go on."""
    return (path / CHECKPOINT).is_file() and belongs(path / CHECKPOINT, key)


def check_unfinished(path: Path, key: str, force: bool) -> None:
    """Refuse a folder with the checkpoint of another run, or make it free.

    Raises
    ------
    ResultFileError
        If there is one and ``force`` is False.
    """
    if not (path / CHECKPOINT).exists() or goes_on(path, key):
        return
    if not force:
        raise ResultFileError(
            f"{path} holds the checkpoint of an unfinished run of another study, of this one before it was "
            "changed, or of another version of contfric: give another folder (--out DIR, out=...), or "
            "start anew (--force, force=True)"
        )
    Journal(path / CHECKPOINT, key).remove()  # unless another process is writing to it


class Checkpoint:
    """What a computation keeps while it runs, for one that goes on after it.

    Parameters
    ----------
    journal : Journal or None
        None where no file can be written: then nothing is kept.

    Attributes
    ----------
    earlier : int
        Results of an interrupted computation that were found in it.
    """

    def __init__(self, journal: Journal | None) -> None:
        self._journal = journal
        self.earlier = 0 if journal is None else len(journal)

    @contextmanager
    def kept(self) -> Iterator[None]:
        """Keep what is computed in the block, for one that goes on; an error of the input ends that."""
        try:
            with keeping(self._journal):
                yield
        except BaseException as error:
            # a disk that is full may have space later
            if isinstance(error, ContfricError) and not isinstance(error, ResultFileError):
                self._end(remove=True)
            else:
                self._end(remove=False)
            raise

    def done(self) -> None:
        """Remove it: the computation has ended well."""
        self._end(remove=True)

    def leave(self) -> bool:
        """Leave it for a computation that goes on, if anything is in it; whether that is so."""
        full = self._journal is not None and len(self._journal) > 0
        self._end(remove=not full)
        return full

    def _end(self, remove: bool) -> None:
        if self._journal is None:
            return
        if remove:
            self._journal.remove()
        else:
            self._journal.close()


def checkpoint_in(folder: Path, key: str) -> Checkpoint:
    """Return the checkpoint of a run, in its folder."""
    return Checkpoint(Journal(folder / CHECKPOINT, key))


def checkpoint_of(asked: tuple[object, ...]) -> Checkpoint:
    """Return the checkpoint of a command without a folder: a file in the user's cache.

    Those that nobody has come back to for a month are deleted.
    """
    key = digest_of(repr(asked).encode() + program().encode()).hex()
    folder = user_cache() / "checkpoints"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path in folder.iterdir():
            if path.stat().st_mtime < time.time() - _FORGOTTEN:
                path.unlink()
        return Checkpoint(Journal(folder / key, key))
    except (
        OSError,
        ResultFileError,
    ):  # a folder that cannot be written, or the same command twice at once
        return Checkpoint(None)
