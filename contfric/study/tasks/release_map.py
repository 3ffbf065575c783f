"""``release_map``: the map from the phase of one release from rest to that of the next."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from pydantic import Field

from contfric.base.yaml_schema import positive, whole
from contfric.study.tasks.response import Response
from contfric.study.tasks.task import FigureKind, Job, StudyCheck

if TYPE_CHECKING:
    from contfric.response.returns import ReleaseMap
    from contfric.study.read import Study


class ReleaseMapTask(Response):
    """The one-dimensional map of releases."""

    name = "release_map"
    row_text = "one row a release"
    figures: ClassVar = {"release_map": FigureKind(6.4, 6.0)}

    surface: str | None = Field(None, description="the name of a surface that rest is left at")
    count: int | None = whole("phases at which releases are looked for", least=2)
    periods: float | None = positive("periods within which the next release has to come")

    def check(self, asked: StudyCheck) -> None:
        """Check that releases of the model are told by their phase, and the surface."""
        from contfric.response.ways_out_of_rest import release_of

        asked.attempt((self.name,), lambda: release_of(asked.model, self.surface))

    def does(self, study: Study) -> str:
        """Return the map in words."""
        return f"the map of releases{f' at {self.surface}' if self.surface else ''}"

    def compute(self, job: Job) -> ReleaseMap:
        """Follow every release; a killed run goes on from its tiles."""
        from contfric.response.release import release_map

        given = {"progress": job.say, **self.options()}
        return release_map(job.study.model, job.study.params, **given)

    def entry(self, found: ReleaseMap) -> dict[str, Any]:
        """Return the numbers of releases, of those without a next one, and of branches."""
        return {
            "surface": found.surface,
            "releases": len(found),
            "without": int(np.sum(np.isnan(found.images))),
            "branches": len(set(found.branch[found.branch >= 0].tolist())),
        }

    @classmethod
    def lines(cls, entry: dict[str, Any]) -> Iterator[str]:
        """Yield those numbers."""
        yield (
            f"{entry['releases']} releases at {entry['surface']}, {entry['branches']} branches; "
            f"{entry['without']} never come to rest again"
        )
