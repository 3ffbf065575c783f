"""The parts from which drawings of an orbit are made."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from contfric.base.arrays import FloatArray
from contfric.errors import ParameterError, did_you_mean
from contfric.models import Model
from contfric.plot.appearance.labels import Anchor
from contfric.plot.appearance.names import parameter_label, surface_label
from contfric.plot.appearance.style import BLACK, GREY, SMALL, domain_colours, domain_labels, sized
from contfric.plot.orbits.pieces import DomainPiece, rest_bounds, rest_limits

if TYPE_CHECKING:
    from contfric.orbit.orbit import Orbit

#: Colour of where the mass can rest, and width of the line of an orbit.
BAND = "#E4E4E4"
_WIDTH = 2.0
_HELD = (0, (0.6, 0.8))


def value_of(orbit: Orbit, name: str, time: float, state: FloatArray) -> float:
    """Return a state or an observable at a point of the orbit."""
    states = orbit.model.states
    if name in states:
        return float(state[states.index(name)])
    names = [o.name for o in orbit.model.observables]
    if name not in names:
        valid = dict.fromkeys([*states, *names])
        raise ParameterError(f"no state or observable '{name}'{did_you_mean(name, valid)}")
    return orbit.flow.observe(name, time, state)


def along(orbit: Orbit, pieces: Sequence[DomainPiece], name: str) -> list[FloatArray]:
    """Return a state or an observable along each piece."""
    return [
        np.array([value_of(orbit, name, t, y) for t, y in zip(p.times, p.states, strict=True)])
        for p in pieces
    ]


def draw_pieces(
    ax: Axes,
    model: Model,
    pieces: Sequence[DomainPiece],
    across: Sequence[FloatArray],
    up: Sequence[FloatArray],
) -> None:
    """Draw the pieces in the colours of their domains (the domain is the id of the line); holds dotted."""
    colours = domain_colours(model)
    for piece, x, y in zip(pieces, across, up, strict=True):
        (line,) = ax.plot(x, y, color=colours[piece.domain], linewidth=_WIDTH, zorder=3)
        line.set_gid(piece.domain)
        if _is_hold(model, piece):
            line.set_linestyle(_HELD)


def _is_hold(model: Model, piece: DomainPiece) -> bool:
    """Tell whether a piece is a hold: what ends it is no surface."""
    return piece.exit not in model.surface_by_name


def draw_surfaces(ax: Axes, orbit: Orbit, across: str, up: str) -> None:
    """Draw the surfaces that are lines in the plane."""
    draw_levels(ax, orbit, across, vertical=True)
    draw_levels(ax, orbit, up, vertical=False)


def draw_levels(ax: Axes, orbit: Orbit, observable: str, *, vertical: bool) -> None:
    """Draw the surfaces of one observable as lines across the axes, with their names."""
    for surface in orbit.model.surfaces:
        if surface.observable != observable:
            continue
        value = orbit.flow.level(surface.name)
        section = surface.name in orbit.model.section_surfaces
        style = "-" if surface.switching or section else (0, (1.5, 1.5))
        draw = ax.axvline if vertical else ax.axhline
        line = draw(value, color=GREY, linewidth=0.8, linestyle=style, zorder=1)
        line.set_gid(surface.name)
        text = surface_label(surface.name)
        if surface.switching or section:
            text = f"{parameter_label(surface.observable)} = {surface.level}"
        _name_level(ax, text, value, vertical)


def _name_level(ax: Axes, text: str, value: float, vertical: bool) -> None:
    """Write the name of a surface beyond the axes, at the end of its line."""
    at, transform = (value, 1.0), ax.get_xaxis_transform()
    offset, ha, va = (0.0, 2.0), "center", "bottom"
    if not vertical:
        at, transform = (1.0, value), ax.get_yaxis_transform()
        offset, ha, va = (3.0, 0.0), "left", "center"
    ax.annotate(
        text,
        at,
        xycoords=transform,
        xytext=offset,
        textcoords="offset points",
        ha=ha,
        va=va,
        fontsize=sized(SMALL),
        color=GREY,
    )


def draw_moving_surfaces(
    ax: Axes, orbit: Orbit, pieces: Sequence[DomainPiece], across: str, up: str
) -> list[Anchor]:
    """Draw ticks where the orbit crosses a surface, along the surface as it is at that moment.

    Returns the inner end and the name of each.
    """
    anchors: list[Anchor] = []
    states = orbit.model.states
    i, j = states.index(across), states.index(up)
    limits = np.array([ax.get_xlim(), ax.get_ylim()])
    spans, middle = np.ptp(limits, axis=1), limits.mean(axis=1)
    for piece in pieces:
        if orbit.model.is_sliding(piece.domain):
            continue
        surface = orbit.model.surface_by_name[piece.exit]
        if surface.switching or surface.name in orbit.model.section_surfaces:
            continue
        time, state = float(piece.times[-1]), piece.states[-1]
        slope = orbit.flow.gradient(surface.observable, time, state)[[1 + i, 1 + j]] * spans
        if not np.any(slope):  # the surface is of a state that is not drawn
            continue
        tangent = np.array([-slope[1], slope[0]]) / np.hypot(*slope) * spans * 0.035
        ends = np.array([state[[i, j]] - tangent, state[[i, j]] + tangent])
        (line,) = ax.plot(*ends.T, color=BLACK, linewidth=0.9, zorder=4)
        line.set_gid(surface.name)
        inner = min(ends, key=lambda e: float(np.sum(((e - middle) / spans) ** 2)))
        anchors.append(Anchor(float(inner[0]), float(inner[1]), surface_label(surface.name)))
    return anchors


def draw_rest_bands(
    ax: Axes, orbit: Orbit, pieces: Sequence[DomainPiece], across: str, up: str
) -> None:
    """Draw where a stick could rest on the axis, at the moment at which it begins."""
    for piece in pieces:
        if not orbit.model.is_sliding(piece.domain):
            continue
        limits = next(rest_bounds(orbit, across), None)
        if limits is None and across == orbit.model.states[0]:
            limits = rest_limits(orbit, piece)
        if limits is None:
            continue
        height = value_of(orbit, up, float(piece.times[0]), piece.states[0])
        ax.plot(
            limits, [height, height], color=BAND, linewidth=6.0, solid_capstyle="butt", zorder=0.5
        )


def draw_arrow(ax: Axes, across: Sequence[FloatArray], up: Sequence[FloatArray]) -> None:
    """Show the direction of time in the middle of the longest piece."""
    pairs = zip(across, up, strict=True)
    lengths = [float(np.hypot(np.diff(x), np.diff(y)).sum()) for x, y in pairs]
    k = int(np.argmax(lengths))
    m = len(across[k]) // 2
    ax.annotate(
        "",
        (float(across[k][m]), float(up[k][m])),
        xytext=(float(across[k][m - 1]), float(up[k][m - 1])),
        arrowprops={"arrowstyle": "-|>", "color": BLACK, "mutation_scale": 15.0, "linewidth": 0.0},
        zorder=4,
    )


def draw_stops(ax: Axes, orbit: Orbit, across: str, up: str) -> None:
    """Mark stops: filled where a stick begins, open where the solution reverses."""
    for sticks, joint in _stops(orbit):
        x, y = (value_of(orbit, name, float(joint[0]), joint[1:]) for name in (across, up))
        marker = _stop_marker(sticks, [x], [y])
        marker.set_label("_stop")  # not in a legend of one's own
        ax.add_line(marker)


def _stops(orbit: Orbit) -> Iterator[tuple[bool, FloatArray]]:
    """Yield whether a stick follows each stop, and its time and state, shape (1 + n,)."""
    model = orbit.model
    following = [mode for mode, _ in [*orbit.itinerary[1:], orbit.itinerary[0]]]
    for (_, exit_), end, after in zip(orbit.itinerary, orbit.ends, following, strict=True):
        if exit_ == model.stop_surface:
            yield model.mode_by_name[after].sliding, end


def _stop_marker(sticks: bool, x: Sequence[float] = (), y: Sequence[float] = ()) -> Line2D:
    return Line2D(
        x,
        y,
        linestyle="none",
        marker="s" if sticks else "o",
        markersize=5.5,
        markerfacecolor=BLACK if sticks else "white",
        markeredgecolor=BLACK,
        zorder=5,
        label="stop: sticks" if sticks else "stop: reverses",
    )


def legend_handles(orbit: Orbit, pieces: Sequence[DomainPiece]) -> list[Line2D | Patch]:
    """Return the entries of the legend: domains in the order of the orbit, stops, bands."""
    model, colours = orbit.model, domain_colours(orbit.model)
    visited, labels = list(dict.fromkeys(p.domain for p in pieces)), domain_labels(model)
    shown = {labels[name]: colours[name] for name in visited}
    handles: list[Line2D | Patch] = [
        Line2D([], [], color=colour, linewidth=_WIDTH, label=label)
        for label, colour in shown.items()
    ]
    holds = {p.domain for p in pieces if _is_hold(model, p)}
    handles += [
        Line2D([], [], color=colours[d], linewidth=_WIDTH, linestyle=_HELD, label="hold")
        for d in sorted(holds)
    ]
    kinds = {sticks for sticks, _ in _stops(orbit)}
    handles += [_stop_marker(sticks) for sticks in sorted(kinds, reverse=True)]
    if any(model.is_sliding(name) for name in visited):
        handles.append(Patch(color=BAND, label="can rest here"))
    return handles
