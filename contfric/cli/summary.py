"""A run in words: its record as text."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

Record = dict[str, Any]


def headline(record: Record) -> Iterator[str]:
    """Yield the title, the status and the start."""
    yield f"{record['name']}: {record['title']}"
    yield f"status    {record['status']}; contfric {record['contfric']}, {record['date']}"
    start = record.get("start")
    if start is None:
        return
    values = ", ".join(f"{name} = {value:g}" for name, value in start["params"].items())
    yield f"start     {start['signature']} over {start['periods']} period(s), {values}"
    yield f"          {start['segments']}"


def findings(record: Record) -> Iterator[str]:
    """Yield branches, bifurcations and loose ends as tables; and what the map holds."""
    if "branches" in record:
        yield from _diagram(record)
    if "lyapunov" in record:
        yield ""
        yield from _map(record["lyapunov"])
    for key, lines in (
        ("sweep", _sweep),
        ("poincare", _points),
        ("basins", _basins),
        ("equilibria", _equilibria),
        ("ensemble", _ensemble),
    ):
        if key in record:
            yield ""
            yield from lines(record[key])


def _grid(entry: Record) -> str:
    sides = (f"{n} {low:g} to {high:g} ({k})" for n, (low, high, k) in entry["grid"].items())
    return " x ".join(sides)


def _map(entry: Record) -> Iterator[str]:
    found = ", ".join(f"{count} {motion}" for motion, count in entry["motions"].items())
    yield f"exponents at {_grid(entry)}, {entry['starts']} start(s) each: {found}"
    yield f"largest   {entry['largest']:.6g}"
    if not entry["complete"]:
        yield "incomplete: the same command goes on from the finished tiles"


def _points(entry: Record) -> Iterator[str]:
    yield f"{entry['points']} points of a solution at {entry['section']}"


def _basins(entry: Record) -> Iterator[str]:
    yield f"basins at {_grid(entry)}"
    rows = [["", "starts", "share", "95 % interval"]]
    for s in entry["shares"]:
        interval = f"{s['low']:.2%} to {s['high']:.2%}"
        rows.append([s["name"], str(s["count"]), f"{s['share']:.2%}", interval])
    yield from table(rows)
    if not entry["complete"]:
        yield "incomplete: the same command goes on from the finished tiles"


#: Events and classes that the summary lists; the record has all of them.
_MOST = 12


def _ensemble(entry: Record) -> Iterator[str]:
    low, high = entry["range"]
    varied = "; ".join(f"{name} {text}" for name, text in entry["distributions"].items())
    found = ", ".join(f"{count} {outcome}" for outcome, count in entry["outcomes"].items())
    name = entry["parameter"]
    yield f"ensemble of {entry['samples']} diagrams, {name} from {low:g} to {high:g}: {found}"
    yield f"random    {varied}"
    events, classes = entry["events"], entry["classes"]
    rows = [["event", "share", f"{name} (5 %)", "median", "95 %"]]
    for e in events[:_MOST]:
        rows.append([e["label"], f"{e['share']:.1%}", *(f"{q:.6g}" for q in e["quantiles"])])
    yield from table(rows)
    rows = [["share", "95 % interval", "list of events"]]
    for c in classes[:_MOST]:
        interval = f"{c['low']:.1%} to {c['high']:.1%}"
        rows.append([f"{c['share']:.1%}", interval, ", ".join(c["events"]) or "none"])
    yield from table(rows)
    left = max(0, len(events) - _MOST), max(0, len(classes) - _MOST)
    if any(left):
        yield f"and {left[0]} rarer events, {left[1]} rarer classes, which run.json has"
    if not entry["complete"]:
        yield "incomplete: the same command goes on from the finished tiles"


def _equilibria(entry: Record) -> Iterator[str]:
    low, high = entry["range"]
    name = entry["parameter"]
    yield f"equilibria for {name} from {low:g} to {high:g}"
    rows = [["branch", "modes", "points", name, "", "ends"]]
    for number, b in enumerate(entry["branches"]):
        span = [f"{b['from']:.8g}", f"{b['to']:.8g}"]
        modes, ends = ", ".join(b["modes"]), "; ".join(b["ends"])
        rows.append([str(number), modes, str(b["points"]), *span, ends])
    yield from table(rows)
    if entry["sets"]:
        yield f"{entry['sets']} whole sets of equilibria, which are not followed"
    if entry["events"]:
        events = [["event", name, "meaning"]]
        events += [[e["label"], f"{e['value']:.13g}", e["meaning"]] for e in entry["events"]]
        yield from table(events)
    if not entry["complete"]:
        yield "incomplete: the search was stopped before it was done"


def _sweep(entry: Record) -> Iterator[str]:
    low, high, count = entry["values"]
    found = ", ".join(f"{number} {outcome}" for outcome, number in entry["outcomes"].items())
    points = ", ".join(f"{number} {direction}" for direction, number in entry["points"].items())
    yield f"sweep at {count} values of {entry['parameter']} from {low:g} to {high:g}: {found}"
    yield f"points    {points}"
    if not entry["complete"]:
        yield "incomplete: the same command goes on from what was found"


def _diagram(record: Record) -> Iterator[str]:
    name = record["parameter"]
    rows = [["branch", "name", "points", name, "", "ends"]]
    for branch in record["branches"]:
        if branch["mirrored"]:
            rows[-1][1] += " and mirror"
            continue
        label = branch["signature"] + (" (bridge)" if branch["bridge"] else "")
        number, points = str(branch["branch"]), str(branch["points"])
        low, high = f"{branch['from']:.8g}", f"{branch['to']:.8g}"
        ends = "; ".join(branch["ends"])
        rows.append([number, label, points, low, high, ends])
    yield ""
    yield from table(rows)
    yield from _bifurcations(record)
    yield ""
    if record["loose_ends"]:
        yield "unresolved branch ends (loose ends)"
        yield from (f"  {text}" for text in record["loose_ends"])
    else:
        yield "no loose ends"
    yield from (f"note: {text}" for text in record.get("notes", []))
    yield from record.get("verification", [])
    if not record["complete"]:
        yield "incomplete: the exploration was stopped before it was done"


def _bifurcations(record: Record) -> Iterator[str]:
    name = record["parameter"]
    names = {branch["branch"]: branch["signature"] for branch in record["branches"]}
    rows = [["event", name, "branches", ""]]
    for event in record["bifurcations"]:
        joined = ", ".join(f"{names[i]} ({i})" for i in event["branches"])
        says = event.get("scenario") or ""
        rows.append([event["label"], f"{event['params'][name]:.13g}", joined, says])
    yield ""
    yield from table(rows)


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


def table(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yield rows as lines with aligned columns."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        yield "  ".join(cells).rstrip()
