"""Graphs: the transitions between the domains of a model, and the branches of a diagram."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import FancyArrowPatch

from contfric.models import Model
from contfric.plot.events import draw_event
from contfric.plot.labels import Anchor, place_labels, settle
from contfric.plot.protocols import BifurcationLike, BranchLike, DiagramLike, SignatureLike
from contfric.plot.save import axes_or_new
from contfric.plot.style import (
    BLACK,
    BRIDGE_COLOUR,
    GREY,
    SMALL,
    TEXT,
    branch_colours,
    domain_colours,
    event_label,
    lighter,
    parameter_label,
    surface_label,
)

#: An event and the indices of the branches that meet there.
_Event = tuple[BifurcationLike, set[int]]
#: Curvature of an edge, and the radius of a node in points.
_CURVE, _RADIUS = 0.16, 19.0


def plot_transition_graph(
    model: Model, ax: Axes | None = None, signature: SignatureLike | None = None
) -> Axes:
    """Draw which domain can follow which, and through which surface.

    The domains stand as in the phase space: from left to right by the observables of the
    transparent surfaces, from bottom to top by those of the surfaces that switch.

    Parameters
    ----------
    model : Model
    ax : Axes, optional
        Where to draw; new axes by default.
    signature : Signature, optional
        Its walk is highlighted, each step numbered.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> ax = plot_transition_graph(load_model("coulomb"))
    >>> len(ax.patches)
    14
    """
    new = axes_or_new(ax, 7.0, 4.6)
    places = domain_places(model)
    steps = _steps(signature)
    for (source, surface), target in model.transitions.items():
        numbers = [k for k, pair in enumerate(steps, start=1) if pair == (source, target)]
        _draw_transition(new, places, source, target, surface, numbers, bool(steps))
    colours = domain_colours(model)
    visited = {source for source, _ in steps}
    for name, place in places.items():
        faded = bool(steps) and name not in visited
        draw_node(new, model.domain_by_name[name].label or name, place, colours[name], faded)
    frame_nodes(new, list(places.values()))
    return new


def domain_places(model: Model) -> dict[str, tuple[float, float]]:
    """Return where each domain stands: by the signs of its surfaces, no two at one place.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> domain_places(load_model("coulomb"))["x+v-"]
    (2.0, -1.0)
    """
    switching = {s.name for s in model.surfaces if s.switching}
    places: dict[str, tuple[float, float]] = {}
    for domain in model.domains:
        x = float(sum(v for name, v in domain.signs.items() if name not in switching))
        y = float(sum(v for name, v in domain.signs.items() if name in switching))
        while (x, y) in places.values():
            x += 0.7
        places[domain.name] = (x, y)
    return places


def plot_diagram_graph(diagram: DiagramLike, ax: Axes | None = None) -> Axes:
    """Draw how the branches of a diagram are joined by its bifurcations.

    From left to right branches and bifurcations stand in the order of the parameter (the middle of
    a branch), from bottom to top mirror images, symmetric branches and the others. Tangencies are
    left out.

    Parameters
    ----------
    diagram : Diagram
    ax : Axes, optional
        Where to draw; new axes by default.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> ax = plot_diagram_graph(cf.explore(orbit, "Omega", (0.4, 0.6)))
    """
    new = axes_or_new(ax, 7.6, 4.2)
    events = _joined(diagram)
    branches, nodes = _graph_places(diagram, events)
    colours = branch_colours(b.name for b in diagram.branches if not b.bridge)
    for (event, meeting), place in zip(events, nodes, strict=True):
        for k in sorted(meeting):
            new.plot(*zip(place, branches[k], strict=True), color=GREY, linewidth=1.0, zorder=1)
        draw_event(new, event, place)
    for branch, place in zip(diagram.branches, branches, strict=True):
        colour = BRIDGE_COLOUR if branch.bridge else colours[branch.name]
        colour = lighter(colour) if branch.mirrored else colour
        draw_node(new, branch.name, place, colour, False)
    frame_nodes(new, [*branches, *nodes])
    settle(new)
    anchors = [
        Anchor(*place, _event_text(event, diagram.parameter))
        for (event, _), place in zip(events, nodes, strict=True)
    ]
    place_labels(new, anchors)
    return new


# --------------------------------------------------------------------------- transition graph


def _steps(signature: SignatureLike | None) -> list[tuple[str, str]]:
    if signature is None:
        return []
    walk = list(signature.segments)
    return list(zip(walk, [*walk[1:], walk[0]], strict=True))


def _draw_transition(
    ax: Axes,
    places: dict[str, tuple[float, float]],
    source: str,
    target: str,
    surface: str,
    numbers: Sequence[int],
    walked: bool,
) -> None:
    start, end = np.array(places[source]), np.array(places[target])
    colour = BLACK if numbers or not walked else "#C4C4C4"
    arrow = FancyArrowPatch(
        (float(start[0]), float(start[1])),
        (float(end[0]), float(end[1])),
        connectionstyle=f"arc3,rad={_CURVE}",
        arrowstyle="-|>",
        mutation_scale=12.0,
        linewidth=2.0 if numbers else 0.9,
        color=colour,
        shrinkA=_RADIUS,
        shrinkB=_RADIUS,
        zorder=2 if numbers else 1,
    )
    arrow.set_gid(f"{source} -> {target}")
    ax.add_patch(arrow)
    along = end - start
    # a quadratic arc passes half of its control point's offset beside the chord
    middle = 0.5 * (start + end) + 0.5 * _CURVE * np.array([along[1], -along[0]])
    text = surface_label(surface)
    if numbers:
        text = f"{text} ({', '.join(map(str, numbers))})"
    box = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none"}
    ax.text(
        float(middle[0]),
        float(middle[1]),
        text,
        fontsize=SMALL,
        color=colour if numbers or walked else GREY,
        ha="center",
        va="center",
        bbox=box,
        zorder=3,
    )


def draw_node(ax: Axes, label: str, place: tuple[float, float], colour: str, faded: bool) -> None:
    """Draw a node with its name in it."""
    colour = lighter(colour, 0.8) if faded else colour
    ax.plot(
        *place,
        marker="o",
        markersize=2.0 * _RADIUS - 4.0,
        markerfacecolor="white",
        markeredgecolor=colour,
        markeredgewidth=2.4,
        zorder=4,
    )
    grey = GREY if faded else BLACK
    size = TEXT if len(label) < 6 or "$" in label else SMALL - 2.0
    wrapped = label.replace(", ", ",\n")
    ax.text(*place, wrapped, ha="center", va="center", fontsize=size, color=grey, zorder=5)


def frame_nodes(ax: Axes, places: Sequence[tuple[float, float]]) -> None:
    """Leave room for the nodes and draw no frame."""
    points = np.array(places) if places else np.zeros((1, 2))
    for limits, column in ((ax.set_xlim, points[:, 0]), (ax.set_ylim, points[:, 1])):
        room = 0.14 * max(float(np.ptp(column)), 1.0) + 0.1
        limits(float(column.min()) - room, float(column.max()) + room)
    ax.set_axis_off()


# ------------------------------------------------------------------------------ diagram graph


def _joined(diagram: DiagramLike) -> list[_Event]:
    """Return the events with the branches that meet there; images that share a branch are one."""
    parameter = diagram.parameter
    events: list[_Event] = []
    for node in diagram.nodes:
        new, meeting = node.bifurcation, set(node.branches)
        if new.kind.value == "T":
            continue
        for old, known in events:
            near = abs(old.params[parameter] - new.params[parameter]) <= 1e-9
            if near and old.kind.value == new.kind.value and known & meeting:
                known.update(meeting)
                break
        else:
            events.append((new, meeting))
    return events


def _graph_places(
    diagram: DiagramLike, events: Sequence[_Event]
) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """Return the places of branches and events: x by rank of the parameter, y by symmetry."""
    middles = [0.5 * (float(b.values.min()) + float(b.values.max())) for b in diagram.branches]
    at = [event.params[diagram.parameter] for event, _ in events]
    ranks = _ranks([*middles, *at])
    heights = _heights(diagram.branches)
    branches = list(zip(ranks[: len(middles)], heights, strict=True))
    nodes: list[tuple[float, float]] = []
    for (_, meeting), x in zip(events, ranks[len(middles) :], strict=True):
        y = float(np.mean([heights[k] for k in meeting])) if meeting else 0.0
        while any(abs(x - a) < 0.3 and abs(y - b) < 0.2 for a, b in [*branches, *nodes]):
            y += 0.25
        nodes.append((x, y))
    return branches, nodes


def _ranks(values: Sequence[float]) -> list[float]:
    """Return the rank of each value; images of one another share it."""
    order = sorted(values)
    distinct: list[float] = []
    for value in order:
        if not distinct or value - distinct[-1] > 1e-9 * (1.0 + abs(value)):
            distinct.append(value)
    return [float(np.argmin([abs(value - d) for d in distinct])) for value in values]


def _heights(branches: Sequence[BranchLike]) -> list[float]:
    """Return 0 for symmetric branches, +1, +2.. for the others, -1, -2.. for mirror images."""
    seen: Counter[bool] = Counter()
    heights: list[float] = []
    for branch in branches:
        if branch.symmetric:
            heights.append(0.0)
            continue
        seen[branch.mirrored] += 1
        heights.append(float(seen[branch.mirrored]) * (-1.0 if branch.mirrored else 1.0))
    return heights


def _event_text(event: BifurcationLike, parameter: str) -> str:
    value = event.params[parameter]
    return f"{event_label(event.label)}\n{parameter_label(parameter)} = {value:.5g}"
