"""``basins``: starts on a grid of two states, labelled by what they converge to."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from contfric.base.shown import aligned
from contfric.base.yaml_schema import whole
from contfric.study.tasks.grids import axes_text, ends_of, grid_text, values_of
from contfric.study.tasks.response import Response
from contfric.study.tasks.task import FigureKind, Job, StudyCheck, incomplete

if TYPE_CHECKING:
    from contfric.response.basins import Basins
    from contfric.study.read import Study


class BasinsTask(Response):
    """Starts on a grid of two states, labelled by what they converge to."""

    name = "basins"
    row_text = "one row a start of the basins"
    own = frozenset({"grid", "at"})
    figures: ClassVar = {"basins": FigureKind(8.4, 6.0)}

    grid: dict[str, list[float]] = Field(
        min_length=2,
        max_length=2,
        description="a mapping of two states, each to [low, high, number of values]",
    )
    at: dict[str, float] = Field(
        {}, description="a mapping of the other states, and of phase, to numbers"
    )
    periods: int | None = whole("periods that a start is followed")

    def check(self, asked: StudyCheck) -> None:
        """Check the axes, and that every state has a value."""
        from contfric.response.basin_map import check_starts

        for name, values in self.grid.items():
            if name in asked.model.states:
                asked.check_axis((self.name, "grid", name), name, values)
        asked.attempt((self.name,), lambda: check_starts(asked.model, self._axes(), self.at))

    def _axes(self) -> dict[str, Any]:
        return {n: values_of(v) if len(v) == 3 else v for n, v in self.grid.items()}

    def does(self, study: Study) -> str:
        """Return the grid in words."""
        return f"what starts converge to, {axes_text(self.grid)}"

    def compute(self, job: Job) -> Basins:
        """Follow the starts; a killed run goes on from its tiles."""
        from contfric.response.basin_map import basins

        study = job.study
        return basins(
            study.model,
            self._axes(),
            study.params,
            self.at,
            progress=job.say,
            **self.options(),
        )

    def entry(self, found: Basins) -> dict[str, Any]:
        """Return the grid and the share of each orbit."""
        return {
            "grid": {name: ends_of(values) for name, values in found.axes.items()},
            "at": found.at,
            "complete": found.complete,
            "shares": [vars(share) for share in found.shares],
        }

    @classmethod
    def lines(cls, entry: dict[str, Any]) -> Iterator[str]:
        """Yield the shares as a table."""
        yield f"basins at {grid_text(entry)}"
        rows = [["", "starts", "share", "95 % interval"]]
        for s in entry["shares"]:
            interval = f"{s['low']:.2%} to {s['high']:.2%}"
            rows.append(
                [s["name"].replace("_", " "), str(s["count"]), f"{s['share']:.2%}", interval]
            )
        yield from aligned(rows)
        yield from incomplete(entry)
