"""``continue``: the branch of the first orbit, to its ends."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from contfric.study.tasks.one_parameter import OneParameter
from contfric.study.tasks.task import Job, Skipped
from contfric.study.wanted import Want

if TYPE_CHECKING:
    from contfric.atlas.diagram import Diagram
    from contfric.continuation.branch import Branch
    from contfric.study.read import Study

BRANCH = "branch.npz"


class ContinueTask(OneParameter):
    """Follow the branch of the first orbit to its ends."""

    name = "continue"
    saved_as = BRANCH

    def does(self, study: Study) -> str:
        """Return the branch in words."""
        return f"the branch of the first orbit, {self.where(study)}"

    def skipped(self, study: Study) -> Iterator[Skipped]:
        """Yield what an exploration would find."""
        yield Skipped("other branches", "'continue' follows one branch only")

    def compute(self, job: Job) -> Diagram:
        """Continue one branch, and return the diagram of it alone."""
        from contfric.continuation.trace import continue_orbit

        branch = continue_orbit(
            job.found["orbit"],
            self.parameter,
            self.bounds,
            stability=job.study.wants(Want.STABILITY),
            progress=job.progress_of(self.name),
            **self.options(),
        )
        return one_branch(branch, self.bounds)

    def saved(self, found: Diagram) -> Branch:
        """Return the branch: it is its own diagram."""
        return found.branches[0]


def one_branch(branch: Branch, bounds: tuple[float, float]) -> Diagram:
    """Return the diagram of a single branch: nothing follows its events."""
    from contfric.atlas.collect import FINAL
    from contfric.atlas.diagram import Diagram, LooseEnd, Node
    from contfric.events.bifurcation import EndReason

    return Diagram(
        model=branch.model,
        parameter=branch.parameter,
        range=bounds,
        branches=(branch,),
        nodes=tuple(Node(bifurcation, (0,)) for bifurcation in branch.bifurcations),
        loose_ends=tuple(
            LooseEnd(0, side, end)
            for side, end in enumerate(branch.ends)
            if end.reason not in FINAL
        ),
        complete=all(end.reason is not EndReason.INTERRUPTED for end in branch.ends),
    )
