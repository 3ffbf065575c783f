"""What a study will compute, step by step, and what it will not, and why."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

from contfric.study import responses
from contfric.study.read import Study
from contfric.study.schema import (
    ContinueTask,
    ExploreTask,
    LyapunovTask,
    PlaneTask,
    Want,
    row_name,
)

RECORD = "run.json"
POINTS = "points.csv"
BIFURCATIONS = "bifurcations.csv"
ORBIT = "orbit.npz"
BRANCH = "branch.npz"
DIAGRAM = "diagram.npz"
#: Written by ``contfric view``; a new run removes it, as it shows the old one.
VIEW = "diagram.html"
#: Written by ``contfric certify``; a new run removes it, too.
CERTIFICATE = "certificate.json"
LYAPUNOV = "lyapunov.npz"
LYAPUNOV_TABLE = "lyapunov.csv"
PLANE = "plane.npz"
CURVES = "curves.csv"
SPECIAL = "special.csv"
REGIONS = "regions.csv"
_TABLES = (POINTS, BIFURCATIONS, CURVES, SPECIAL, REGIONS, LYAPUNOV_TABLE)
#: Files that every run may write, figures apart.
_RESPONSES = tuple(name for f in responses.FILES.values() for name in (f.table, f.data))
RESULT_FILES = (
    RECORD,
    *_TABLES,
    ORBIT,
    BRANCH,
    DIAGRAM,
    VIEW,
    CERTIFICATE,
    PLANE,
    LYAPUNOV,
    *_RESPONSES,
)


class StepName(str, Enum):
    """The steps of a run, in their order."""

    ORBIT = "orbit"
    EXPLORE = "explore"
    CONTINUE = "continue"
    PLANE = "plane"
    LYAPUNOV = "lyapunov"
    SWEEP = "sweep"
    POINCARE = "poincare"
    BASINS = "basins"
    EQUILIBRIA = "equilibria"
    ENSEMBLE = "ensemble"
    TABLES = "tables"
    DATA = "data"
    FIGURES = "figures"
    RECORD = "record"


@dataclass(frozen=True)
class Step:
    """One step: what it does, and the files that it writes."""

    name: StepName
    does: str
    files: tuple[str, ...] = ()


@dataclass(frozen=True)
class Skipped:
    """Something that is not computed, loaded or written, and why."""

    what: str
    why: str

    def __str__(self) -> str:
        return f"{self.what}: {self.why}"


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
            lines.append(f"{number}. {step.name.value}: {step.does}")
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
    >>> [step.name.value for step in make_plan(read_study("fig05")).steps]
    ['orbit', 'explore', 'tables', 'data', 'figures', 'record']
    """
    return Plan(study, tuple(_steps(study)), tuple(_skipped(study)))


def _steps(study: Study) -> Iterator[Step]:
    task = study.task
    if study.content.needs_orbit:
        yield Step(StepName.ORBIT, _start_text(study))
    if task is not None:
        name = StepName.EXPLORE if isinstance(task, ExploreTask) else StepName.CONTINUE
        yield Step(name, _task_text(study, task))
    if study.content.plane is not None:
        yield Step(StepName.PLANE, _plane_text(study.content.plane))
    if study.content.lyapunov is not None:
        yield Step(StepName.LYAPUNOV, _lyapunov_text(study.content.lyapunov))
    for key, task_of_key in responses.tasks_of(study.content).items():
        yield Step(StepName(key), responses.text_of(task_of_key))
    yield Step(StepName.TABLES, _tables_text(study), _table_files(study))
    yield Step(StepName.DATA, "all that a restart needs", _data_files(study))
    if study.drawings:
        shown = [
            f"{d.kind.value} ({', '.join(map(row_name, d.rows))})" if d.rows else d.kind.value
            for d in study.drawings
        ]
        files = tuple(drawing.file for drawing in study.drawings)
        yield Step(StepName.FIGURES, ", ".join(shown), files)
    yield Step(StepName.RECORD, "version, study, counts, timings, what was skipped", (RECORD,))


def _start_text(study: Study) -> str:
    start = study.content.start
    if study.orbit is not None:
        return f"read from {start.orbit}"
    if study.signature is not None:
        return f"solve for the signature {study.signature.name or study.signature}"
    text = "simulate until the motion repeats itself, read off its signature, solve for it"
    if start.simulate and start.simulate.state is not None:
        text += f"; from the state {start.simulate.state}"
    if start.simulate and start.simulate.periods is not None:
        text += f"; {start.simulate.periods} period(s)"
    return text


def _task_text(study: Study, task: ExploreTask | ContinueTask) -> str:
    low, high = task.range
    where = f"{task.parameter} from {low:g} to {high:g}"
    if isinstance(task, ContinueTask):
        text = f"the branch of the first orbit, {where}"
    else:
        text = f"every branch that can be reached, {where}"
        if task.max_periods is not None:
            text += f", of up to {task.max_periods} period(s)"
        if task.verify:
            text += ", explored again from its own branches"
    for name, value in (task.stop_at or {}).items():
        text += f", to {name} = {value:g}"
    return text + (", with multipliers" if study.wants(Want.STABILITY) else "")


def _plane_text(task: PlaneTask) -> str:
    where = ", ".join(f"{n} from {r[0]:g} to {r[1]:g}" for n, r in task.range.items())
    kinds = "" if task.kinds is None else f" of {', '.join(task.kinds)}"
    return f"every curve{kinds} that can be reached, {where}, and what lives between them"


def _lyapunov_text(task: LyapunovTask) -> str:
    sides = (
        f"{name} from {low:g} to {high:g} ({count:g})"
        for name, (low, high, count) in task.grid.items()
    )
    return f"exponents of motions at {' x '.join(sides)}"


def _tables_text(study: Study) -> str:
    content, parts = study.content, []
    if content.needs_orbit:
        parts.append(f"one row a point: {', '.join(['parameters', *table_quantities(study)])}")
    if study.task is not None:
        parts.append("one row a bifurcation")
    if content.plane is not None:
        parts.append("points of curves, of codimension two, regions")
    if content.lyapunov is not None:
        parts.append("one row a motion of the map")
    parts += [responses.row_text(key) for key in responses.tasks_of(content)]
    return "; ".join(parts)


def _table_files(study: Study) -> tuple[str, ...]:
    content = study.content
    return (
        *((POINTS,) if content.needs_orbit else ()),
        *((BIFURCATIONS,) if study.task is not None else ()),
        *((CURVES, SPECIAL, REGIONS) if content.plane is not None else ()),
        *((LYAPUNOV_TABLE,) if content.lyapunov is not None else ()),
        *(responses.FILES[key].table for key in responses.tasks_of(content)),
    )


def _data_files(study: Study) -> tuple[str, ...]:
    content, task = study.content, study.task
    found: tuple[str, ...] = ()
    if task is not None:
        found = (DIAGRAM if isinstance(task, ExploreTask) else BRANCH,)
    return (
        *((ORBIT,) if content.needs_orbit else ()),
        *found,
        *((PLANE,) if content.plane is not None else ()),
        *((LYAPUNOV,) if content.lyapunov is not None else ()),
        *(responses.FILES[key].data for key in responses.tasks_of(content)),
    )


#: Columns of each quantity.
COLUMNS = {
    Want.EXTREMA: "x_max, x_min",
    Want.ASYMMETRY: "psi",
    Want.STOPS: "stop_1, ...",
    Want.STABILITY: "stable",
}


def table_quantities(study: Study) -> list[str]:
    """Return the columns that a study wants beyond the parameters."""
    found = [columns for want, columns in COLUMNS.items() if study.wants(want)]
    return [*found, *study.content.quantities]


def _skipped(study: Study) -> Iterator[Skipped]:
    start, task = study.content.start, study.task
    if not study.content.needs_orbit:
        yield Skipped("the orbit of the start", "nothing asks for it")
    elif start.simulate is None:
        origin = "a saved orbit" if study.orbit is not None else "a signature"
        yield Skipped("simulation to a steady state", f"the start is {origin}")
    if task is None:
        yield Skipped("continuation", "neither 'explore' nor 'continue' is given")
    elif isinstance(task, ContinueTask):
        yield Skipped("other branches", "'continue' follows one branch only")
    elif task.bridges is False:
        yield Skipped("bridges: branches end where the flow jumps", "switched off (bridges: false)")
    if study.content.needs_orbit:
        yield from _unwanted(study)
    if not study.drawings:
        yield Skipped("matplotlib", "no figures")


def _unwanted(study: Study) -> Iterator[Skipped]:
    task = study.task
    if not study.wants(Want.STABILITY):
        lost = "" if task is None else ", and PD with them"
        yield Skipped(f"multipliers{lost}", "not wanted (stability)")
    for want, columns in COLUMNS.items():
        if want is not Want.STABILITY and not study.wants(want):
            yield Skipped(f"columns {columns}", f"not wanted ({want.value})")
