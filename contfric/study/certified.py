"""The proof of what a run has found: a file next to its results, and a column in its table of events."""

from __future__ import annotations

import csv
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING

from contfric.atlas.diagram import Diagram
from contfric.base.files import write_csv
from contfric.continuation.branch import Branch
from contfric.errors import ResultFileError
from contfric.results import load
from contfric.study.plan import CERTIFICATE
from contfric.study.tasks.branch import BRANCH, one_branch
from contfric.study.tasks.diagram import DIAGRAM
from contfric.study.tasks.one_parameter import BIFURCATIONS

if TYPE_CHECKING:
    from contfric.certify.diagram_certificate import DiagramCertificate
    from contfric.study.run import Progress

#: The column: radius of the ball that holds the parameter, or ``undecided`` with the reason.
COLUMN = "proved"


def certify_folder(
    folder: Path,
    *,
    executor: Executor | None = None,
    time_limit: float | None = None,
    progress: Progress | None = None,
) -> DiagramCertificate:
    """Prove the diagram or the branch in the folder of a run, and write what was proved there.

    Raises
    ------
    ResultFileError
        If the folder holds none, or cannot be written.
    """
    diagram = _diagram_in(folder)
    table = _table(folder / BIFURCATIONS, len(diagram.events))
    found = diagram.certify(executor=executor, time_limit=time_limit, progress=progress)
    found.save(folder / CERTIFICATE)
    header, *rows = table
    kept = [k for k, name in enumerate(header) if name != COLUMN]
    texts = [event.text for event in found.events]
    columns = [[row[k] for k in kept] for row in rows]
    rows = [[*row, text] for row, text in zip(columns, texts, strict=True)]
    write_csv(folder / BIFURCATIONS, [[*(header[k] for k in kept), COLUMN], *rows])
    return found


def _diagram_in(folder: Path) -> Diagram:
    for name in (DIAGRAM, BRANCH):
        if (folder / name).is_file():
            found = load(folder / name)
            if isinstance(found, Branch):
                values = found.values
                found = one_branch(found, (float(values.min()), float(values.max())))
            if isinstance(found, Diagram):
                return found
            raise ResultFileError(f"{folder / name} holds no diagram and no branch")
    raise ResultFileError(f"{folder} holds no diagram: {folder / DIAGRAM} is missing")


def _table(path: Path, count: int) -> list[list[str]]:
    """Return the table of events as text, with its header; each row is an event of the diagram."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.reader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ResultFileError(f"cannot read {path} ({error}): run the study again") from error
    if len(rows) != count + 1 or any(len(row) != len(rows[0]) for row in rows):
        raise ResultFileError(f"{path} is not the table of this diagram: run the study again")
    return rows
