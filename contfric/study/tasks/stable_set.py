"""``stable_set``: where basins of attraction meet, the stable set of an unstable orbit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from contfric.base.yaml_schema import positive, whole
from contfric.study.tasks.grids import pairs_of, ranges_text
from contfric.study.tasks.response import Response
from contfric.study.tasks.task import FigureKind, Job, StudyCheck

if TYPE_CHECKING:
    from contfric.response.stable_set import StableSet
    from contfric.study.read import Study


class StableSetTask(Response):
    """The stable set of the orbit of the start, which is unstable."""

    name = "stable_set"
    row_text = "one row a point of the stable set"
    of_orbit = True
    under = "basins"
    own = frozenset({"range"})
    figures: ClassVar = {"stable_set": FigureKind(8.4, 6.0)}

    range: dict[str, list[float]] = Field(
        description="a mapping of both states to two finite numbers [low, high]"
    )
    phase: float | None = Field(
        None, description="a number: phase of the section, as a share of the period"
    )
    max_step: float | None = positive()
    max_points: int | None = whole("most points of each half", least=2)
    max_returns: int | None = whole("most returns of the section map for each half")

    def check(self, asked: StudyCheck) -> None:
        """Check the model and the ranges."""
        from contfric.response.stable_set import check_ranges

        asked.attempt((self.name,), lambda: check_ranges(asked.model, self.range))

    def does(self, study: Study) -> str:
        """Return what is followed, in words."""
        return f"the starts that converge to the unstable orbit, {ranges_text(self.range)}"

    def compute(self, job: Job) -> StableSet:
        """Follow both halves."""
        from contfric.response.stable_set import stable_set

        start, progress = (
            (job.found["orbit"], pairs_of(self.range)),
            job.progress_of("stable set"),
        )
        return stable_set(*start, progress=progress, **self.options())

    def fixed(self, found: StableSet) -> dict[str, float]:
        """Return all parameters."""
        return found.orbit.params

    def entry(self, found: StableSet) -> dict[str, Any]:
        """Return the number of points, the gaps, and why it ends."""
        return {
            "orbit": found.orbit.name,
            "points": len(found.points),
            "breaks": sum(map(len, found.breaks)),
            "ends": [str(end.value) for end in found.ends],
        }

    @classmethod
    def lines(cls, entry: dict[str, Any]) -> Iterator[str]:
        """Yield its size and its ends."""
        yield f"stable set of {entry['orbit']}: {entry['points']} points, {entry['breaks']} gap(s)"
        yield from (f"end: {end}" for end in dict.fromkeys(entry["ends"]))
