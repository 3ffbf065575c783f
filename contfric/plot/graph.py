"""The transition graph: which domain of a model can follow which, and through which surface."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import FancyArrowPatch

from contfric.models import Model
from contfric.plot.appearance.names import surface_label
from contfric.plot.appearance.save import axes_or_new
from contfric.plot.appearance.style import BLACK, GREY, SMALL, TEXT, domain_colours, lighter, sized

if TYPE_CHECKING:
    from contfric.signature import Signature

#: Curvature of an edge, and the radius of a node in points.
_CURVE, _RADIUS = 0.16, 19.0


def plot_transition_graph(
    model: Model, ax: Axes | None = None, signature: Signature | None = None
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
        Its path is highlighted, each step numbered.

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
        if source not in places or target not in places:
            continue
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
        if model.shown(domain.name) != domain.name:
            continue  # the phase is no label
        x = float(sum(v for name, v in domain.signs.items() if name not in switching))
        y = float(sum(v for name, v in domain.signs.items() if name in switching))
        while (x, y) in places.values():
            x += 0.7
        places[domain.name] = (x, y)
    return places


def _steps(signature: Signature | None) -> list[tuple[str, str]]:
    if signature is None:
        return []
    path = list(signature.segments)
    return list(zip(path, [*path[1:], path[0]], strict=True))


def _draw_transition(
    ax: Axes,
    places: dict[str, tuple[float, float]],
    source: str,
    target: str,
    surface: str,
    numbers: Sequence[int],
    highlighted: bool,
) -> None:
    start, end = np.array(places[source]), np.array(places[target])
    colour = BLACK if numbers or not highlighted else "#C4C4C4"
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
    # a quadratic arc passes half of its control point's offset from the chord
    middle = 0.5 * (start + end) + 0.5 * _CURVE * np.array([along[1], -along[0]])
    text = surface_label(surface)
    if numbers:
        text = f"{text} ({', '.join(map(str, numbers))})"
    box = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none"}
    ax.text(
        float(middle[0]),
        float(middle[1]),
        text,
        fontsize=sized(SMALL),
        color=colour if numbers or highlighted else GREY,
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
    """Leave a margin for the nodes and draw no frame."""
    points = np.array(places) if places else np.zeros((1, 2))
    for limits, column in ((ax.set_xlim, points[:, 0]), (ax.set_ylim, points[:, 1])):
        margin = 0.14 * max(float(np.ptp(column)), 1.0) + 0.1
        limits(float(column.min()) - margin, float(column.max()) + margin)
    ax.set_axis_off()
