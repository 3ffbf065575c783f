"""Tasks that any process computes to the same bits, and how many of them are finished; kept ones are read.

A task carries numbers and the model's name. A model that is not known by its name is carried as it is; each
process keeps it, so that what belongs to it (the tables of its transitions) is made once.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Any, Generic, TypeVar

from contfric.chaos.running import Compute, Progress, Timer, compute_all
from contfric.errors import ParameterError
from contfric.models import load_model
from contfric.models.definition import Model
from contfric.remember.journal import Parts

R = TypeVar("R")
T = TypeVar("T", bound="TileTask")


class TileTask:
    """A task: a data class whose first field is the model."""

    model: Model

    def __reduce__(self) -> tuple[Any, ...]:
        model, *rest = (getattr(self, field.name) for field in fields(self))  # type: ignore[arg-type]
        return _rebuilt, (type(self), packed(model), *rest)


def _rebuilt(kind: type[TileTask], model: str | bytes, *rest: Any) -> TileTask:
    return kind(unpacked(model), *rest)  # type: ignore[call-arg]


def packed(model: Model) -> str | bytes:
    """Return a model as a task carries it: by its name, or as it is."""
    try:
        if load_model(model.name) is model:
            return model.name
    except ParameterError:
        pass
    return pickle.dumps(model)


@lru_cache(maxsize=16)
def unpacked(model: str | bytes) -> Model:
    """Return the model of a task."""
    found = load_model(model) if isinstance(model, str) else pickle.loads(model)
    assert isinstance(found, Model)
    return found


def put_rows(rows: Any, place: Any, found: Any) -> None:
    """Write the rows of a tile, arrays in a data class, to their place in those of all tiles."""
    # motions last: an interrupt in between must not leave a tile that counts as computed
    for name in sorted((field.name for field in fields(rows)), key="motions".__eq__):
        getattr(rows, name)[place] = getattr(found, name)


@dataclass(frozen=True, eq=False)
class Work(Generic[T, R]):
    """How tasks of one kind are finished.

    Attributes
    ----------
    what : what they are parts of, for messages
    compute : returns the rows of a task
    executor, threads : as :func:`contfric.chaos.running.compute_all` takes them
    prepare : called before any is computed
    here : computes a task in this process, if that is another function
    """

    what: str
    compute: Compute
    executor: Executor | None
    progress: Progress | None
    threads: int | None = None
    prepare: Callable[[], None] = lambda: None
    here: Compute | None = None

    def finish(self, tasks: Sequence[T], put: Callable[[int, R], None]) -> None:
        """Hand the rows of each task to ``put``, by its number; they are kept where a journal is.

        Raises
        ------
        KeyboardInterrupt
            On Ctrl-C; what was finished has been handed over.
        """
        left, kept = {}, Parts(self.what)
        for number, task in enumerate(tasks):
            rows = kept.get(task)
            if rows is None:
                left[number] = task
            else:
                put(number, rows)
        timer = Timer(len(tasks), len(tasks) - len(left), self.progress, self.what)
        if timer.done:
            timer.say(f"{timer.done} of {timer.total} tiles are in {kept.folder} already")
        try:
            if left:
                self.prepare()
            for number, found in compute_all(
                left, self.executor, timer.say, self.compute, self.threads, here=self.here
            ):
                kept.put(tasks[number], found)
                put(number, found)
                timer.tick()
        except KeyboardInterrupt:
            timer.say(f"interrupted: {timer.done} of {timer.total} tiles are finished")
            raise
