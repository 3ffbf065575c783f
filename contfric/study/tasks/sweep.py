"""``sweep``: simulations over values of a parameter, each from where the last one ended."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import Field

from contfric.study.tasks.grids import ends_of, values_of
from contfric.study.tasks.response import SectionTask
from contfric.study.tasks.task import PARAMETER, FigureKind, Job, StudyCheck, incomplete

if TYPE_CHECKING:
    from contfric.response.sweep import Sweep
    from contfric.study.read import Study


class SweepDirection(str, Enum):
    """Directions of a sweep."""

    BOTH = "both"
    UP = "up"
    DOWN = "down"


class SweepTask(SectionTask):
    """Simulations over values of a parameter."""

    name = "sweep"
    row_text = "one row a point of the sweep"
    own = frozenset({"parameter", "values"})
    figures: ClassVar = {"sweep": FigureKind(9.6, 5.0)}

    parameter: str = Field(description=PARAMETER)
    values: list[float] = Field(
        min_length=3, max_length=3, description="[low, high, number of values]"
    )
    direction: Annotated[SweepDirection, Field(strict=False)] | None = Field(
        None, description="one of both, up, down"
    )

    def check(self, asked: StudyCheck) -> None:
        """Check state, section, parameter and values."""
        super().check(asked)
        asked.attempt((self.name, "parameter"), lambda: asked.model.index_of(self.parameter))
        asked.check_axis((self.name, "values"), self.parameter, self.values)

    def replaced(self) -> dict[str, float]:
        """Return the parameter of the sweep."""
        return {self.parameter: self.values[0]}

    def does(self, study: Study) -> str:
        """Return the sweep in words."""
        low, high, count = self.values
        where = f"{count:g} values of {self.parameter} from {low:g} to {high:g}"
        direction = "both" if self.direction is None else self.direction.value
        return f"simulations at {where}, {direction}"

    def compute(self, job: Job) -> Sweep:
        """Simulate; a killed run goes on from its tiles."""
        from contfric.response.sweeping import sweep

        others = {n: value for n, value in job.study.params.items() if n != self.parameter}
        return sweep(
            job.study.model,
            self.parameter,
            values_of(self.values),
            others,
            progress=job.say,
            **self.options(),
        )

    def entry(self, found: Sweep) -> dict[str, Any]:
        """Return the values and what the trajectory converged to at each."""
        return {
            "parameter": found.parameter,
            "values": ends_of(found.values),
            "params": found.params,
            "section": found.section,
            "complete": found.complete,
            "points": {name: len(run) for name, run in found.runs.items()},
            "outcomes": {outcome.name.lower(): n for outcome, n in found.counts().items()},
        }

    @classmethod
    def lines(cls, entry: dict[str, Any]) -> Iterator[str]:
        """Yield outcomes and numbers of points."""
        low, high, count = entry["values"]
        found = ", ".join(f"{number} {outcome}" for outcome, number in entry["outcomes"].items())
        points = ", ".join(f"{number} {way}" for way, number in entry["points"].items())
        yield f"sweep at {count} values of {entry['parameter']} from {low:g} to {high:g}: {found}"
        yield f"points    {points}"
        yield from incomplete(entry, "the same command goes on from what was found")
