"""Messages while kernels are compiled: which, how long it will take, and how long it took.

The times of this machine are kept in the cache. A kernel that was never compiled here takes what it took on
the machine of :mod:`contfric.compiling.compile_seconds`, times what other kernels took here against there.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from logging import Logger
from pathlib import Path
from time import perf_counter
from typing import Any

from numba.core.event import Listener, install_listener

from contfric.base.files import replacing
from contfric.base.interrupts import held_back
from contfric.base.resources import user_cache
from contfric.compiling.compile_seconds import OTHER, SECONDS
from contfric.compiling.kept import writable
from contfric.errors import ResultFileError

#: Kernels of models have the digest of the model in their names; another model's take about as long.
_OF_A_MODEL = re.compile(r"^contfric_model_\w+")


@contextmanager
def announced(name: str, folder: Path, log: Logger) -> Iterator[None]:
    """Log what the block compiles, and its time; nothing where it is loaded.

    Parameters
    ----------
    name : of the kernel
    folder : that its code is kept in
    """
    with held_back() as raise_now:
        passes = _BetweenPasses(raise_now, partial(_say, name, folder, log))
        with install_listener("numba:run_pass", passes):
            try:
                yield
            finally:
                took = passes.seconds()
        if took is not None:
            _done(name, took, log)


@contextmanager
def timed(name: str, folder: Path, log: Logger) -> Iterator[None]:
    """Log what the block compiles without numba's compiler, and its time."""
    _say(name, folder, log)
    began = perf_counter()
    yield
    _done(name, perf_counter() - began, log)


def _done(name: str, took: float, log: Logger) -> None:
    log.info("compiled %s: %.1f s", name, took, extra={"seconds": took})
    _keep(name, took)


def _say(name: str, folder: Path, log: Logger) -> None:
    how_often = "once" if writable(folder) else "in every process"
    log.info("compiling %s, %s: %s", name, how_often, time_of(name))


class _BetweenPasses(Listener):  # type: ignore[misc]
    """Lets Ctrl-C through between the passes of numba's compiler, where nothing is half done.

    The first pass is the sign that something is compiled and not loaded.
    """

    def __init__(self, raise_now: Callable[[], None], begin: Callable[[], None]) -> None:
        self._raise_now, self._begin = raise_now, begin
        self._began: float | None = None

    def on_start(self, event: Any) -> None:
        """Raise what has come; say what is compiled."""
        self._raise_now()
        if self._began is None:
            self._began = perf_counter()
            self._begin()

    def seconds(self) -> float | None:
        """Return how long it took, None if nothing was compiled."""
        return None if self._began is None else perf_counter() - self._began

    def on_end(self, event: Any) -> None:
        """Let the pass end."""


def about(seconds: float) -> str:
    """Return a time to wait, no finer than it is known.

    Examples
    --------
    >>> about(0.2), about(3.4), about(18.0), about(97.0)
    ('about 1 s', 'about 3 s', 'about 20 s', 'about 100 s')
    """
    step = 1 if seconds < 10.0 else (5 if seconds < 60.0 else 10)
    return f"about {max(step, step * round(seconds / step))} s"


def time_of(name: str) -> str:
    """Return how long a kernel will take to compile."""
    return about(expected([name]))


def expected(names: Sequence[str]) -> float:
    """Return the seconds that kernels will take to compile, one after the other."""
    here = _times()
    measured = [k for k in here if k in SECONDS]
    there = sum(SECONDS[k] for k in measured)
    pace = sum(here[k] for k in measured) / there if there > 0.0 else 1.0
    keys = [_key(name) for name in names]
    return sum(here[k] if k in here else pace * SECONDS.get(k, OTHER) for k in keys)


def _key(name: str) -> str:
    return _OF_A_MODEL.sub("model", name)


def _file() -> Path:
    return user_cache() / "compile-times.json"


def _times() -> Mapping[str, float]:
    """Return the seconds that kernels took on this machine when they were compiled last."""
    with suppress(OSError, ValueError):
        found = json.loads(_file().read_text(encoding="utf-8"))
        if isinstance(found, dict) and all(isinstance(v, float) for v in found.values()):
            return found
    return {}


def _keep(name: str, seconds: float) -> None:
    """Keep a time; of two processes that do so at once one may be lost."""
    text = json.dumps({**_times(), _key(name): round(seconds, 2)}, indent=0, sort_keys=True)
    with suppress(OSError, ResultFileError), replacing(_file()) as temporary:
        temporary.write_text(text, encoding="utf-8")


def forget_times() -> None:
    """Delete the times of this machine."""
    _file().unlink(missing_ok=True)
