"""``explore``: every branch that can be reached from the first orbit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from pydantic import Field

from contfric.base.attributes import altered
from contfric.base.yaml_schema import Truth, keys_of, whole
from contfric.errors import number_and
from contfric.study.tasks.one_parameter import OneParameter
from contfric.study.tasks.task import Job, SeedsEntry, Skipped
from contfric.study.wanted import Want

if TYPE_CHECKING:
    from contfric.atlas.diagram import Diagram
    from contfric.study.read import Study

DIAGRAM = "diagram.npz"


class ExploreTask(OneParameter):
    """Follow all branches that can be reached from the first orbit."""

    name = "explore"
    saved_as = DIAGRAM
    own = OneParameter.own | {"seeds", "verify"}

    seeds: SeedsEntry | None = Field(None, description=keys_of(SeedsEntry))
    bridges: Truth | None = Field(
        None,
        description="true or false: whether orbits with holds lead on where the Poincare map "
        "is discontinuous",
    )
    max_periods: int | None = whole("longest orbits, in periods", most=16)
    copies: int | None = whole("most copies of a solution at a sliding event", most=16)
    max_branches: int | None = whole("most branches to compute")
    verify: Truth = Field(
        False, description="true or false: whether the diagram is restarted from its own branches"
    )

    def does(self, study: Study) -> str:
        """Return the branches in words."""
        more = (
            []
            if self.max_periods is None
            else [f"of up to {number_and(self.max_periods, 'period')}"]
        )
        more += ["explored again from its own branches"] if self.verify else []
        return f"every branch that can be reached, {self.where(study, *more)}"

    def skipped(self, study: Study) -> Iterator[Skipped]:
        """Yield bridges, if they are switched off."""
        if self.bridges is False:
            what = "bridges: branches end where the Poincare map is discontinuous"
            yield Skipped(what, "switched off (bridges: false)")

    def compute(self, job: Job) -> Diagram:
        """Explore; on Ctrl-C the diagram found so far, with ``complete`` False."""
        from contfric.atlas.explore import explore
        from contfric.events.bifurcation import EndReason

        diagram = explore(
            job.found["orbit"],
            self.parameter,
            self.bounds,
            # without stability branch points are missed
            stability=job.study.wants(Want.STABILITY) or self.verify,
            progress=job.progress_of(self.name),
            **self.options(),
            **(self.seeds.argument() if self.seeds else {}),
        )
        if not diagram.branches:
            raise KeyboardInterrupt  # before the first branch was done
        if not (self.verify and diagram.complete):
            return diagram
        try:
            job.say("verify: explored again from its own branches")
            diagram.verify()
        except KeyboardInterrupt:  # the diagram is kept; the same command goes on with its checks
            notes = (*diagram.notes, EndReason.INTERRUPTED.value)
            return altered(diagram, complete=False, notes=notes)
        return diagram
