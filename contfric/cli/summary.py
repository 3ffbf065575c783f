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


def proposals(record: Record) -> Iterator[str]:
    """Yield what was proposed to follow each event, and what became of it."""
    events = [event for event in record.get("bifurcations", []) if event["proposals"]]
    if not events:
        return
    name = record["parameter"]
    yield ""
    yield "what was proposed to follow the events"
    for event in events:
        yield f"  {event['label']} at {name} = {event['params'][name]:.10g}"
        for item in event["proposals"]:
            branch = "" if item["branch"] is None else f" as branch {item['branch']}"
            why = f": {item['why']}" if item["why"] else ""
            yield f"    {item['verdict']}{branch}: {item['reason']}{why}"


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
