"""Shared by tasks whose result plots itself: responses, equilibria, ensembles."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import Field

from contfric.base.yaml_schema import positive
from contfric.study.tasks.task import STATE, Found, StudyCheck, Task

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from contfric.study.drawings import Drawing


class Sense(str, Enum):
    """How a surface is crossed."""

    EITHER = "either"
    RISING = "rising"
    FALLING = "falling"


class Response(Task):
    """A task whose result plots itself.

    Attributes
    ----------
    under : name of the result that is drawn beneath, if the study has it
    """

    under: ClassVar[str] = ""

    def draw(self, figure: Figure, drawing: Drawing, found: Found, title: str) -> None:
        """Let the result draw itself, with the parameters that it keeps in the title."""
        from contfric.plot.appearance.save import title_axes

        response, axes = found[self.result], figure.add_subplot()
        if self.under in found:
            found[self.under].plot(ax=axes)
        title_axes(response.plot(ax=axes), response.model, self.fixed(response), title)

    def fixed(self, found: Any) -> dict[str, float]:
        """Return the parameters that have one value all over the figure."""
        varied = getattr(found, "parameter", "")
        return {name: value for name, value in found.params.items() if name != varied}


class SectionTask(Response):
    """A task that collects points of solutions on a section."""

    section: str | float | None = Field(
        None, description="stops, releases, the name of a surface, or a phase from 0 to 1"
    )
    sense: Annotated[Sense, Field(strict=False)] | None = Field(
        None, description="one of either, rising, falling"
    )
    state: list[float] | None = Field(None, description=STATE)
    periods: float | None = positive("periods of which points are collected")
    transient: float | None = Field(
        None, ge=0.0, description="a number >= 0: periods before points are collected"
    )

    def check(self, asked: StudyCheck) -> None:
        """Check the state and the section."""
        from contfric.response.sections import section_of, usual_section

        asked.check_state((self.name, "state"), self.state)
        given: dict[str, Any] = self.options()
        section, sense = (
            given.get("section", usual_section(asked.model)),
            given.get("sense", "either"),
        )
        asked.attempt((self.name, "section"), lambda: section_of(asked.model, section, sense))
