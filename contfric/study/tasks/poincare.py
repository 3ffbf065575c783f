"""``poincare``: points of one solution on a section."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from contfric.study.tasks.response import SectionTask
from contfric.study.tasks.task import FigureKind, Job

if TYPE_CHECKING:
    from contfric.response.returns import Returns
    from contfric.study.read import Study


class PoincareTask(SectionTask):
    """Points of one solution on a section."""

    name = "poincare"
    row_text = "one row a point of the section"
    figures: ClassVar = {"poincare": FigureKind(6.4, 6.0)}

    time: float | None = Field(None, description="a finite number: the initial time")

    def does(self, study: Study) -> str:
        """Return the section in words."""
        from contfric.response.sections import usual_section

        section = usual_section(study.model) if self.section is None else self.section
        return f"points of one solution at {section}"

    def compute(self, job: Job) -> Returns:
        """Simulate one solution."""
        from contfric.response.poincare import poincare

        progress = job.progress_of(self.name)
        return poincare(job.study.model, job.study.params, progress=progress, **self.options())

    def entry(self, found: Returns) -> dict[str, Any]:
        """Return the section and how the solution ended."""
        return {
            "section": found.section,
            "points": len(found),
            "outcome": found.outcome.name.lower(),
            "complete": found.complete,
        }

    @classmethod
    def lines(cls, entry: dict[str, Any]) -> Iterator[str]:
        """Yield the number of points."""
        yield f"{entry['points']} points of a solution at {entry['section']}"
