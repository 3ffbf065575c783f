"""Shared by tasks that follow orbits along one parameter: their schema, checks, tables and figures."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from contfric.base.yaml_schema import positive, whole
from contfric.study.tables import Table, points
from contfric.study.tasks.diagram_record import entries_of, lines_of
from contfric.study.tasks.orbit import POINTS, points_text
from contfric.study.tasks.task import AlongParameter, FigureKind, Found, StudyCheck
from contfric.study.wanted import Want, row_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from contfric.atlas.diagram import Diagram
    from contfric.models.definition import Model
    from contfric.response.sweep import Sweep
    from contfric.study.drawings import Drawing
    from contfric.study.read import Study

BIFURCATIONS = "bifurcations.csv"
#: Rows of a diagram that show a state, which an equilibrium has, too.
_STATES = frozenset({"x_max", "x_min", "stops"})
#: Kernels of the continuation; those that find an orbit are compiled meanwhile.
_CONTINUATION = (
    "contfric.continuation.core.march:march",
    "contfric.continuation.core.locate:locate",
)


class OneParameter(AlongParameter):
    """A task along one parameter."""

    result = "diagram"
    of_orbit = True
    figures: ClassVar = {
        "diagram": FigureKind(9.6, 1.2, 2.4, "a diagram"),
        "branches": FigureKind(9.6, 4.4, called="a graph of branches"),
    }

    max_step: float | None = positive("largest step, as a share of the range", most=1.0)
    max_points: int | None = whole("most points of each side of a branch", least=10)
    stop_at: dict[str, float] | None = Field(
        None,
        description="a mapping of quantities to the value at which a branch ends, such as {x_max: 1.4}",
    )

    def check(self, asked: StudyCheck) -> None:
        """Check the parameter, and its range against the start and the model."""
        super().check(asked)
        fault = _range_fault(asked.model, asked.params, self)
        if fault is not None:
            asked.fail((self.name, "range"), fault)

    def where(self, study: Study, *more: str) -> str:
        """Return the range, where branches end, and what is computed with them, in words."""
        stops = (f"to {name} = {value:g}" for name, value in (self.stop_at or {}).items())
        multipliers = ["with multipliers"] if study.wants(Want.STABILITY) else []
        return ", ".join([self.span, *more, *stops, *multipliers])

    def tables(self, study: Study) -> tuple[str, ...]:
        """Return its two tables."""
        return POINTS, BIFURCATIONS

    def rows_text(self, study: Study) -> str:
        """Return what rows are."""
        return f"{points_text(study)}; one row a bifurcation"

    def ahead(self) -> None:
        """Let a second process compile what a first continuation needs; nothing where it is cached."""
        from contfric import compiled  # spelled so, this file is no source of kernels (sources.py)

        compiled.compile_aside(_CONTINUATION)

    def cut_short(self, found: Diagram) -> bool:
        """Tell whether Ctrl-C ended it (a limit such as ``max_branches`` does not count)."""
        from contfric.events.bifurcation import EndReason

        ends = (end.reason for branch in found.branches for end in branch.ends)
        return EndReason.INTERRUPTED.value in found.notes or EndReason.INTERRUPTED in ends

    def table(self, file: str, study: Study, found: Diagram) -> Table:
        """Return the points of all branches, or the bifurcations."""
        return points(study, found.branches) if file == POINTS else _bifurcations(found)

    def draw(self, figure: Figure, drawing: Drawing, found: Found, title: str) -> None:
        """Draw the diagram, or how its branches are joined."""
        diagram: Diagram = found["diagram"]
        if drawing.kind == "branches":
            from contfric.plot.appearance.names import title_label
            from contfric.plot.appearance.style import TEXT, sized
            from contfric.plot.diagrams.branch_graph import plot_branch_graph

            axes = figure.add_subplot()
            plot_branch_graph(diagram, ax=axes)
            axes.set_title(title_label(title, diagram.model.parameter_names), fontsize=sized(TEXT))
            return
        from contfric.plot.diagrams.diagram import plot_diagram

        rows = [row_name(row) for row in drawing.rows]
        swept = _sweep_of(found, rows)
        axes_of_rows = plot_diagram(diagram, rows, figure, swept, title, inset=drawing.inset)
        _draw_equilibria(axes_of_rows, rows, found)

    def entries(self, found: Diagram) -> dict[str, Any]:
        """Return branches, bifurcations and what follows them."""
        return entries_of(found)

    @classmethod
    def summary(cls, record: dict[str, Any]) -> Iterator[str]:
        """Yield branches, bifurcations and loose ends as tables."""
        if cls.name in record["study"] and "branches" in record:
            yield from lines_of(record)


def _range_fault(model: Model, params: dict[str, float], task: OneParameter) -> str | None:
    """Return what is wrong with a range, None if nothing is."""
    name, (low, high) = task.parameter, task.range
    if low > high:
        return f"the range [{low:g}, {high:g}] is reversed: write [{high:g}, {low:g}]"
    if low == high:
        return (
            f"the range [{low:g}, {high:g}] is empty: the lower end comes first, then a larger one"
        )
    bottom, top, why_bottom, why_top = model.limits(name, params)
    if max(low, bottom) >= min(high, top):
        why = " and ".join(text for text in (why_bottom, why_top) if text)
        return (
            f"no {name} in the range [{low:g}, {high:g}] is possible: model '{model.name}' needs "
            f"{why}, which leaves {name} from {bottom:g} to {top:g}"
        )
    if not low <= params[name] <= high:
        return (
            f"the start, {name} = {params[name]:g}, is outside of the range [{low:g}, {high:g}]: "
            f"give {name} a value inside in 'params', or widen the range"
        )
    return None


# ------------------------------------------------------------------------------------------ table


def _bifurcations(diagram: Diagram) -> Table:
    """Return one row for each bifurcation, in the order of the parameter; mirror images are not."""
    from contfric.quantities.inside import laws_of

    names, contacts = diagram.model.parameter_names, bool(laws_of(diagram.model))
    rows = (
        (
            node.bifurcation.kind.value,
            node.branches[0] + 1,
            diagram.branches[node.branches[0]].name,
            *(node.bifurcation.params[name] for name in names),
            _known(node.bifurcation.stable_before),
            _known(node.bifurcation.stable_after),
            getattr(diagram.scenario(node), "value", ""),
            node.bifurcation.label,
            " ".join(str(k + 1) for k in node.branches),
            node.bifurcation.orbit.period,
            *([" ".join(node.bifurcation.contacts)] if contacts else []),
        )
        for node in diagram.events
    )
    header = ["kind", "branch", "signature", *names, "stable_before", "stable_after", "scenario"]
    header += ["label", "branches", "period"]
    return Table([*header, *(["contacts"] if contacts else [])], rows)


def _known(value: bool | None) -> str:
    return "" if value is None else str(value)


# ---------------------------------------------------------------------------------------- figures


def _sweep_of(found: Found, rows: list[str]) -> Sweep | None:
    """Return the sweep that a diagram is drawn over: along its parameter, with what its rows show."""
    swept: Sweep | None = found.get("sweep")
    if swept is None or swept.parameter != found["diagram"].parameter:
        return None
    return swept if all(swept.shows(row) for row in rows) else None


def _draw_equilibria(axes: list[Axes], rows: list[str], found: Found) -> None:
    """Draw the equilibria of a run into the rows of a diagram along the same parameter that show a state."""
    rest = found.get("equilibria")
    if rest is None or rest.parameter != found["diagram"].parameter:
        return
    for ax, row in zip(axes, rows, strict=True):
        if row in _STATES:
            rest.plot(ax=ax)
            ax.set_xlabel(ax.get_xlabel() if ax is axes[-1] else "")
