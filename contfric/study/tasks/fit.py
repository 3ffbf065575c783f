"""``fit``: parameters from measured values, time series and positions of events."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from contfric.base.shown import aligned
from contfric.base.yaml_schema import SchemaPart, keys_of
from contfric.errors import ParameterError, did_you_mean, number_and
from contfric.study.tables import Table, table_of
from contfric.study.tasks.response import Response
from contfric.study.tasks.task import FigureKind, Job, StudyCheck

if TYPE_CHECKING:
    from pathlib import Path

    from contfric.fitting.condition import Datum
    from contfric.fitting.result import Fit
    from contfric.study.read import Study

FITTED, RESIDUALS = "fit.csv", "residuals.csv"


class DatumPart(SchemaPart):
    """One measurement: a value of a quantity, a time series in a file, or the position of an event."""

    quantity: str | None = Field(None, min_length=1, description="a quantity that was measured")
    series: str | None = Field(
        None, min_length=1, description="a signal that was measured over time, such as x"
    )
    jump: str | None = Field(
        None, min_length=1, description="the kind or the label of an event of the study's diagram"
    )
    value: float | None = Field(None, description="a finite number: what came out")
    file: str | None = Field(
        None, min_length=1, description="the path of a CSV file with columns of times and values"
    )
    sigma: float = Field(gt=0.0, description="a number > 0: the standard deviation")
    params: dict[str, float] = Field(
        {}, description="a mapping of parameters to the values at which it was measured"
    )

    def checked(self) -> None:
        """Check that it is one measurement.

        Raises
        ------
        ParameterError
            If there are none, or several.
        """
        given = [k for k in ("quantity", "series", "jump") if getattr(self, k) is not None]
        needs = "file" if given == ["series"] else "value"
        other = "value" if needs == "file" else "file"
        if len(given) != 1 or getattr(self, needs) is None or getattr(self, other) is not None:
            raise ParameterError(
                "a datum is {quantity, value, sigma}, {series, file, sigma} or {jump, value, sigma}"
            )

    def datum(self, folder: Path, diagram: Any) -> Datum:
        """Return the measurement; files are looked for in a folder, events in a diagram.

        Raises
        ------
        ParameterError
            If there is no such file, or no such event.
        """
        from contfric.fitting.data import Jump, Measured, Series

        self.checked()
        if self.series is not None:
            times, values = _columns(folder / str(self.file))
            return Series(self.series, times, values, self.sigma, self.params)
        value = float(self.value or 0.0)
        if self.quantity is not None:
            return Measured(self.quantity, value, self.sigma, self.params)
        if diagram is None:
            raise ParameterError("a jump is an event of a diagram: add 'explore' or 'continue'")
        events = [e for e in diagram.bifurcations if self.jump in (e.label, e.kind.value)]
        if not events:
            known = dict.fromkeys(n for e in diagram.bifurcations for n in (e.label, e.kind.value))
            raise ParameterError(
                f"the diagram has no event '{self.jump}'{did_you_mean(str(self.jump), known)}"
            )
        nearest = min(events, key=lambda e: abs(_position(e) - value))
        return Jump(nearest, value, self.sigma, self.params)


class FitTask(Response):
    """Parameters at which the model agrees best with measurements."""

    name = "fit"
    row_text = "one row a free parameter, one row a measured value"
    own = frozenset({"free", "data"})
    figures: ClassVar = {"fit": FigureKind(8.0, 5.0)}

    free: list[str] = Field(min_length=1, description="the names of the parameters to find")
    data: list[DatumPart] = Field(
        min_length=1, description=f"a list of measurements, each {keys_of(DatumPart)}"
    )

    def check(self, asked: StudyCheck) -> None:
        """Check the measurements, but for events, which are not known yet."""
        from contfric.fitting.fit import check_fit

        known: list[Datum] = []
        for k, part in enumerate(self.data):
            if part.jump is None:
                step = partial(
                    lambda p: known.append(p.datum(asked.located.path.parent, None)), part
                )
            else:
                step = partial(part.checked)
                if asked.content.task is None:
                    text = "a jump is an event of a diagram: add 'explore' or 'continue'"
                    asked.fail((self.name, "data", k), text)
            asked.attempt((self.name, "data", k), step)
        for name in self.free:
            asked.attempt((self.name, "free"), partial(asked.model.index_of, name))
        if known:
            asked.attempt(
                (self.name,), lambda: check_fit(asked.model, known, asked.params, self.free)
            )

    def does(self, study: Study) -> str:
        """Return what is found, in words."""
        return f"{', '.join(self.free)} from {number_and(len(self.data), 'measurement')}"

    def tables(self, study: Study) -> tuple[str, ...]:
        """Return its two tables."""
        return FITTED, RESIDUALS

    def compute(self, job: Job) -> Fit:
        """Search from the parameters of the study."""
        from contfric.fitting.fit import fit

        diagram = job.found.get("diagram")
        data = [part.datum(job.study.path.parent, diagram) for part in self.data]
        return fit(job.study.model, data, job.study.params, self.free, progress=job.say)

    def table(self, file: str, study: Study, found: Fit) -> Table:
        """Return the free parameters, or the data."""
        return table_of(found.found() if file == FITTED else found.columns())

    def entry(self, found: Fit) -> dict[str, Any]:
        """Return the free parameters and how well the data are met."""
        return {
            "params": {name: found.params[name] for name in found.free},
            "sigma": found.sigma,
            "covariance": found.covariance.tolist(),
            "chi_square": found.chi_square,
            "data": len(found.residuals),
            "converged": found.converged,
            "message": found.message,
            "notes": list(found.notes),
        }

    @classmethod
    def lines(cls, entry: dict[str, Any]) -> Iterator[str]:
        """Yield the parameters as a table."""
        chi_square, spare = entry["chi_square"], entry["data"] - len(entry["params"])
        reduced = f", {chi_square / spare:.4g} a degree of freedom" if spare else ""
        yield f"fit to {number_and(entry['data'], 'value')}: chi^2 = {chi_square:.4g}{reduced}"
        rows = [["", "value", "standard deviation"]]
        for name, value in entry["params"].items():
            rows.append([name, f"{value:.10g}", f"{entry['sigma'][name]:.2g}"])
        yield from aligned(rows)
        yield from (f"warning: {note}" for note in entry["notes"])


def _position(event: Any) -> float:
    from contfric.curves.sensitivity.gradient import parameter_of

    return float(event.params[parameter_of(event)])


def _columns(path: Path) -> tuple[list[float], list[float]]:
    """Return the two columns of a CSV file; a first row of names is skipped.

    Raises
    ------
    ParameterError
        If there is no such file, or it is another one.
    """
    import csv

    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = [row for row in csv.reader(file) if row]
    except (OSError, UnicodeError, csv.Error) as error:
        raise ParameterError(f"cannot read {path}: {error}") from None
    found: list[tuple[float, float]] = []
    for number, row in enumerate(rows, start=1):
        try:
            time, value = map(float, row)
        except ValueError:
            if number > 1:
                raise ParameterError(
                    f"{path}, row {number}: a row is a time and a value, got {','.join(row)[:60]}"
                ) from None
        else:
            found.append((time, value))
    if not found:
        raise ParameterError(f"{path} has no rows of times and values")
    return [t for t, _ in found], [v for _, v in found]
