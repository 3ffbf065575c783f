"""Running a study: each step of its plan, and whatever happens, what was found is kept."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from contfric.atlas.diagram import Diagram
from contfric.atlas.plane import Plane
from contfric.continuation.branch import Branch
from contfric.continuation.events import EndReason
from contfric.errors import ContfricError, ResultFileError
from contfric.orbit.counts import Counts, counts
from contfric.orbit.orbit import Orbit
from contfric.results import save
from contfric.study.compute import (
    compile_continuation,
    continue_from,
    explore_from,
    find_start,
    one_branch,
    plane_from,
    was_interrupted,
)
from contfric.study.folder import Folder, open_folder
from contfric.study.plan import (
    BIFURCATIONS,
    BRANCH,
    CURVES,
    DIAGRAM,
    ORBIT,
    PLANE,
    POINTS,
    RECORD,
    REGIONS,
    SPECIAL,
    Plan,
    StepName,
    make_plan,
)
from contfric.study.read import Study, read_study
from contfric.study.schema import ContinueTask, ExploreTask

Progress = Callable[[str], None]
_T = TypeVar("_T")


class RunStatus(str, Enum):
    """How a run ended."""

    DONE = "done"
    INTERRUPTED = "interrupted"
    UNWRITTEN = "some files could not be written"


@dataclass(frozen=True, eq=False)
class StudyResult:
    """What a run found and where it is.

    Attributes
    ----------
    study : Study
    out : Path
        The folder of the results.
    status : RunStatus
    orbit : Orbit or None
        The orbit of the start; None if the run was interrupted before it was found.
    branch : Branch or None
        The branch, if the study continues one.
    diagram : Diagram or None
        The diagram, if the study has a task.
    plane : Plane or None
        The plane, if the study has one.
    info : dict
        The content of ``run.json``.
    files : tuple of Path
        The files written.
    """

    study: Study
    out: Path
    status: RunStatus
    orbit: Orbit | None
    branch: Branch | None
    diagram: Diagram | None
    info: dict[str, Any]
    files: tuple[Path, ...]
    plane: Plane | None = None

    def __repr__(self) -> str:
        return f"<StudyResult {self.study.name}: {self.status.value}, in {self.out}>"


class UnwrittenError(ResultFileError):
    """Some files could not be written; ``result`` holds everything that was computed."""

    def __init__(self, message: str, result: StudyResult) -> None:
        super().__init__(message)
        self.result = result


def run_study(
    study: str | Path | Study,
    out: str | Path | None = None,
    *,
    force: bool = False,
    progress: Progress | None = None,
) -> StudyResult:
    """Compute what a study wants, and nothing else, and write the results.

    Ctrl-C ends the computation; what was found until then is written, and the status says so.

    Parameters
    ----------
    study : str, Path or Study
        A path, or the name of a bundled study.
    out : str or Path, optional
        Folder of the results; by default the study's name, in the current folder.
    force : bool
        Whether results of an earlier run in that folder may be replaced.
    progress : callable, optional
        Called with one line of text now and then.

    Raises
    ------
    StudyError
        If the study is not valid.
    ConvergenceError
        If no orbit is found.
    ResultFileError
        If the folder holds results already, or a file cannot be written.

    Examples
    --------
    >>> import contfric as cf
    >>> from tempfile import mkdtemp
    >>> result = cf.run_study("fig05", out=mkdtemp())
    >>> result.diagram.of_kind("SN")[0].params["Omega"]  # doctest: +ELLIPSIS
    0.5419128169...
    """
    if not isinstance(study, Study):
        study = read_study(study)
    plan = make_plan(study)
    folder = open_folder(Path(study.name if out is None else out), plan.files, force)
    return _Run(plan, folder, progress).run()


@dataclass(eq=False)
class _Run:
    """State of one run."""

    plan: Plan
    folder: Folder
    progress: Progress | None
    status: RunStatus = RunStatus.DONE
    orbit: Orbit | None = None
    branch: Branch | None = None
    diagram: Diagram | None = None
    plane: Plane | None = None
    timings: dict[str, float] = field(default_factory=dict)
    written: list[str] = field(default_factory=list)
    failures: list[Exception] = field(default_factory=list)
    before: Counts = field(default_factory=counts)

    @property
    def study(self) -> Study:
        return self.plan.study

    def say(self, text: str) -> None:
        if self.progress is not None:
            self.progress(text)

    def run(self) -> StudyResult:
        try:
            self._compute()
        except KeyboardInterrupt:
            self.status = RunStatus.INTERRUPTED
        except BaseException as error:
            self._rescue(error)
            raise
        if self.orbit is None:
            self.folder.discard_if_empty()
            return self._result({})
        self._write_all(self.orbit)
        record = self._write_record(self.orbit)
        result = self._result(record)
        if self.failures:
            raise UnwrittenError(self._failure_text(), result) from self.failures[0]
        self.folder.remove_stale(self.written)
        return result

    def _compute(self) -> None:
        study = self.study
        if study.task is not None:
            compile_continuation()
        self.orbit = orbit = self._timed(StepName.ORBIT, lambda: find_start(study, self.say))
        self.say(f"orbit: {orbit.name} over {orbit.periods} period(s)")
        task = study.task
        if isinstance(task, ExploreTask):
            found = self._timed(
                StepName.EXPLORE, lambda: explore_from(study, orbit, task, self.say)
            )
            self._keep(found)
        elif isinstance(task, ContinueTask):
            self.branch = self._timed(
                StepName.CONTINUE, lambda: continue_from(study, orbit, task, self.say)
            )
            self._keep(one_branch(self.branch, (task.range[0], task.range[1])))
        surface = study.content.plane
        if surface is not None and self.status is RunStatus.DONE:
            self.plane = self._timed(
                StepName.PLANE, lambda: plane_from(study, orbit, surface, self.say)
            )
            if EndReason.INTERRUPTED.value in self.plane.notes:
                self.status = RunStatus.INTERRUPTED

    def _keep(self, found: Diagram) -> None:
        self.diagram = found if found.branches else None
        if was_interrupted(found):
            self.status = RunStatus.INTERRUPTED

    def _timed(self, name: StepName, step: Callable[[], _T]) -> _T:
        start = time.perf_counter()
        try:
            return step()
        finally:
            self.timings[name.value] = time.perf_counter() - start

    def _rescue(self, error: BaseException) -> None:
        """Save the orbit if there is one, and let the message say so."""
        if self.orbit is None:
            self.folder.discard_if_empty()
            return
        path = self.folder.free_name("orbit-of-failed-run", ".npz")
        try:
            save(self.orbit, path)
        except ResultFileError:
            return
        if isinstance(error, ContfricError):
            error.args = (f"{error} (the orbit {self.orbit.name} found before is in {path})",)

    def _write_all(self, orbit: Orbit) -> None:
        from contfric.study.tables import (
            write_bifurcations,
            write_curves,
            write_points,
            write_regions,
            write_special,
        )

        folder, diagram = self.folder.path, self.diagram
        unfinished = self.study.task is not None and diagram is None
        start = time.perf_counter()
        if not unfinished:
            sources = diagram.branches if diagram else (orbit,)
            self._write(POINTS, lambda path: write_points(path, self.study, sources))
        if diagram is not None:
            self._write(BIFURCATIONS, lambda path: write_bifurcations(path, diagram))
        plane = self.plane
        if plane is not None:
            self._write(CURVES, lambda path: write_curves(path, plane))
            self._write(SPECIAL, lambda path: write_special(path, plane))
            self._write(REGIONS, lambda path: write_regions(path, plane))
        self.timings[StepName.TABLES.value] = time.perf_counter() - start
        start = time.perf_counter()
        self._write(ORBIT, lambda path: save(orbit, path))
        if self.branch is not None:
            branch = self.branch
            self._write(BRANCH, lambda path: save(branch, path))
        elif diagram is not None:
            self._write(DIAGRAM, lambda path: save(diagram, path))
        if plane is not None:
            self._write(PLANE, lambda path: save(plane, path))
        self.timings[StepName.DATA.value] = time.perf_counter() - start
        if self.study.drawings and not unfinished:
            self._timed(StepName.FIGURES, lambda: self._draw(orbit))
        self.say(f"written to {folder}")

    def _draw(self, orbit: Orbit) -> None:
        from contfric.study.paint import paint

        for drawing in self.study.drawings:
            self._write(
                drawing.file,
                partial(
                    paint,
                    drawing=drawing,
                    orbit=orbit,
                    diagram=self.diagram,
                    title=self.study.title,
                    plane=self.plane,
                ),
            )

    def _write(self, name: str, write: Callable[[Path], None]) -> None:
        """Write one file; one that fails does not keep the others from being written."""
        self.say(f"writing {name}")
        try:
            write(self.folder.path / name)
        except KeyboardInterrupt:
            self.status = RunStatus.INTERRUPTED
        except Exception as error:
            self.failures.append(error)
            self.status = RunStatus.UNWRITTEN
        else:
            self.written.append(name)

    def _write_record(self, orbit: Orbit) -> dict[str, Any]:
        from contfric.study.record import record_of, write_record

        work = counts() - self.before
        record = record_of(self.plan, work, self.timings, orbit, self.diagram, self.plane)
        record |= {
            "status": self.status.value,
            "failures": [_one_line(error) for error in self.failures],
            "files": [*self.written, RECORD],
        }
        self._write(RECORD, lambda path: write_record(path, record))
        return record

    def _failure_text(self) -> str:
        reasons = "; ".join(_one_line(error) for error in self.failures)
        kept = f"written to {self.folder.path}: {', '.join(self.written) or 'nothing'}"
        return f"{reasons} ({kept})"

    def _result(self, record: dict[str, Any]) -> StudyResult:
        return StudyResult(
            self.study,
            self.folder.path,
            self.status,
            self.orbit,
            self.branch,
            self.diagram,
            record,
            tuple(self.folder.path / name for name in self.written),
            self.plane,
        )


def _one_line(error: Exception) -> str:
    return str(error) if isinstance(error, ContfricError) else f"{type(error).__name__}: {error}"
