"""Computing tiles on any executor: what it loses is computed again here, so that nothing is lost."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import CancelledError, Executor, Future, ThreadPoolExecutor
from functools import partial
from queue import SimpleQueue
from time import monotonic
from typing import Any, TypeAlias, TypeVar

from contfric.base.memory import processors
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
    tasks: Mapping[K, T],
    executor: Executor | None,
    say: Progress,
    compute: Compute,
    threads: int | None = None,
    following: Callable[[K, Any], T | None] = lambda name, rows: None,
    here: Compute | None = None,
) -> Iterator[tuple[K, Any]]:
    """Yield (name, rows) of each task as it is finished.

    Parameters
    ----------
    executor : where tasks are computed; by default threads of this process, as the kernels run without
        Python's lock
    say : called when the executor has lost tasks
    compute : returns the rows of a task
    threads : most threads of this process; one where tasks are Python, which holds the lock
    following : returns the task that needs the rows of one with a name; None at the end of its chain
    here : computes a task in this process, if that is another function

    A task that fails there (a killed worker, a broken pool, a lost connection) is computed in this process,
    with those that follow it; only if that fails, too, is it an error.
    """
    if executor is not None:
        lost: dict[K, tuple[T, BaseException]] = {}
        yield from _followed(tasks, partial(executor.submit, compute), following, lost)
        if lost:
            why = type(next(iter(lost.values()))[1]).__name__
            say(f"{len(lost)} tiles were lost by the executor ({why}): they are computed here")
        tasks = {name: lost[name][0] for name in tasks if name in lost}
    if not tasks:
        return
    count, stop = min(threads or processors(), len(tasks)), new_stop()
    pool = ThreadPoolExecutor(count, thread_name_prefix="contfric-tile")

    def submit(task: T) -> Future[Any]:
        return pool.submit(here or compute, task, stop)

    try:
        yield from _followed(tasks, submit, following, None, count * _AHEAD)
    finally:
        stop[0] = 1  # after Ctrl-C nobody waits for what is under way
        pool.shutdown(cancel_futures=True)


def _followed(
    tasks: Mapping[K, T],
    submit: Callable[[T], Future[Any]],
    following: Callable[[K, Any], T | None],
    lost: dict[K, tuple[T, BaseException]] | None,
    most: float = math.inf,
) -> Iterator[tuple[K, Any]]:
    """Yield (name, rows) of each task, at ``most`` under way; without a place for the lost ones they fail."""
    waiting = iter(tasks.items())
    running: dict[Future[Any], tuple[K, T]] = {}
    finished: SimpleQueue[Future[Any]] = SimpleQueue()

    def start(name: K, task: T) -> None:
        try:
            future = submit(task)
        except Exception as error:  # a pool that is broken, or has been shut down, takes no more
            if lost is None:
                raise
            lost[name] = task, error
            return
        running[future] = name, task
        future.add_done_callback(finished.put)

    def fill() -> None:
        while len(running) < most and (pair := next(waiting, None)) is not None:
            start(*pair)

    try:
        fill()
        while running:
            name, task = running.pop(done := finished.get())
            fill()
            try:
                rows = done.result()
            except (Exception, CancelledError) as error:
                if lost is None:
                    raise
                lost[name] = task, error
                continue
            yield name, rows
            after = following(name, rows)
            if after is not None:
                start(name, after)
    finally:
        for future in running:
            future.cancel()


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
