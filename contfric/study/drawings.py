"""The figures of a study: what each shows, what it needs, and the file it goes to; and drawing one."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

from contfric.base.files import replacing
from contfric.errors import did_you_mean
from contfric.study.schema import FIGURES, Figure, Format, JournalWidth, StudyFile
from contfric.study.wanted import ROWS, Row

if TYPE_CHECKING:
    from contfric.base.yaml_lines import LocatedYaml
    from contfric.study.tasks.task import Found, Task


@dataclass(frozen=True)
class Drawing:
    """A figure to draw.

    Attributes
    ----------
    kind : one of the kinds of figures
    rows : rows of a diagram
    file : name of its file
    journal : its width, None for that of a screen
    inset : whether a diagram has insets
    task : the task that draws it
    """

    kind: str
    rows: tuple[Row | str, ...]
    file: str
    journal: JournalWidth | None
    inset: bool
    task: Task


def drawings_of(located: LocatedYaml, content: StudyFile) -> tuple[Drawing, ...]:
    """Return the figures of a study; what is impossible fails with its line."""
    drawings: list[Drawing] = []
    for index, figure in enumerate(content.figures):
        task = _task(located, content, index)
        rows = _rows(located, content, index)
        file = _file_name(located, figure, index, [drawing.file for drawing in drawings])
        drawings.append(Drawing(figure.kind, rows, file, figure.journal, figure.inset, task))
    return tuple(drawings)


def _task(located: LocatedYaml, content: StudyFile, index: int) -> Task:
    """Return the task that draws a figure."""
    kind = content.figures[index].kind
    if kind not in FIGURES:
        located.fail(
            ("figures", index, "kind"), f"'kind' has no '{kind}'{did_you_mean(kind, FIGURES)}"
        )
    look, tasks = FIGURES[kind]
    found = next((task for task in content.tasks if kind in task.figures), None)
    if found is None:
        keys = " or ".join(f"'{task.name}'" for task in tasks)
        what = look.called or f"a figure of kind {kind}"
        located.fail(("figures", index), f"{what} needs {keys}")
    return found


def _rows(located: LocatedYaml, content: StudyFile, index: int) -> tuple[Row | str, ...]:
    figure = content.figures[index]
    if not FIGURES[figure.kind][0].row_height:
        if figure.rows is not None:
            located.fail(("figures", index, "rows"), "only a diagram has rows")
        if figure.inset:
            located.fail(("figures", index, "inset"), "only a diagram has insets")
        return ()
    if figure.rows is None:
        wanted = tuple(row for want, row in ROWS.items() if want in content.want)
        return wanted or (Row.X_MAX,)
    return tuple(figure.rows)


def _file_name(located: LocatedYaml, figure: Figure, index: int, taken: list[str]) -> str:
    address = ("figures", index, "file")
    if figure.file is None:
        suffix = (figure.format or Format.PNG).value
        names = [f"{figure.kind}.{suffix}"]
        names += [f"{figure.kind}-{k}.{suffix}" for k in range(2, len(taken) + 2)]
        return next(name for name in names if name not in taken)
    path = PurePath(figure.file)
    if path.name != figure.file or "\\" in figure.file or path.name.startswith("."):
        located.fail(address, f"'{figure.file}' must be the name of a file in the run's folder")
    suffix = path.suffix.removeprefix(".")
    formats = [f.value for f in Format]
    if suffix and suffix not in formats:
        located.fail(address, f"unknown format '{suffix}'{did_you_mean(suffix, formats)}")
    if suffix and figure.format and suffix != figure.format.value:
        located.fail(address, f"'{figure.file}' is not of the format '{figure.format.value}'")
    name = figure.file if suffix else f"{figure.file}.{(figure.format or Format.PNG).value}"
    if name in taken:
        located.fail(address, f"two figures cannot be one file, '{name}'")
    return name


def draw(path: Path, drawing: Drawing, found: Found, title: str) -> None:
    """Draw a figure and write it; all but orbits and graphs carry the study's title.

    Matplotlib is loaded here, and only when a figure is drawn.
    """
    from contfric.plot.appearance.labels import laid_out
    from contfric.plot.appearance.save import installed_fonts, journal, new_figure, save_figure

    wide = nullcontext() if drawing.journal is None else journal(drawing.journal.value)
    with wide, installed_fonts():
        look = FIGURES[drawing.kind][0]
        figure = new_figure(look.width, look.height + look.row_height * len(drawing.rows))
        drawing.task.draw(figure, drawing, found, "" if drawing.journal else title)
        if laid_out(figure):  # for the labels; a second time costs 0.1 s
            figure.set_layout_engine("none")
        with replacing(path) as temporary:
            save_figure(figure, temporary)
