"""``ensemble``: diagrams of random parameters."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import nullcontext
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from contfric.base.shown import aligned
from contfric.base.yaml_schema import positive, whole
from contfric.errors import ParameterError, StudyError, checked_range, did_you_mean
from contfric.study.tables import Table, table_of
from contfric.study.tasks.response import Response
from contfric.study.tasks.task import AlongParameter, FigureKind, Job, StudyCheck, incomplete

if TYPE_CHECKING:
    from pathlib import Path

    from contfric.ensembles.ensemble import Ensemble
    from contfric.study.read import Study

#: Events and classes that the summary lists; the record has all of them.
_MOST = 12
#: Events of a class in its line.
_MOST_IN_LINE = 8


class EnsembleTask(Response, AlongParameter):
    """Diagrams of random parameters."""

    name = "ensemble"
    row_text = "one row an event of a sample"
    own = AlongParameter.own | {"distributions", "workers"}
    figures: ClassVar = {"ensemble": FigureKind(9.6, 6.0)}

    distributions: dict[str, list[float] | dict[str, list[float]]] = Field(
        description="a mapping of parameters to [low, high], or to a distribution of scipy.stats with its "
        "arguments, such as {norm: [0.32, 0.01]}"
    )
    samples: int | None = whole("diagrams")
    seed: int | None = whole(least=0)
    row: str | None = Field(None, description="a quantity, of which bands are made")
    values: int | None = whole("values of the parameter for bands", least=2)
    max_step: float | None = positive()
    bridges: bool | None = Field(None, description="true or false")
    max_periods: int | None = whole()
    copies: int | None = whole()
    max_branches: int | None = whole()
    max_points: int | None = whole()
    workers: int | None = whole("processes")

    def check(self, asked: StudyCheck) -> None:
        """Check the range, the distributions and the quantity."""
        from contfric.ensembles.drawing import checked_distributions
        from contfric.quantities.registry import number_quantity

        super().check(asked)
        steps = {
            "range": lambda: checked_range(self.parameter, self.range),
            "distributions": lambda: checked_distributions(
                asked.model, self._distributions(), self.parameter
            ),
            "row": lambda: (
                self.row is None or number_quantity(self.row, asked.model, "an ensemble")
            ),
        }
        for key, step in steps.items():
            asked.attempt((self.name, key), step)
        low, high = self.range
        start = asked.content.params.get(self.parameter)
        if isinstance(start, int | float) and not low <= start <= high:
            asked.fail(
                (self.name, "range"),
                f"an orbit to begin with is looked for at {self.parameter} = {start:g} of 'params', which is "
                f"not between {low:g} and {high:g}",
            )

    def _distributions(self) -> dict[str, Any]:
        """Return the distributions.

        Raises
        ------
        ParameterError
            If scipy.stats has no such distribution, or it does not take these arguments.
        """
        from scipy import stats

        found: dict[str, Any] = {}
        for name, given in self.distributions.items():
            if isinstance(given, list):
                found[name] = tuple(given)
                continue
            known = [n for n in dir(stats) if isinstance(getattr(stats, n), stats.rv_continuous)]
            kind = next(iter(given), None)
            if len(given) != 1 or kind not in known:
                raise ParameterError(
                    f"the distribution of '{name}' is [low, high], or one of scipy.stats with its arguments, "
                    f"such as {{norm: [0.32, 0.01]}}; got {given}{did_you_mean(kind, known)}"
                )
            try:
                found[name] = getattr(stats, kind)(*given[kind])
            except (TypeError, ValueError) as error:
                raise ParameterError(f"the distribution of '{name}', {kind}: {error}") from None
        return found

    def replaced(self) -> dict[str, float]:
        """Return the parameters that are drawn, at their medians."""
        found = self._distributions()
        return {
            n: sum(d) / 2 if isinstance(d, tuple) else float(d.median()) for n, d in found.items()
        }

    def does(self, study: Study) -> str:
        """Return what is varied, in words."""
        return f"diagrams of random {', '.join(self.distributions)}, {self.span}"

    def compute(self, job: Job) -> Ensemble:
        """Compute it, in processes if there are several; a killed run goes on from its tiles."""
        from concurrent.futures import ProcessPoolExecutor
        from multiprocessing import get_context

        workers = self.workers or 1
        spawn = get_context("spawn")
        pool = ProcessPoolExecutor(workers, mp_context=spawn) if workers > 1 else None
        with pool or nullcontext():
            return self.drawn(job.study, executor=pool, progress=job.say)

    def drawn(self, study: Study, **options: Any) -> Ensemble:
        """Compute it for a study, with options of :func:`contfric.ensemble` in place of the task's."""
        from contfric.ensembles.compute import ensemble

        low, high = self.bounds
        distributions = self._distributions()
        params = {n: value for n, value in study.params.items() if n not in distributions}
        if not low <= params[self.parameter] <= high:  # the model's default: nothing was asked for
            params.pop(self.parameter)
        named = (study.model, self.parameter, (low, high), distributions, params)
        return ensemble(*named, **{**self.options(), **options})

    def table(self, file: str, study: Study, found: Ensemble) -> Table:
        """Return one row for each event of each sample."""
        from contfric.ensembles.tables import events_table

        return table_of(events_table(found))

    def entry(self, found: Ensemble) -> dict[str, Any]:
        """Return events and classes with their shares."""
        return {
            "parameter": found.parameter,
            "range": list(found.range),
            "distributions": found.distributions,
            "seed": found.seed,
            "samples": len(found),
            "outcomes": found.counts(),
            "complete": found.complete,
            "events": [
                {"label": e.label, "share": e.share, "low": e.low, "high": e.high, "count": e.count}
                | {"quantiles": e.quantiles().tolist()}
                for e in found.events
            ],
            "classes": [
                {"events": list(c.events), "share": c.share, "low": c.low, "high": c.high}
                | {"samples": len(c.samples)}
                for c in found.classes
            ],
        }

    @classmethod
    def lines(cls, entry: dict[str, Any]) -> Iterator[str]:
        """Yield the most frequent events and classes as tables."""
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
        yield from aligned(rows) if events else ["no events"]
        rows = [["share", "95 % interval", "list of events"]]
        for c in classes[:_MOST]:
            interval = f"{c['low']:.1%} to {c['high']:.1%}"
            rows.append([f"{c['share']:.1%}", interval, _listed(c["events"])])
        yield from aligned(rows)
        left = max(0, len(events) - _MOST), max(0, len(classes) - _MOST)
        if any(left):
            yield f"and {left[0]} rarer events, {left[1]} rarer classes, which run.json has"
        yield from incomplete(entry)


def _listed(events: list[str]) -> str:
    """Return a list of events for a line of a terminal; `run.json` has all of it."""
    shown = ", ".join(events[:_MOST_IN_LINE]) or "none"
    left = len(events) - _MOST_IN_LINE
    return f"{shown} and {left} more" if left > 0 else shown


def ensemble_of(source: Study | str | Path, samples: Any, **options: Any) -> Ensemble:
    """Compute the ensemble that a study asks for; see :func:`contfric.ensemble`.

    Parameters
    ----------
    source : the study, its path or its bundled name
    samples : number of diagrams; None for that of the study

    Raises
    ------
    StudyError
        If the study is wrong, or has no ensemble.
    """
    from contfric.study.read import Study, read_study

    study = source if isinstance(source, Study) else read_study(source)
    task = next((t for t in study.content.tasks if isinstance(t, EnsembleTask)), None)
    if task is None:
        raise StudyError(
            f"{study.path} asks for no ensemble: it needs 'ensemble: {{parameter, range, distributions}}'"
        )
    return task.drawn(study, **({} if samples is None else {"samples": samples}), **options)
