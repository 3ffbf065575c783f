"""What every test leaves as it has found it."""

from __future__ import annotations

import gc
import signal
import sys
from bisect import bisect_left
from collections.abc import Callable, Generator, Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# A job that a shell starts in the background ignores Ctrl-C, and tests of it would wait for nothing.
signal.signal(signal.SIGINT, signal.default_int_handler)

# Nothing is timed in tests: a draw may be the first to load a model, or the machine busy.
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Keep what is collected out of the search for garbage: all of it stays to the end."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark as slow what `long_tests.txt` lists; a line that names no test is an error of a full run."""
    lines = (Path(__file__).with_name("long_tests.txt")).read_text(encoding="utf-8").splitlines()
    starts = tuple(line for line in lines if line and not line.startswith("#"))
    for item in items:
        if item.nodeid.startswith(starts):
            item.add_marker(pytest.mark.slow)
    if config.args == ["tests"]:
        names = [*sorted(item.nodeid for item in items), ""]
        stale = [s for s in starts if not names[bisect_left(names, s, hi=len(items))].startswith(s)]
        if stale:
            raise pytest.UsageError(f"long_tests.txt names no test in: {stale[0]}")


@pytest.fixture(autouse=True)
def figures_are_closed() -> Iterator[None]:
    """Forget the figures of a test: pyplot warns of many, and which tests share a process is chance."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Write a text to a file of the test's folder, and return its path."""

    def write_file(text: str, name: str = "scene.yaml") -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write_file
