"""Running a study: each step of its plan; results are kept if it is interrupted.

Its folder is never overwritten unasked, and is tried before anything is computed.
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from contfric.base.counts import Counts, counts
from contfric.base.files import remove_leftovers, unwritable
from contfric.errors import ContfricError, ResultFileError, path_of
from contfric.results import save
from contfric.study.checkpoint import Checkpoint, check_unfinished, checkpoint_in, goes_on, key_of
from contfric.study.drawings import draw
from contfric.study.plan import RECORD, RESULT_FILES, Plan, make_plan
from contfric.study.read import Study, read_study
from contfric.study.result import RunStatus, StudyResult, UnwrittenError
from contfric.study.tables import write_table
from contfric.study.tasks.task import Found, Job, Task

Progress = Callable[[str], None]
_T = TypeVar("_T")
#: Files that a message names.
_SHOWN = 4


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

    Returns
    -------
    StudyResult
        ``found`` has the results, ``files`` what was written, ``info`` the record (``run.json``).

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
    found: Found = field(default_factory=dict)
    timings: dict[str, float] = field(default_factory=dict)
    written: list[str] = field(default_factory=list)
    failures: list[Exception] = field(default_factory=list)
    failed: dict[str, ContfricError] = field(default_factory=dict)
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
        if not self.found:
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
        if self.failed:
            text = "; ".join(f"{name}: {error}" for name, error in self.failed.items())
            first = next(iter(self.failed.values()))
            first.args = (f"{text} (all else is written to {self.folder.path})",)
            raise first
        self.folder.remove_stale(self.written)
        return result

    def _compute(self) -> None:
        tasks = self.study.tasks
        for task in tasks:
            task.ahead()
        for task in tasks:
            job = Job(self.study, self.found, self.say)
            try:
                found = self._timed(task.name, partial(task.compute, job))
            except ContfricError as error:
                if not self.found.keys() - {"orbit"}:
                    raise
                self.say(f"{task.name} failed: {error}")
                self.failed[task.name] = error
                self.status = RunStatus.FAILED
                continue
            self.found[task.result] = found
            if task.cut_short(found):
                raise KeyboardInterrupt

    def _timed(self, name: str, step: Callable[[], _T]) -> _T:
        start = time.perf_counter()
        try:
            return step()
        finally:
            self.timings[name] = time.perf_counter() - start

    def _rescue(self, error: BaseException) -> None:
        """Save the orbit if there is one, and let the message say so."""
        orbit = self.found.get("orbit")
        if orbit is None:
            self.folder.discard_if_empty()
            return
        path = self.folder.free_name("orbit-of-failed-run")
        try:
            save(orbit, path)
        except ResultFileError:
            return
        if isinstance(error, ContfricError):
            error.args = (f"{error} (the orbit {orbit.name} found before is in {path})",)

    def _write_all(self) -> None:
        there = [task for task in self.study.tasks if task.result in self.found]
        self._timed("tables", lambda: self._write_tables(there))
        self._timed("data", lambda: self._write_data(there))
        if self.study.drawings:
            self._timed("figures", self._draw)
        self.say(f"written to {self.folder.path}")

    def _write_tables(self, tasks: list[Task]) -> None:
        for task in tasks:
            for name in task.tables(self.study):
                self._write(name, partial(self._write_table, task, name))

    def _write_table(self, task: Task, name: str, path: Path) -> None:
        header, rows = task.table(name, self.study, self.found[task.result])
        write_table(path, header, rows)

    def _write_data(self, tasks: list[Task]) -> None:
        for task in tasks:
            self._write(task.saved_as, partial(save, task.saved(self.found[task.result])))

    def _draw(self) -> None:
        for drawing in self.study.drawings:
            if drawing.task.result in self.found:
                title = self.study.title
                self._write(
                    drawing.file, partial(draw, drawing=drawing, found=self.found, title=title)
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

    def _write_record(self) -> dict[str, Any]:
        from contfric.study.record import record_of, write_record

        work = counts() - self.before
        record = record_of(self.plan, work, self.timings, self.found)
        record |= {
            "status": self.status.value,
            "failures": [_one_line(error) for error in (*self.failed.values(), *self.failures)],
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
            self.found,
            record,
            tuple(self.folder.path / name for name in self.written),
            self.goes_on,
        )


def _one_line(error: Exception) -> str:
    return str(error) if isinstance(error, ContfricError) else f"{type(error).__name__}: {error}"


@dataclass(frozen=True)
class Folder:
    """A folder that is ready to take results: whether this run made it, and what was in it."""

    path: Path
    made: bool
    earlier: tuple[str, ...] = ()

    def discard_if_empty(self) -> None:
        """Remove the folder if this run made it and left nothing in it."""
        if self.made:
            with suppress(OSError):
                self.path.rmdir()

    def remove_stale(self, written: Iterable[str]) -> None:
        """Remove result files of an earlier run that this one has not replaced."""
        kept = {*written, RECORD}
        for name in {*RESULT_FILES, *self.earlier} - kept:
            with suppress(OSError):
                (self.path / name).unlink()

    def remove_leftovers(self, names: Iterable[str]) -> None:
        """Remove the halves of files that a killed run has left."""
        for name in names:
            remove_leftovers(self.path / name)

    def free_name(self, stem: str) -> Path:
        """Return a file name that is not taken yet: ``stem.npz``, ``stem-2.npz``, ..."""
        path, number = self.path / f"{stem}.npz", 2
        while path.exists():
            path, number = self.path / f"{stem}-{number}.npz", number + 1
        return path


def open_folder(path: Path, files: Iterable[str], force: bool) -> Folder:
    """Return a folder for the results of a run; it is made if it does not exist.

    Parameters
    ----------
    files : iterable of str
        Names of the files that the run writes.
    force : bool
        Whether results of an earlier run may be replaced (a run that goes on replaces its own).

    Raises
    ------
    ResultFileError
        If the folder holds results and ``force`` is False, or cannot be written.
    """
    holding = [name for name in dict.fromkeys([*RESULT_FILES, *files]) if (path / name).exists()]
    if holding and not force:
        raise ResultFileError(
            f"{path} holds results of an earlier run ({_first(holding)}): give another folder (--out DIR, "
            "out=...), or replace them (--force, force=True)"
        )
    made = not path.exists()
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as error:
        raise ResultFileError(unwritable(path, error)) from error
    return Folder(path, made, _earlier_files(path))


def _first(names: list[str]) -> str:
    """Return some names for a message."""
    left = len(names) - _SHOWN
    return ", ".join(names[:_SHOWN]) + (f" and {left} others" if left > 0 else "")


def _earlier_files(path: Path) -> tuple[str, ...]:
    """Return the files that the record of an earlier run names, before this run replaces it."""
    try:
        names = json.loads((path / RECORD).read_text(encoding="utf-8"))["files"]
        return tuple(n for n in names if isinstance(n, str) and Path(n).name == n)
    except (OSError, ValueError, KeyError, TypeError):
        return ()
