"""Computing tiles on any executor: what it loses is computed again here, so that nothing is lost."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import (
    FIRST_COMPLETED,
    CancelledError,
    Executor,
    Future,
    ThreadPoolExecutor,
    as_completed,
    wait,
)
from time import monotonic
from typing import Any, TypeAlias, TypeVar

from contfric.chaos.rows import new_stop
from contfric.errors import ParameterError

Progress: TypeAlias = Callable[[str], None]
#: What computes a task: without a second argument until Ctrl-C, with one until that is set.
Compute: TypeAlias = Callable[..., Any]
T = TypeVar("T")
K = TypeVar("K")

#: Tiles that one process has under way for each of its threads: enough that none waits for the next,
#: few enough that an interrupt has little to wait for.
_AHEAD = 2


def processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def check_executor(executor: object) -> None:
    """Check what a user gave as an executor.

    Raises
    ------
    ParameterError
        If it is no executor.
    """
    if executor is not None and not isinstance(executor, Executor):
        raise ParameterError(
            f"executor is a concurrent.futures.Executor, got {type(executor).__name__} (of a dask "
            "client: client.get_executor())"
        )


def compute_all(
    tiles: Mapping[int, T],
    executor: Executor | None,
    say: Progress,
    compute: Compute,
    threads: int | None = None,
) -> Iterator[tuple[int, Any]]:
    """Yield (number, rows) of each tile as it is finished.

    Parameters
    ----------
    compute : returns the rows of a tile
    executor : where the tiles are computed; by default threads of this process, as the kernels run
        without Python's lock
    say : called when the executor has lost tiles
    threads : most threads of this process; one where tiles are Python, which holds the lock

    A tile that fails there (a killed worker, a broken pool, a lost connection) is computed in this
    process; only if that fails, too, is it an error.
    """
    left = dict(tiles)
    if executor is not None:
        lost: dict[int, BaseException] = {}
        yield from _on_executor(left, executor, lost, compute)
        left = {number: tiles[number] for number in sorted(lost)}
        if left:
            why = type(next(iter(lost.values()))).__name__
            say(f"{len(left)} tiles were lost by the executor ({why}): they are computed here")
    if left:
        yield from _on_threads(left, compute, threads or processors())


def _on_executor(
    tiles: Mapping[int, T], executor: Executor, lost: dict[int, BaseException], compute: Compute
) -> Iterator[tuple[int, Any]]:
    numbers: dict[Future[Any], int] = {}
    try:
        for number, tile in tiles.items():
            try:
                numbers[executor.submit(compute, tile)] = number
            except (
                Exception
            ) as error:  # a pool that is broken, or has been shut down, takes no more
                lost[number] = error
        for future in as_completed(numbers):
            try:
                rows = future.result()
            except (Exception, CancelledError) as error:
                lost[numbers[future]] = error
                continue
            yield numbers[future], rows
    finally:
        _cancel(numbers)


def _on_threads(
    tiles: Mapping[int, T], compute: Compute, threads: int
) -> Iterator[tuple[int, Any]]:
    count = min(threads, len(tiles))
    pool = ThreadPoolExecutor(count, thread_name_prefix="contfric-tile")
    waiting = iter(tiles.items())
    running: dict[Future[Any], int] = {}
    stop = new_stop()

    def start(most: int) -> None:
        while len(running) < most and (following := next(waiting, None)) is not None:
            running[pool.submit(compute, following[1], stop)] = following[0]

    try:
        start(count * _AHEAD)
        while running:
            done = _first_done(running)
            number = running.pop(done)
            start(count * _AHEAD)
            yield number, done.result()
    finally:
        stop[0] = 1  # after Ctrl-C nobody waits for what is under way
        pool.shutdown(cancel_futures=True)


def _first_done(running: Iterable[Future[Any]]) -> Future[Any]:
    """Wait for one future that is done.

    (The iterator of ``as_completed``, dropped after its first, would end in the garbage collector, where
    Ctrl-C is lost.)
    """
    return next(iter(wait(running, return_when=FIRST_COMPLETED).done))


def _cancel(futures: Iterable[Future[Any]]) -> None:
    for future in futures:
        future.cancel()


def compute_chains(
    first: Mapping[K, T],
    following: Callable[[K, Any], T | None],
    executor: Executor | None,
    say: Progress,
    compute: Compute,
) -> Iterator[tuple[K, Any]]:
    """Yield (name, rows) of tasks of which each needs the rows of the one before in its chain.

    Parameters
    ----------
    first : first task of each chain
    following : returns the next task of a chain from the rows of the last one; None at its end

    What the executor loses is computed in this process.
    """
    stop = new_stop()
    own = ThreadPoolExecutor(max(1, len(first))) if executor is None else None
    running: dict[Future[Any], tuple[K, T]] = {}

    def submit(name: K, task: T) -> None:
        future: Future[Any] = Future()
        try:
            future = own.submit(compute, task, stop) if own else executor.submit(compute, task)  # type: ignore[union-attr] # one of them is there
        except Exception as error:  # a pool that is broken takes no more
            future.set_exception(error)
        running[future] = name, task

    try:
        for name, task in first.items():
            submit(name, task)
        while running:
            done = _first_done(running)
            name, task = running.pop(done)
            try:
                rows = done.result()
            except (Exception, CancelledError) as error:
                if own is not None:
                    raise
                say(
                    f"a part was lost by the executor ({type(error).__name__}): it is computed here"
                )
                rows = compute(task)
            yield name, rows
            after = following(name, rows)
            if after is not None:
                submit(name, after)
    finally:
        stop[0] = 1
        _cancel(running)
        if own is not None:
            own.shutdown(cancel_futures=True)


class Timer:
    """Says how far a computation is, and when it will be done."""

    def __init__(
        self, total: int, done: int, progress: Progress | None, what: str = "Lyapunov map"
    ) -> None:
        self.what = what
        self.total, self.first, self.done = total, done, done
        self.progress, self.began = progress, monotonic()

    def say(self, text: str) -> None:
        """Say something, if anybody listens."""
        if self.progress is not None:
            self.progress(text)

    def tick(self) -> None:
        """Count a tile, and say what is left."""
        self.done += 1
        if self.progress is None:
            return
        text = f"{self.what}: {self.done} of {self.total} tiles"
        left = self.total - self.done
        if left:
            each = (monotonic() - self.began) / (self.done - self.first)
            text += f", {self.done / self.total:.0%}, about {duration(each * left)} left"
        self.say(text)


def duration(seconds: float) -> str:
    """Return a time as people say it.

    Examples
    --------
    >>> duration(4.2), duration(250), duration(8000)
    ('4 s', '4 min 10 s', '2 h 13 min')
    """
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
