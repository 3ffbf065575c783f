"""``stable_set``: where basins of attraction meet, the stable set of an unstable orbit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from contfric.study.tasks.response import Response
from contfric.study.tasks.task import FigureKind, Found, Job, StudyCheck

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from contfric.response.stable_set import StableSet
    from contfric.study.drawings import Drawing
    from contfric.study.read import Study


class StableSetTask(Response):
    """The stable set of the orbit of the start, which is unstable."""

    name = "stable_set"
    result = "stable_set"
    saved_as = "stable_set.npz"
    row_text = "one row a point of the stable set"
    of_orbit = True
    own = frozenset({"range"})
    figures: ClassVar = {"stable_set": FigureKind(8.4, 6.0)}

    range: dict[str, list[float]] = Field(
        description="a mapping of both states to two finite numbers [low, high]"
    )
    phase: float | None = Field(
        None, description="a number: phase of the section, as a share of the period"
    )
    max_step: float | None = Field(None, gt=0.0, description="a number > 0")
    max_points: int | None = Field(
        None, ge=2, description="a whole number >= 2: most points of each half"
    )
    max_returns: int | None = Field(
        None, ge=1, description="a whole number >= 1: most returns of the section map for each half"
    )

    def check(self, asked: StudyCheck) -> None:
        """Check the model and the ranges."""
        from contfric.response.stable_set import check_ranges

        asked.attempt((self.name,), lambda: check_ranges(asked.model, self.range))

    def does(self, study: Study) -> str:
        """Return what is followed, in words."""
        where = ", ".join(f"{n} from {r[0]:g} to {r[1]:g}" for n, r in self.range.items())
        return f"the starts that converge to the unstable orbit, {where}"

    def compute(self, job: Job) -> StableSet:
        """Follow both halves."""
        from contfric.response.stable_set import stable_set

        ranges = {name: (pair[0], pair[1]) for name, pair in self.range.items()}
        told = job.told("stable set")
        return stable_set(job.found["orbit"], ranges, progress=told, **self.options())

    def draw(self, figure: Figure, drawing: Drawing, found: Found, title: str) -> None:
        """Draw the set, over the basins of the same study."""
        from contfric.plot.names import full_title
        from contfric.plot.style import TEXT, sized

        edge, axes = found["stable_set"], figure.add_subplot()
        if "basins" in found:
            found["basins"].plot(ax=axes)
        text = full_title(title, edge.model.parameter_names, edge.orbit.params)
        edge.plot(ax=axes).set_title(text, fontsize=sized(TEXT))

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
