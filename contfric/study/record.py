"""The record of a run: what was asked, what was done and how often, what was skipped."""

from __future__ import annotations

import json
import platform
import sys
from collections.abc import Mapping
from dataclasses import asdict
from datetime import datetime, timezone
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from contfric.base.files import replacing
from contfric.base.tally import Counts
from contfric.study.plan import Plan
from contfric.study.tasks.task import Found

#: Modules that a run loads only if the study needs them.
WATCHED = ("numba", "matplotlib", "networkx", "scipy.optimize", "pandas", "pydantic", "yaml")


def package_version() -> str:
    """Return the version of contfric; a source folder that is not installed has none."""
    try:
        return version("contfric")
    except PackageNotFoundError:
        return "unknown (not installed)"


def record_of(
    plan: Plan, counts: Counts, timings: Mapping[str, float], found: Found
) -> dict[str, Any]:
    """Return the record of a run as plain data; status and files are added by the run."""
    record: dict[str, Any] = {
        "contfric": package_version(),
        "python": platform.python_version(),
        "date": datetime.now(timezone.utc).isoformat(timespec="seconds"),
        "name": plan.study.name,
        "title": plan.study.title,
        "study": plan.study.as_dict(),
        "counts": asdict(counts),
        "modules": {name: name in sys.modules for name in WATCHED},
        "module_count": len(sys.modules),
        "timings": {name: round(seconds, 6) for name, seconds in timings.items()},
        "skipped": [item._asdict() for item in plan.skipped],
    }
    for task in plan.study.tasks:
        if task.result in found:
            record |= task.entries(found[task.result])
    return record


def write_record(path: Path, record: Mapping[str, Any]) -> None:
    """Write the record as JSON."""
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
