"""The figures of a run. Matplotlib is loaded here, and only when a figure is drawn."""

from __future__ import annotations

from pathlib import Path

from contfric.atlas.diagram import Diagram
from contfric.atlas.plane import Plane
from contfric.errors import StudyError
from contfric.orbit.orbit import Orbit
from contfric.results import replacing
from contfric.study.drawings import Drawing
from contfric.study.schema import FigureKind

#: Size in inches: width, height, height added by each row of a diagram.
_SIZES = {
    FigureKind.DIAGRAM: (9.6, 1.2, 2.4),
    FigureKind.ORBIT: (9.0, 6.2, 0.0),
    FigureKind.TRANSITIONS: (7.0, 5.0, 0.0),
    FigureKind.BRANCHES: (9.6, 4.4, 0.0),
    FigureKind.PLANE: (9.6, 6.0, 0.0),
}


def paint(
    path: Path,
    drawing: Drawing,
    orbit: Orbit,
    diagram: Diagram | None,
    title: str,
    plane: Plane | None = None,
) -> None:
    """Draw a figure and write it; a diagram carries the study's title."""
    from contfric.plot.branch_graph import plot_branch_graph
    from contfric.plot.diagram import plot_diagram
    from contfric.plot.graph import plot_transition_graph
    from contfric.plot.orbit import plot_orbit_panels
    from contfric.plot.plane import plot_plane
    from contfric.plot.save import new_figure, save_figure

    width, height, row_height = _SIZES[drawing.kind]
    figure = new_figure(width, height + row_height * len(drawing.rows))
    if drawing.kind in (FigureKind.DIAGRAM, FigureKind.BRANCHES):
        if diagram is None:
            raise StudyError(f"{drawing.file}: there is no diagram to draw")
        figure.suptitle(title)
    if drawing.kind is FigureKind.DIAGRAM:
        assert diagram is not None
        plot_diagram(diagram, rows=[row.value for row in drawing.rows], fig=figure)
    elif drawing.kind is FigureKind.BRANCHES:
        assert diagram is not None
        plot_branch_graph(diagram, ax=figure.add_subplot())
    elif drawing.kind is FigureKind.PLANE:
        if plane is None:
            raise StudyError(f"{drawing.file}: there is no plane to draw")
        figure.suptitle(title)
        plot_plane(plane, ax=figure.add_subplot())
    elif drawing.kind is FigureKind.ORBIT:
        plot_orbit_panels(orbit, fig=figure)
    else:
        axes = figure.add_subplot()
        plot_transition_graph(orbit.model, ax=axes, signature=orbit.signature)
    figure.set_layout_engine("none")  # it has settled, for the labels; a second time costs 0.1 s
    with replacing(path) as temporary:
        save_figure(figure, temporary)
