"""The figures of a run. Matplotlib is loaded here, and only when a figure is drawn."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, cast

from contfric.results import replacing
from contfric.study.drawings import Drawing
from contfric.study.findings import Findings
from contfric.study.responses import KEYS
from contfric.study.schema import FigureKind, row_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from contfric.equilibria.explore import EquilibriumDiagram
    from contfric.response.sweep import Sweep

#: Size in inches: width, height, height added by each row of a diagram.
_SIZES = {
    FigureKind.DIAGRAM: (9.6, 1.2, 2.4),
    FigureKind.ORBIT: (9.0, 6.2, 0.0),
    FigureKind.TRANSITIONS: (7.0, 5.0, 0.0),
    FigureKind.BRANCHES: (9.6, 4.4, 0.0),
    FigureKind.LYAPUNOV: (8.0, 5.6, 0.0),
    FigureKind.PLANE: (9.6, 7.0, 0.0),
    FigureKind.SWEEP: (9.6, 5.0, 0.0),
    FigureKind.POINCARE: (6.4, 6.0, 0.0),
    FigureKind.BASINS: (8.4, 6.0, 0.0),
    FigureKind.EQUILIBRIA: (8.4, 5.0, 0.0),
    FigureKind.ENSEMBLE: (9.6, 6.0, 0.0),
}
#: Rows of a diagram that show a state, which an equilibrium has, too.
_STATES = frozenset({"x_max", "x_min", "stops"})
#: Kinds that show a diagram.
_OF_DIAGRAM = frozenset({FigureKind.DIAGRAM, FigureKind.BRANCHES})


def can_be_drawn(kind: FigureKind, found: Findings) -> bool:
    """Tell whether a run, perhaps interrupted, has found what a figure shows."""
    if kind is FigureKind.LYAPUNOV:
        return found.lyapunov is not None
    if kind.value in KEYS:
        return kind.value in found.responses
    if kind is FigureKind.PLANE:
        return found.plane is not None
    return (found.diagram if kind in _OF_DIAGRAM else found.orbit) is not None


def _behind(found: Findings, rows: list[str]) -> Sweep | None:
    """Return the sweep that is drawn behind a diagram: along its parameter, with what its rows show."""
    swept, diagram = cast("Sweep | None", found.responses.get("sweep")), found.diagram
    if swept is None or diagram is None or swept.parameter != diagram.parameter:
        return None
    if not all(swept.shows(row) for row in rows):
        return None
    return swept if swept.section == "stops" or rows == ["stops"] else None


def _draw_equilibria(axes: list[Axes], rows: list[str], found: Findings) -> None:
    """Draw the equilibria of a run into the rows of a diagram along the same parameter that show a state."""
    rest, diagram = (
        cast("EquilibriumDiagram | None", found.responses.get("equilibria")),
        found.diagram,
    )
    if rest is None or diagram is None or rest.parameter != diagram.parameter:
        return
    for ax, row in zip(axes, rows, strict=True):
        if row in _STATES:
            rest.plot(ax=ax)
            ax.set_xlabel(ax.get_xlabel() if ax is axes[-1] else "")


def paint(path: Path, drawing: Drawing, found: Findings, title: str) -> None:
    """Draw a figure and write it; all but orbits and graphs carry the study's title."""
    from contfric.plot.save import journal

    with nullcontext() if drawing.journal is None else journal(drawing.journal.value):
        _paint(path, drawing, found, "" if drawing.journal else title)


def _paint(path: Path, drawing: Drawing, found: Findings, title: str) -> None:
    from contfric.plot.branch_graph import plot_branch_graph
    from contfric.plot.diagram import plot_diagram
    from contfric.plot.graph import plot_transition_graph
    from contfric.plot.lyapunov import plot_lyapunov_map
    from contfric.plot.orbit import panels_height, plot_orbit_panels
    from contfric.plot.plane import plot_plane
    from contfric.plot.save import new_figure, save_figure
    from contfric.plot.style import TEXT, full_title, sized, title_label

    orbit, diagram, plane, lmap = found.orbit, found.diagram, found.plane, found.lyapunov
    width, height, row_height = _SIZES[drawing.kind]
    figure = new_figure(width, height + row_height * len(drawing.rows))
    if drawing.kind is FigureKind.LYAPUNOV:
        assert lmap is not None
        names = [*lmap.params, *lmap.axes]
        plot_lyapunov_map(lmap, ax=figure.add_subplot()).set_title(
            full_title(title, names, lmap.params), fontsize=sized(TEXT)
        )
    elif drawing.kind.value in KEYS:
        response = found.responses[drawing.kind.value]
        fixed = dict(response.params)
        fixed.pop(getattr(response, "parameter", ""), None)
        response.plot(ax=figure.add_subplot()).set_title(
            full_title(title, response.model.parameter_names, fixed), fontsize=sized(TEXT)
        )
    elif drawing.kind is FigureKind.PLANE:
        assert plane is not None
        axes = figure.add_subplot()
        if lmap is not None and tuple(lmap.axes) == plane.parameters:
            plot_lyapunov_map(lmap, ax=axes)
        axes.set_title(title_label(title, plane.model.parameter_names), fontsize=sized(TEXT))
        plot_plane(plane, ax=axes, legend_below=True)
    elif drawing.kind in _OF_DIAGRAM:
        assert diagram is not None
        if drawing.kind is FigureKind.DIAGRAM:
            rows = [row_name(row) for row in drawing.rows]
            axes_of_rows = plot_diagram(
                diagram, rows, figure, _behind(found, rows), title, inset=drawing.inset
            )
            _draw_equilibria(axes_of_rows, rows, found)
        else:
            axes = figure.add_subplot()
            plot_branch_graph(diagram, ax=axes)
            axes.set_title(title_label(title, diagram.model.parameter_names), fontsize=sized(TEXT))
    else:
        assert orbit is not None
        if drawing.kind is FigureKind.ORBIT:
            figure.set_size_inches(width, panels_height(orbit))
            plot_orbit_panels(orbit, fig=figure)
        else:
            axes = figure.add_subplot()
            plot_transition_graph(orbit.model, ax=axes, signature=orbit.signature)
    figure.set_layout_engine(
        "none"
    )  # the layout is done, for the labels; a second time costs 0.1 s
    with replacing(path) as temporary:
        save_figure(figure, temporary)
