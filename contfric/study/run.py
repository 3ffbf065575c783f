"""Running a study: each step of its plan, and whatever happens, what was found is kept."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from contfric.atlas.diagram import Diagram
from contfric.continuation.events import EndReason
from contfric.errors import ContfricError, ResultFileError, path_of
from contfric.orbit.counts import Counts, counts
from contfric.orbit.orbit import Orbit
from contfric.results import save
from contfric.study import responses
from contfric.study.checkpoint import (
    TILES,
    Checkpoint,
    check_unfinished,
    checkpoint_in,
    goes_on,
    key_of,
)
from contfric.study.compute import (
    compile_continuation,
    continue_from,
    explore_from,
    find_start,
    lyapunov_from,
    one_branch,
    plane_from,
    was_interrupted,
)
from contfric.study.findings import Findings
from contfric.study.folder import Folder, open_folder
from contfric.study.plan import (
    BIFURCATIONS,
    BRANCH,
    CURVES,
    DIAGRAM,
    LYAPUNOV,
    LYAPUNOV_TABLE,
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
from contfric.study.result import RunStatus, StudyResult, UnwrittenError
from contfric.study.schema import ContinueTask, ExploreTask

if TYPE_CHECKING:
    from contfric.atlas.plane import Plane
    from contfric.chaos.map import LyapunovMap

Progress = Callable[[str], None]
_T = TypeVar("_T")


def run_study(
    study: str | Path | Study,
    out: str | Path | None = None,
    *,
    force: bool = False,
    progress: Progress | None = None,
) -> StudyResult:
    """Compute what a study wants, and nothing else, and write the results.

    Ctrl-C ends the computation; what was found until then is written, and the status says so. While a run
    goes on its folder holds a checkpoint: after Ctrl-C, or if the process was killed, the same call goes on
    from it, and ends with the files of a run that was not disturbed.

    Parameters
    ----------
    study : str, Path or Study
        A path, or the name of a bundled study.
    out : str or Path, optional
        Folder of the results; by default the study's name, in the current folder.
    force : bool
        Whether results of an earlier run in that folder, or the checkpoint of another one, may be replaced.
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
    path = Path(study.name) if out is None else path_of("the folder of the results", out)
    key = key_of(study)
    check_unfinished(path, key, force)
    folder = open_folder(path, plan.files, force or goes_on(path, key))
    return _Run(plan, folder, checkpoint_in(folder.path, key), progress).run()


@dataclass(eq=False)
class _Run:
    """State of one run."""

    plan: Plan
    folder: Folder
    checkpoint: Checkpoint
    progress: Progress | None
    status: RunStatus = RunStatus.DONE
    found: Findings = field(default_factory=Findings)
    timings: dict[str, float] = field(default_factory=dict)
    written: list[str] = field(default_factory=list)
    failures: list[Exception] = field(default_factory=list)
    goes_on: bool = False
    before: Counts = field(default_factory=counts)

    @property
    def study(self) -> Study:
        return self.plan.study

    def say(self, text: str) -> None:
        if self.progress is not None:
            self.progress(text)

    def run(self) -> StudyResult:
        self.folder.remove_leftovers(self.plan.files)
        if self.checkpoint.earlier:
            self.say(f"goes on: {self.checkpoint.earlier} results of the run before are kept")
        try:
            with self.checkpoint.kept():
                self._compute()
        except KeyboardInterrupt:
            self.status = RunStatus.INTERRUPTED
        except BaseException as error:
            self._rescue(error)
            raise
        if self.found.empty:
            self.goes_on = self.checkpoint.leave()
            self.folder.discard_if_empty()
            return self._result({})
        self._write_all()
        record = self._write_record()
        if self.status is RunStatus.DONE:
            self.checkpoint.done()
        else:
            self.goes_on = self.checkpoint.leave()
        result = self._result(record)
        if self.failures:
            raise UnwrittenError(self._failure_text(), result) from self.failures[0]
        self.folder.remove_stale(self.written)
        return result

    def _compute(self) -> None:
        study = self.study
        if study.task is not None:
            compile_continuation()
        if study.content.needs_orbit:
            orbit = self._timed(StepName.ORBIT, lambda: find_start(study, self.say))
            self.found.orbit = orbit
            self.say(f"orbit: {orbit.name} over {orbit.periods} period(s)")
            self._follow(orbit)
        self._find_plane()
        grid = study.content.lyapunov
        if grid is not None:
            tiles = self.folder.path / TILES
            lmap = self._timed(
                StepName.LYAPUNOV, lambda: lyapunov_from(study, grid, tiles, self.say)
            )
            self.found.lyapunov = lmap
            if not lmap.complete:
                self.status = RunStatus.INTERRUPTED
                return
        self._respond()

    def _respond(self) -> None:
        """Compute the simulated responses; what an interrupt leaves of one is kept."""
        for key, task in responses.tasks_of(self.study.content).items():
            tiles = self.folder.path / f"{key}-tiles"
            step = partial(responses.compute, self.study, key, task, tiles, self.say)
            found = self._timed(StepName(key), step)
            self.found.responses[key] = found
            if not found.complete:
                self.status = RunStatus.INTERRUPTED
                return

    def _find_plane(self) -> None:
        study, orbit, task = self.study, self.found.orbit, self.study.content.plane
        if task is None or orbit is None:
            return
        plane = self._timed(StepName.PLANE, lambda: plane_from(study, orbit, task, self.say))
        self.found.plane = plane
        if EndReason.INTERRUPTED.value in plane.notes:
            raise KeyboardInterrupt

    def _follow(self, orbit: Orbit) -> None:
        study, task = self.study, self.study.task
        if isinstance(task, ExploreTask):
            found = self._timed(
                StepName.EXPLORE, lambda: explore_from(study, orbit, task, self.say)
            )
            self._keep(found)
        elif isinstance(task, ContinueTask):
            branch = self._timed(
                StepName.CONTINUE, lambda: continue_from(study, orbit, task, self.say)
            )
            self.found.branch = branch
            self._keep(one_branch(branch, (task.range[0], task.range[1])))

    def _keep(self, found: Diagram) -> None:
        self.found.diagram = found if found.branches else None
        if was_interrupted(found):
            raise KeyboardInterrupt

    def _timed(self, name: StepName, step: Callable[[], _T]) -> _T:
        start = time.perf_counter()
        try:
            return step()
        finally:
            self.timings[name.value] = time.perf_counter() - start

    def _rescue(self, error: BaseException) -> None:
        """Save the orbit if there is one, and let the message say so."""
        orbit = self.found.orbit
        if orbit is None:
            self.folder.discard_if_empty()
            return
        path = self.folder.free_name("orbit-of-failed-run", ".npz")
        try:
            save(orbit, path)
        except ResultFileError:
            return
        if isinstance(error, ContfricError):
            error.args = (f"{error} (the orbit {orbit.name} found before is in {path})",)

    def _write_all(self) -> None:
        found, unfinished = self.found, self.study.task is not None and self.found.diagram is None
        self._timed(StepName.TABLES, lambda: self._write_tables(unfinished))
        self._timed(StepName.DATA, self._write_data)
        if self.study.drawings:
            self._timed(StepName.FIGURES, lambda: self._draw(found))
        self.say(f"written to {self.folder.path}")

    def _write_tables(self, unfinished: bool) -> None:
        from contfric.study.tables import write_bifurcations, write_points, write_table

        orbit, diagram = self.found.orbit, self.found.diagram
        if orbit is not None and not unfinished:
            sources = diagram.branches if diagram else (orbit,)
            self._write(POINTS, lambda path: write_points(path, self.study, sources))
        if diagram is not None:
            self._write(BIFURCATIONS, lambda path: write_bifurcations(path, diagram))
        self._write_plane_tables(self.found.plane, self.found.lyapunov)
        if self.found.responses:
            from contfric.study.tables_response import header_of, rows_of
        for key, found in self.found.responses.items():
            header, rows = header_of(found), rows_of(found)
            self._write(responses.FILES[key].table, partial(write_table, header=header, rows=rows))

    def _write_plane_tables(self, plane: Plane | None, lmap: LyapunovMap | None) -> None:
        from contfric.study import tables_plane

        if plane is not None:
            self._write(CURVES, lambda path: tables_plane.write_curves(path, plane))
            self._write(SPECIAL, lambda path: tables_plane.write_special(path, plane))
            self._write(REGIONS, lambda path: tables_plane.write_regions(path, plane))
        if lmap is not None:
            self._write(LYAPUNOV_TABLE, lambda path: tables_plane.write_motions(path, lmap))

    def _write_data(self) -> None:
        found = self.found
        whole = None if found.branch is not None else found.diagram  # a branch is its own diagram
        for name, result in (
            (ORBIT, found.orbit),
            (BRANCH, found.branch),
            (DIAGRAM, whole),
            (PLANE, found.plane),
            (LYAPUNOV, found.lyapunov),
            *((responses.FILES[key].data, x) for key, x in found.responses.items()),
        ):
            if result is not None:
                self._write(name, partial(save, result))

    def _draw(self, found: Findings) -> None:
        from contfric.study.paint import can_be_drawn, paint

        title = self.study.title
        shown = (d for d in self.study.drawings if can_be_drawn(d.kind, found))
        for drawing in shown:
            self._write(drawing.file, partial(paint, drawing=drawing, found=found, title=title))

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

    def _write_record(self) -> dict[str, Any]:
        from contfric.study.record import record_of, write_record

        work = counts() - self.before
        record = record_of(self.plan, work, self.timings, self.found)
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
            self.found.orbit,
            self.found.branch,
            self.found.diagram,
            self.found.plane,
            self.found.lyapunov,
            record,
            tuple(self.folder.path / name for name in self.written),
            self.goes_on,
            self.found.responses,
        )


def _one_line(error: Exception) -> str:
    return str(error) if isinstance(error, ContfricError) else f"{type(error).__name__}: {error}"
