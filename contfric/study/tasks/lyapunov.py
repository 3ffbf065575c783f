"""``lyapunov``: Lyapunov exponents on a grid of two parameters."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from pydantic import Field

from contfric.base.yaml_schema import positive, whole
from contfric.errors import number_and
from contfric.study.tasks.grids import axes_text, ends_of, grid_text, values_of
from contfric.study.tasks.response import Response
from contfric.study.tasks.task import STATE, FigureKind, Job, StudyCheck, incomplete

if TYPE_CHECKING:
    from contfric.chaos.map import LyapunovMap
    from contfric.study.read import Study


class LyapunovTask(Response):
    """Lyapunov exponents on a grid of two parameters."""

    name = "lyapunov"
    row_text = "one row a trajectory of the map"
    own = frozenset({"grid"})
    figures: ClassVar = {"lyapunov": FigureKind(8.0, 5.6, called="a map of Lyapunov exponents")}

    grid: dict[str, list[float]] = Field(
        min_length=2,
        max_length=2,
        description="a mapping of two parameters, each to [low, high, number of values]",
    )
    periods: int | None = whole("most periods to average over")
    transient: int | None = whole("periods before averaging begins", least=0)
    tolerance: float | None = positive("relative error at which averaging ends")
    confirm: int | None = whole("periods that chaos is followed further", least=0)
    starts: int | None = whole("initial conditions at each point")
    state: list[float] | None = Field(None, description=f"{STATE}: where every trajectory starts")

    def check(self, asked: StudyCheck) -> None:
        """Check the axes, the state, and whether the map fits into memory."""
        from contfric.chaos.compute import check_size

        asked.check_state((self.name, "state"), self.state)
        for name, values in self.grid.items():
            address = (self.name, "grid", name)
            asked.attempt(address, partial(asked.model.index_of, name))
            asked.check_axis(address, name, values)
        shape = tuple(int(values[2]) for values in self.grid.values())
        size = partial(check_size, shape, self.starts or 1, len(asked.model.states))
        asked.attempt((self.name, "grid"), size)

    def replaced(self) -> dict[str, float]:
        """Return the parameters of the grid."""
        return {name: values[0] for name, values in self.grid.items()}

    def does(self, study: Study) -> str:
        """Return the grid in words."""
        return f"exponents of trajectories at {axes_text(self.grid)}"

    def compute(self, job: Job) -> LyapunovMap:
        """Compute a map; a killed run goes on from its tiles."""
        from contfric.chaos.compute import lyapunov_map

        study = job.study
        return lyapunov_map(
            study.model,
            {name: values_of(ends) for name, ends in self.grid.items()},
            {name: value for name, value in study.params.items() if name not in self.grid},
            progress=job.progress_of(self.name),
            **self.options(),
        )

    def entry(self, found: LyapunovMap) -> dict[str, Any]:
        """Return what the trajectories of a map turned out to be."""
        return {
            "grid": {name: ends_of(values) for name, values in found.axes.items()},
            "params": found.params,
            "starts": found.starts,
            "complete": found.complete,
            "motions": {motion.name.lower(): count for motion, count in found.counts().items()},
            "largest": float(np.nanmax(found.values, initial=-np.inf)),
        }

    @classmethod
    def lines(cls, entry: dict[str, Any]) -> Iterator[str]:
        """Yield the kinds of motion and the largest exponent."""
        found = ", ".join(f"{count} {motion}" for motion, count in entry["motions"].items())
        yield f"exponents at {grid_text(entry)}, {number_and(entry['starts'], 'start')} each: {found}"
        yield f"largest   {entry['largest']:.6g}"
        yield from incomplete(entry)
