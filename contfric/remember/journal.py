"""A journal of what was computed: a run that was killed goes on from it, to the same results, bit by bit.

Functions that are pure and take long are marked with :func:`remembered`. While a journal is kept
(:func:`keeping`) each of their results is appended to its file, under a digest of the arguments; the next run
is simply the same computation from its beginning, in which those calls are looked up. Nothing depends on the
order in which things are done.

The file is a line that says what it belongs to, and records: length, digest and content. A record that was
cut off when the process was killed does not count, nor does a damaged one.
"""

from __future__ import annotations

import hashlib
import inspect
import json
import os
import time
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import cache, wraps
from importlib.metadata import version
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from contfric.base.files import unwritable
from contfric.base.sources import package_digest
from contfric.base.tally import add, tally
from contfric.errors import ContfricError, ResultFileError
from contfric.remember.questions import Question
from contfric.remember.stored import Reader, UnstorableError, Writer

P = ParamSpec("P")
R = TypeVar("R")

#: Bytes of a digest: two calls, or damage, are taken for the same once in 2**128 times.
_SIZE = 16
#: A record's head: its length and digest; the key comes first in its content.
_HEAD = 8 + _SIZE
#: Seconds that a byte of a record must have taken to compute: writing and reading take a fifth of it.
_WORTH = 1e-8
#: Seconds of a call that is one of very many: keeping and looking up quicker ones would cost as much.
SLOW = 2e-3
#: Packages whose versions may change the last digits.
_NUMERICS = ("numpy", "numba", "llvmlite", "scipy")


def digest_of(*content: bytes) -> bytes:
    """Return the digest of some bytes, one after the other."""
    found = hashlib.blake2b(digest_size=_SIZE)
    for piece in content:
        found.update(piece)
    return found.digest()


@cache
def program() -> str:
    """Return a digest of the program: all its sources, and what else may change the last digits."""
    content = hashlib.blake2b(package_digest().encode(), digest_size=_SIZE)
    for name in _NUMERICS:
        content.update(f"{name} {version(name)}".encode())
    return content.hexdigest()


class Journal:
    """Results by their keys, in a file that only grows; a second process cannot open it.

    Parameters
    ----------
    path : Path
        The file; it is made if it is not there.
    belongs_to : str
        What the results belong to; those of anything else are dropped.

    Raises
    ------
    ResultFileError
        If it cannot be written, or another process is writing to it.
    """

    def __init__(self, path: Path, belongs_to: str) -> None:
        self.path = path
        self._places: dict[bytes, tuple[int, int]] = {}
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o644)
        except OSError as error:
            raise ResultFileError(unwritable(path, error)) from error
        try:
            _lock(self._file, path)
            self._end = self._read(_first_line(belongs_to))
            #: Whether an earlier run has left results in it.
            self.goes_on = len(self._places) > 0
        except BaseException:
            os.close(self._file)
            raise
        _OPEN.add(self)

    def __len__(self) -> int:
        return len(self._places)

    def close(self) -> None:
        """Let the file go."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def remove(self) -> None:
        """Delete the file: what it was kept for is done."""
        self.close()
        with suppress(OSError):
            self.path.unlink()

    def get(self, key: bytes) -> bytes | None:
        """Return the result of a key; None if it has none, or the record is damaged."""
        if key not in self._places or self._file < 0:
            return None
        at, size = self._places[key]
        content = self._piece(at, size)
        if digest_of(content) != self._piece(at - _SIZE, _SIZE):
            return None
        return content[_SIZE:]

    def put(self, key: bytes, result: bytes) -> None:
        """Append a result; where the disk is full it is not kept, and the computation goes on."""
        if self._file < 0:
            return
        size = len(key) + len(result)
        head = size.to_bytes(8, "little") + digest_of(key, result) + key
        try:
            os.lseek(self._file, self._end, os.SEEK_SET)
            _write(self._file, head)
            _write(self._file, result)
        except OSError:
            with suppress(OSError):
                os.ftruncate(self._file, self._end)
            return
        self._places[key] = self._end + _HEAD, size
        self._end += _HEAD + size

    def _read(self, first_line: bytes) -> int:
        """Find the records; return where the next one is written."""
        size = os.fstat(self._file).st_size
        at = len(first_line)
        if self._piece(0, at) != first_line:
            os.ftruncate(self._file, 0)
            os.lseek(self._file, 0, os.SEEK_SET)
            _write(self._file, first_line)
            return at
        while at + _HEAD + _SIZE <= size:
            length = int.from_bytes(self._piece(at, 8), "little")
            if length < _SIZE or at + _HEAD + length > size:
                break
            self._places[self._piece(at + _HEAD, _SIZE)] = at + _HEAD, length
            at += _HEAD + length
        os.ftruncate(self._file, at)
        return at

    def _piece(self, at: int, size: int) -> bytes:
        os.lseek(self._file, at, os.SEEK_SET)
        pieces = []
        while size > 0 and (piece := os.read(self._file, size)):
            pieces.append(piece)
            size -= len(piece)
        return b"".join(pieces)


#: Journals that are open.
_OPEN: weakref.WeakSet[Journal] = weakref.WeakSet()


def _let_go() -> None:
    """Close all journals, in a process that was forked: while it has their files they are locked."""
    for journal in list(_OPEN):
        journal.close()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_let_go)


def _first_line(belongs_to: str) -> bytes:
    """Return the first line of a journal."""
    return json.dumps({"contfric": "journal", "of": belongs_to}).encode() + b"\n"


def belongs(path: Path, belongs_to: str) -> bool:
    """Tell whether a file is the journal of something, as far as it was written."""
    wanted = _first_line(belongs_to)
    try:
        with path.open("rb") as file:
            found = file.read(len(wanted))
    except OSError:
        return False
    return wanted.startswith(found)  # it may have been killed before the line was whole


def _write(file: int, content: bytes) -> None:
    view = memoryview(content)
    while view:
        view = view[os.write(file, view) :]


def _lock(file: int, path: Path) -> None:
    """Keep other processes out, where the system can."""
    try:
        import fcntl
    except ImportError:
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise ResultFileError(
            f"{path.parent} is in use: another run is writing to it. Wait for it, or give another folder"
        ) from None
    except OSError:  # a file system without locks
        return


# ----------------------------------------------------------------------------- remembered calls

_KEPT: ContextVar[Journal | None] = ContextVar("contfric_journal", default=None)


@contextmanager
def keeping(journal: Journal | None) -> Iterator[None]:
    """Remember calls in a journal while the block runs."""
    token = _KEPT.set(journal)
    try:
        yield
    finally:
        _KEPT.reset(token)


def remembered(
    *,
    without: tuple[str, ...] = ("progress",),
    finished: Callable[[Any], bool] | None = None,
    slow: float = 0.0,
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Mark a function whose results are worth keeping: it is pure, and what it takes and returns is data.

    Parameters
    ----------
    without : names of arguments that do not matter to the result
    finished : tells whether a result is whole; one that Ctrl-C has cut short is not kept
    slow : seconds below which a result is not worth its record
    """

    def mark(function: Callable[P, R]) -> Callable[P, R]:
        signature = inspect.signature(function)
        name = f"{function.__module__}.{function.__qualname__}"

        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            journal = _KEPT.get()
            if journal is None:
                return function(*args, **kwargs)

            def question() -> tuple[bytes, Writer]:
                bound = signature.bind(*args, **kwargs)
                bound.apply_defaults()
                return _question(
                    name, {k: v for k, v in bound.arguments.items() if k not in without}
                )

            def compute() -> R:
                return function(*args, **kwargs)

            if slow and not journal.goes_on:
                # most of these calls are not kept, and a digest of the arguments takes longer than they do
                return _given(_computed(journal, question, compute, slow, finished))  # type: ignore[no-any-return]
            try:
                key, inputs = question()
            except UnstorableError:
                return compute()
            found = _looked_up(journal, key, inputs)
            if found is None:
                found = _computed(journal, lambda: (key, inputs), compute, slow, finished)
            return _given(found)  # type: ignore[no-any-return]

        return call

    return mark


class Parts:
    """Parts of a computation that are computed elsewhere, in the journal that is kept, if there is one.

    Parameters
    ----------
    name : of the computation
    """

    def __init__(self, name: str) -> None:
        self._name, self._journal = name, _KEPT.get()

    @property
    def folder(self) -> Path | None:
        """Where they are kept; None if nowhere."""
        return None if self._journal is None else self._journal.path.parent

    def get(self, part: Any) -> Any:
        """Return the result of a part; None if it has not been kept."""
        if self._journal is None:
            return None
        try:
            found = _looked_up(self._journal, *_question(self._name, part))
        except UnstorableError:
            return None
        return found and found[0]

    def put(self, part: Any, result: Any) -> None:
        """Keep the result of a part."""
        if self._journal is not None:
            with suppress(UnstorableError):
                key, inputs = _question(self._name, part)
                # where it was computed, its work was counted there
                self._journal.put(key, Writer(inputs.objects).bytes_of((result, 0)))


def _question(name: str, asked: Any) -> tuple[bytes, Writer]:
    """Return the key of a call, and the writer that has the objects in it."""
    inputs = Question()
    return digest_of(inputs.bytes_of([name, asked])), inputs


def _given(found: tuple[Any]) -> Any:
    """Return a result, or raise the error that a computation has ended in."""
    if isinstance(found[0], Exception):
        raise found[0]
    return found[0]


def _looked_up(journal: Journal, key: bytes, inputs: Writer) -> tuple[Any] | None:
    content = journal.get(key)
    if content is None:
        return None
    try:
        result, added = Reader(content, inputs.objects).value()
    except UnstorableError:
        return None
    add(added)  # one that is looked up counts as much
    return (result,)


def _computed(
    journal: Journal,
    question: Callable[[], tuple[bytes, Writer]],
    compute: Callable[[], Any],
    slow: float,
    finished: Callable[[Any], bool] | None,
) -> tuple[Any]:
    """Compute a result, or the error that it ends in, and keep it."""
    before, start = tally().copy(), time.perf_counter()
    result: Any
    try:
        result = compute()
    except ContfricError as error:
        result = error
    took = time.perf_counter() - start
    whole = finished is None or isinstance(result, Exception) or finished(result)
    if whole and took >= slow:
        with suppress(UnstorableError):
            key, inputs = question()
            content = Writer(inputs.objects).bytes_of((result, tally() - before))
            if took >= _WORTH * len(content):
                journal.put(key, content)
    return (result,)
