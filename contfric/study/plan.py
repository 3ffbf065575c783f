"""The plan of a study: what it computes, step by step, and what it skips, and why."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from contfric.study.read import Study
from contfric.study.tasks import STEPS, TASKS
from contfric.study.tasks.fit import FITTED, RESIDUALS
from contfric.study.tasks.one_parameter import BIFURCATIONS
from contfric.study.tasks.orbit import POINTS
from contfric.study.tasks.plane import CURVES, REGIONS, SPECIAL
from contfric.study.tasks.task import Skipped
from contfric.study.wanted import COLUMNS, Want, row_name

RECORD = "run.json"
#: Written by ``contfric view``; a new run removes it, as it shows the old one.
VIEW = "diagram.html"
#: Written by ``contfric certify``; a new run removes it, too.
CERTIFICATE = "certificate.json"
_TABLES = (POINTS, BIFURCATIONS, CURVES, SPECIAL, REGIONS, FITTED, RESIDUALS)
#: Files that every run may write, figures apart.
RESULT_FILES = (
    *(RECORD, *_TABLES, VIEW, CERTIFICATE),
    *dict.fromkeys(task.saved_as for task in STEPS),
    *(f"{task.name}.csv" for task in TASKS),
)


@dataclass(frozen=True)
class Step:
    """One step: its name, what it does, and the files that it writes."""

    name: str
    does: str
    files: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Plan:
    """The steps of a study and what it leaves out."""

    study: Study
    steps: tuple[Step, ...]
    skipped: tuple[Skipped, ...]

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the files that a run writes, in their order."""
        return tuple(file for step in self.steps for file in step.files)

    def __str__(self) -> str:
        study = self.study
        values = ", ".join(f"{name} = {value:g}" for name, value in study.params.items())
        what = "start at" if study.content.needs_orbit else "parameters"
        lines = [f"{study.name}: {study.title}", f"model {study.model.name}, {what} {values}", ""]
        for number, step in enumerate(self.steps, start=1):
            lines.append(f"{number}. {step.name}: {step.does}")
            if step.files:
                lines.append(f"   -> {', '.join(step.files)}")
        if self.skipped:
            lines += ["", "skipped:", *(f"- {item}" for item in self.skipped)]
        return "\n".join(lines)


def make_plan(study: Study) -> Plan:
    """Return what a study computes and what it skips; nothing is computed.

    Examples
    --------
    >>> from contfric.study import read_study
    >>> [step.name for step in make_plan(read_study("fig05")).steps]
    ['orbit', 'explore', 'tables', 'data', 'figures', 'record']
    """
    return Plan(study, tuple(_steps(study)), tuple(_skipped(study)))


def _steps(study: Study) -> Iterator[Step]:
    tasks = study.tasks
    for task in tasks:
        yield Step(task.name, task.does(study))
    texts = "; ".join(text for task in tasks if (text := task.rows_text(study)))
    yield Step("tables", texts, tuple(file for task in tasks for file in task.tables(study)))
    saved = tuple(task.saved_as for task in tasks)
    yield Step("data", "all that a restart needs", saved)
    if study.drawings:
        shown = [
            f"{d.kind} ({', '.join(map(row_name, d.rows))})" if d.rows else d.kind
            for d in study.drawings
        ]
        files = tuple(drawing.file for drawing in study.drawings)
        yield Step("figures", ", ".join(shown), files)
    yield Step("record", "version, study, counts, timings, what was skipped", (RECORD,))


def _skipped(study: Study) -> Iterator[Skipped]:
    if not study.content.needs_orbit:
        yield Skipped("the orbit of the start", "nothing asks for it")
    for task in study.tasks:
        yield from task.skipped(study)
    if study.task is None:
        yield Skipped("continuation", "neither 'explore' nor 'continue' is given")
    if study.content.needs_orbit:
        yield from _unwanted(study)
    if not study.drawings:
        yield Skipped("matplotlib", "no figures")


def _unwanted(study: Study) -> Iterator[Skipped]:
    if not study.wants(Want.STABILITY):
        lost = "" if study.task is None else ", and PD with them"
        yield Skipped(f"multipliers{lost}", "not wanted (stability)")
    for want, columns in COLUMNS.items():
        if want is not Want.STABILITY and not study.wants(want):
            yield Skipped(f"columns {columns}", f"not wanted ({want.value})")
