"""The schema of a study file: what may stand where, and of which type."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from keyword import iskeyword
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import Field, create_model

from contfric.base.yaml_schema import SchemaPart
from contfric.study.tasks import TASKS
from contfric.study.tasks.one_parameter import OneParameter
from contfric.study.tasks.orbit import Simulated, Start
from contfric.study.wanted import Rows, Want, Wants

if TYPE_CHECKING:
    from contfric.study.tasks.task import FigureKind, Task

#: Kinds of figures, each with the tasks that draw it.
FIGURES: dict[str, tuple[FigureKind, list[type[Task]]]] = {}
_DRAWN: tuple[type[Task], ...] = (*TASKS, Start)
for _task in _DRAWN:
    for _kind, _look in _task.figures.items():
        FIGURES.setdefault(_kind, (_look, []))[1].append(_task)


class Format(str, Enum):
    """Formats of figures."""

    PNG = "png"
    SVG = "svg"
    PDF = "pdf"


class JournalWidth(str, Enum):
    """Widths of figures in a journal."""

    SINGLE = "single"
    DOUBLE = "double"


class Figure(SchemaPart):
    """One figure."""

    kind: str = Field(description=f"one of {', '.join(FIGURES)}")
    rows: Rows | None = Field(
        None,
        description="a list of rows of a diagram: x_max, x_min, stops, psi, period, or any quantity",
    )
    file: str | None = Field(None, min_length=1, description="the name of the figure's file")
    format: Annotated[Format, Field(strict=False)] | None = Field(
        None, description="one of png, svg, pdf"
    )
    inset: bool = Field(
        False, description="true: the part of a diagram in which events crowd is drawn larger"
    )
    journal: Annotated[JournalWidth, Field(strict=False)] | None = Field(
        None,
        description="single or double: as wide as a column (88 mm) or the page (180 mm) of a journal",
    )


class StudyFile(SchemaPart):
    """The content of a study file: the tasks that it asks for, and the rest."""

    known: ClassVar[tuple[type[Task], ...]] = ()

    title: str | None = Field(None, description="a text")
    model: str = Field(description="the name of a model, or the path of its YAML file")
    params: dict[str, float | dict[str, str]] = Field(
        {},
        description="a mapping of parameters to finite numbers, or to what they follow, such as {tie: S}",
        json_schema_extra={"entry": "parameter '{}' must be a finite number"},
    )
    start: Start = Field(
        Start(simulate=Simulated()),
        description="'simulate', or a mapping with one of simulate, signature, orbit",
    )
    want: Wants = Field(
        [], description="a list with any of stability, asymmetry, extrema, stops, and of quantities"
    )
    figures: list[Figure] = Field([], description="a list of mappings, each with its kind")

    @property
    def quantities(self) -> list[str]:
        """The quantities that it wants a column of, beyond those that have a name of their own."""
        return [name for name in self.want if not isinstance(name, Want)]

    @property
    def given(self) -> list[Task]:
        """The tasks that it asks for, in the order of the steps."""
        found = (getattr(self, _field(task)) for task in self.known)
        return [task for task in found if task is not None]

    @property
    def tasks(self) -> list[Task]:
        """The same, after the orbit of the start if anything needs it."""
        return [self.start, *self.given] if self.needs_orbit else self.given

    @property
    def task(self) -> OneParameter | None:
        """What is done with the first orbit along one parameter; None if nothing is."""
        return next((task for task in self.given if isinstance(task, OneParameter)), None)

    @property
    def needs_orbit(self) -> bool:
        """Whether anything is asked for that needs the orbit of the start."""
        shown = any(figure.kind in Start.figures for figure in self.figures)
        asked = not self.given or any(task.of_orbit for task in self.given)
        return asked or shown or "start" in self.model_fields_set

    def as_dict(self) -> dict[str, Any]:
        """Return what the file says, as plain data."""
        return self.model_dump(mode="json", by_alias=True, exclude_unset=True)


def _field(task: type[Task]) -> str:
    """Return the name of the field of a task: its key, if Python has no other use for it."""
    return f"{task.name}_" if iskeyword(task.name) else task.name


def schema_of(tasks: Sequence[type[Task]]) -> type[StudyFile]:
    """Return the schema of study files that may ask for these tasks."""
    fields: dict[str, Any] = {
        _field(task): (task | None, Field(None, alias=task.name, description=task.described()))
        for task in tasks
    }
    made = create_model(
        "StudyFile", __base__=StudyFile, __doc__="The content of a study file.", **fields
    )
    made.known = tuple(tasks)
    return made


#: Files that may ask for every task of the list.
SCHEMA = schema_of(TASKS)
