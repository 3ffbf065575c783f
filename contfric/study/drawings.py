"""The figures of a study: what each shows, what it needs, and the file it goes to."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING

from contfric.errors import did_you_mean
from contfric.study.responses import KEYS
from contfric.study.schema import Figure, FigureKind, Format, Journal, Row, StudyFile

if TYPE_CHECKING:
    from contfric.yaml_lines import LocatedYaml


@dataclass(frozen=True)
class Drawing:
    """A figure to draw: its kind, the rows of a diagram, its file, its width, and whether it has insets."""

    kind: FigureKind
    rows: tuple[Row | str, ...]
    file: str
    journal: Journal | None = None
    inset: bool = False


def drawings_of(located: LocatedYaml, content: StudyFile) -> tuple[Drawing, ...]:
    """Return the figures of a study; what is impossible fails with its line."""
    drawings: list[Drawing] = []
    for index, figure in enumerate(content.figures):
        rows = _rows(located, content, index)
        file = _file_name(located, figure, index, [drawing.file for drawing in drawings])
        drawings.append(Drawing(figure.kind, rows, file, figure.journal, figure.inset))
    return tuple(drawings)


def _rows(located: LocatedYaml, content: StudyFile, index: int) -> tuple[Row | str, ...]:
    figure = content.figures[index]
    if figure.kind is not FigureKind.DIAGRAM:
        if figure.rows is not None:
            located.fail(("figures", index, "rows"), "only a diagram has rows")
        if figure.inset:
            located.fail(("figures", index, "inset"), "only a diagram has insets")
        if figure.kind is FigureKind.BRANCHES:
            _check_task(located, content, index, "a graph of branches")
        if figure.kind is FigureKind.LYAPUNOV and content.lyapunov is None:
            located.fail(("figures", index), "a map of Lyapunov exponents needs 'lyapunov'")
        key = figure.kind.value
        if key in KEYS and getattr(content, key) is None:
            located.fail(("figures", index), f"a figure of kind {key} needs '{key}'")
        if figure.kind is FigureKind.PLANE and content.plane is None:
            located.fail(("figures", index), "a plane needs 'plane'")
        return ()
    _check_task(located, content, index, "a diagram")
    if figure.rows is None:
        return _default_rows(located, content, index)
    for place, row in enumerate(figure.rows):
        if isinstance(row, Row) and row.needs is not None and row.needs not in content.want:
            located.fail(
                ("figures", index, "rows", place),
                f"row '{row.value}' shows {row.needs.value}: add {row.needs.value} to 'want'",
            )
    return tuple(figure.rows)


def _check_task(located: LocatedYaml, content: StudyFile, index: int, what: str) -> None:
    if content.task is None:
        located.fail(("figures", index), f"{what} needs 'explore' or 'continue'")


def _default_rows(located: LocatedYaml, content: StudyFile, index: int) -> tuple[Row | str, ...]:
    rows = tuple(r for r in (Row.X_MAX, Row.STOPS, Row.PSI) if r.needs in content.want)
    if not rows:
        located.fail(
            ("figures", index),
            "a diagram has nothing to show: add any of extrema, stops, asymmetry to 'want'",
        )
    return rows


def _file_name(located: LocatedYaml, figure: Figure, index: int, taken: list[str]) -> str:
    address = ("figures", index, "file")
    if figure.file is None:
        suffix = (figure.format or Format.PNG).value
        names = [f"{figure.kind.value}.{suffix}"]
        names += [f"{figure.kind.value}-{k}.{suffix}" for k in range(2, len(taken) + 2)]
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
