"""Results that are wanted soon, computed on another core while this one is busy.

A function marked :func:`foreseeable` is pure; kernels release the interpreter's lock. While a block works
:func:`in_advance`, its calls may be begun by :func:`foresee` in a thread, and who asks for one that has been
begun waits for it. What is computed, and what is counted, is the same as without: a result that nobody asks
for is dropped with its counts.

Nothing is begun before the block has lasted :data:`_PATIENCE`: of a closed form a branch takes milliseconds.
"""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import wraps
from threading import Event, Lock
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from contfric.base.memory import processors
from contfric.base.tally import count_apart
from contfric.remember.journal import digest_of
from contfric.remember.stored import UnstorableError, Writer

if TYPE_CHECKING:
    from concurrent.futures import Future, ThreadPoolExecutor

P = ParamSpec("P")
R = TypeVar("R")

#: Seconds of work before anything is begun in advance: a thread that takes turns with this one costs a few
#: milliseconds each time.
_PATIENCE = 1.0
#: Seconds after which a wait looks for Ctrl-C.
_LOOKS = 0.1


class _WantedAlreadyError(Exception):
    """What is to be computed in advance has been asked for: the rest follows from it, where it is wanted."""


class _Advance:
    """Calls that have been begun, by their keys; None for those that are computed where they are wanted."""

    def __init__(self) -> None:
        self.begun: dict[bytes, Future[Any] | None] = {}
        self.lock, self.unwanted = Lock(), Event()
        self.since = time.monotonic()
        self.thread: ThreadPoolExecutor | None = None
        self.jobs: list[Future[None]] = []

    @property
    def lasts(self) -> bool:
        """Whether the block has lasted so long that another thread is worth it."""
        return time.monotonic() - self.since > _PATIENCE

    def submit(self, function: Callable[[], object]) -> bool:
        """Begin a call in the other thread, after the one that is at work there; False if one waits."""
        self.jobs = [job for job in self.jobs if not job.done()]
        if len(self.jobs) > 1:
            return False
        if self.thread is None:
            from concurrent.futures import ThreadPoolExecutor

            self.thread = ThreadPoolExecutor(1, thread_name_prefix="contfric-advance")
        self.jobs.append(self.thread.submit(self._run, function))
        return True

    def _run(self, function: Callable[[], object]) -> None:
        _HERE.set(self)
        _BESIDE.set(True)
        # what is around a result counts nothing; who wants it where it ends in an error sees the error
        with suppress(Exception, KeyboardInterrupt), count_apart():
            function()

    def close(self) -> None:
        """Stop what nobody waits for any more: at the next call of a kernel."""
        self.unwanted.set()
        if self.thread is not None:
            self.thread.shutdown(wait=True, cancel_futures=True)


_HERE: ContextVar[_Advance | None] = ContextVar("contfric_advance", default=None)
_BESIDE: ContextVar[bool] = ContextVar("contfric_beside", default=False)


@contextmanager
def in_advance() -> Iterator[None]:
    """Let calls be begun in advance while the block runs, where there is a second core for it."""
    if _HERE.get() is not None or _BESIDE.get() or processors() < 2:
        yield
        return
    advance = _Advance()
    token = _HERE.set(advance)
    try:
        yield
    finally:
        _HERE.reset(token)
        advance.close()


@contextmanager
def cores_are_busy() -> Iterator[None]:
    """Begin nothing in advance while the block runs: it is one of many tasks, which have all cores."""
    token, outer = _BESIDE.set(True), _HERE.set(None)
    try:
        yield
    finally:
        _HERE.reset(outer)
        _BESIDE.reset(token)


def foresee(function: Callable[P, object], *args: P.args, **kwargs: P.kwargs) -> bool:
    """Begin a function in advance: foreseeable calls in it are found by those who make the same ones.

    Returns
    -------
    bool
        False if it is not begun: nothing is worth it yet, or enough has been.
    """
    advance = _HERE.get()
    if advance is None or not advance.lasts or _BESIDE.get():
        return False
    return advance.submit(lambda: function(*args, **kwargs))


def heed() -> None:
    """Give up what is computed in advance where nobody wants it any more; to be called between kernels.

    Raises
    ------
    KeyboardInterrupt
        As Ctrl-C would.
    """
    if _BESIDE.get():
        advance = _HERE.get()
        if advance is not None and advance.unwanted.is_set():
            raise KeyboardInterrupt


def foreseeable(*, without: tuple[str, ...] = ()) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Mark a function that may be computed in advance: it is pure, and what it takes is data.

    Parameters
    ----------
    without : names of arguments that do not matter to the result
    """

    def mark(function: Callable[P, R]) -> Callable[P, R]:
        signature = inspect.signature(function)
        name = f"{function.__module__}.{function.__qualname__}"

        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            advance = _HERE.get()
            if advance is None or not advance.lasts:
                return function(*args, **kwargs)
            bound = signature.bind(*args, **kwargs)
            bound.apply_defaults()
            asked = {k: v for k, v in bound.arguments.items() if k not in without}
            try:
                key = digest_of(Writer().bytes_of([name, asked]))
            except UnstorableError:
                return function(*args, **kwargs)
            if _BESIDE.get():
                return _begun(advance, key, lambda: function(*args, **kwargs))
            with advance.lock:
                future = advance.begun.get(key)
                advance.begun[key] = None  # a result is handed out once: it may be changed
            if future is None:
                return function(*args, **kwargs)
            return _waited_for(advance, future, lambda: function(*args, **kwargs))

        return call

    return mark


def _begun(advance: _Advance, key: bytes, compute: Callable[[], R]) -> R:
    """Compute a result in advance, with what it adds to the counts; no more where it is wanted already."""
    from concurrent.futures import Future

    future: Future[Any] = Future()
    with advance.lock:
        known = key in advance.begun
        if known and advance.begun[key] is None:
            raise _WantedAlreadyError
        if not known:
            advance.begun[key] = future
    if known:
        return compute()
    try:
        with count_apart() as added:
            result = compute()
    except BaseException as error:
        future.set_exception(error)
        raise
    future.set_result((result, added))
    return result


def _waited_for(advance: _Advance, future: Future[Any], compute: Callable[[], R]) -> R:
    """Return a result that has been begun; one that ends in an error is computed here."""
    from concurrent.futures import TimeoutError as NotYet

    while True:
        try:
            result, added = future.result(_LOOKS)
        except NotYet:
            continue
        except KeyboardInterrupt:  # the other thread ends what it has, as this one would
            advance.unwanted.set()
            result, added = future.result()
        except Exception:
            return compute()
        added()
        return result  # type: ignore[no-any-return]
