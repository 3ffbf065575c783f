"""A run in words: its record as text."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from contfric.study.tasks import STEPS

Record = dict[str, Any]


def headline(record: Record) -> Iterator[str]:
    """Yield the title and the status."""
    yield f"{record['name']}: {record['title']}"
    yield f"status    {record['status']}; contfric {record['contfric']}, {record['date']}"


def findings(record: Record) -> Iterator[str]:
    """Yield the start, and what each task has found."""
    for task in STEPS:
        yield from task.summary(record)


def work(record: Record) -> Iterator[str]:
    """Yield what was done: counts, times, what was skipped, files."""
    yield ""
    counts = ", ".join(
        f"{value} {name.replace('_', ' ')}" for name, value in record["counts"].items()
    )
    times = ", ".join(f"{name} {seconds:.3g} s" for name, seconds in record["timings"].items())
    yield f"counts    {counts}"
    yield f"times     {times}"
    for index, item in enumerate(record["skipped"]):
        yield f"{'skipped' if index == 0 else '':10}{item['what']}: {item['why']}"
    for failure in record["failures"]:
        yield f"failed    {failure}"
    yield f"files     {', '.join(record['files'])}"
