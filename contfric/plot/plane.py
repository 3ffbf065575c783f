"""Curves in the plane of two parameters: bifurcations, points of codimension two, quantities."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from contfric.base.arrays import FloatArray
from contfric.errors import ParameterError, either
from contfric.plot.appearance.labels import Anchor, lay_out, place_labels
from contfric.plot.appearance.names import event_label, parameter_label, title_label
from contfric.plot.appearance.save import axes_or_new, name_axes
from contfric.plot.appearance.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    LINE_WIDTH,
    NEXT_TO,
    ORANGE,
    PURPLE,
    SKY,
    SMALL,
    STABLE,
    UNSTABLE,
    VERMILLION,
    row_of,
    sized,
)

if TYPE_CHECKING:
    from contfric.atlas.plane.plane import Plane
    from contfric.curves.curve import Curve
    from contfric.curves.of_quantities.curve import QuantityCurve
    from contfric.curves.special import SpecialPoint

#: Colour and width of each kind: what bounds smooth families is strong, where the flow jumps it is fine.
_LOOKS = {
    "SN": (VERMILLION, 1.7),
    "BP": (BLUE, 1.7),
    "PD": (GREEN, 1.7),
    "CS": (BLACK, 1.5),
    "SS": (ORANGE, 1.1),
    "AS": (PURPLE, 1.1),
    "GS": (SKY, 1.1),
    "T": (GREY, 0.7),
}
#: A plane with more points of codimension two than this does not write their names, one with more curves
#: does not label them all: the longest only.
_MOST_NAMES, _MOST_LABELS = 24, 24
#: Where the legend stands: inside of axes that are given, on white, or below them.
_INSIDE: Mapping[str, Any] = {"loc": "best", "framealpha": 0.9, "edgecolor": "none"}
_BELOW: Mapping[str, Any] = {
    "loc": "upper center",
    "bbox_to_anchor": (0.5, -0.1),
    "ncol": 4,
    "frameon": False,
}
#: A point at which a curve is relabelled is marked small and not named.
_RELABELS = "T"


def plot_quantity_curve(curve: QuantityCurve, ax: Axes | None = None) -> Axes:
    """Draw a curve in its plane, dashed where orbits are unstable.

    Parameters
    ----------
    curve : QuantityCurve
    ax : Axes, optional
        Where to draw; new axes by default.
    """
    ax = axes_or_new(ax)
    label = _curve_label(curve)
    labels = {True: label, False: f"{label} (unstable orbits)"}
    for stable, group in itertools.groupby(range(len(curve)), key=lambda k: bool(curve.stable[k])):
        run = list(group)
        part = curve.values[run[0] : run[-1] + 2]  # to the first point of the next run
        look = STABLE if stable else UNSTABLE
        ax.plot(
            *part.T,
            linestyle=look,
            color=BLUE,
            linewidth=LINE_WIDTH,
            label=labels.pop(stable, None),
        )
    name_axes(ax, parameter_label(curve.parameters[0]), parameter_label(curve.parameters[1]))
    ax.legend(fontsize=sized(SMALL), loc="best")
    return ax


def _curve_label(curve: QuantityCurve) -> str:
    """Return the label of a curve of orbits, its quantity as on the axis of a diagram."""
    held, model = curve.quantity, curve.model
    if not curve.label.startswith(held):
        return curve.label
    try:
        name = row_of(held, model).name(model.states[0])
    except ParameterError:  # a user's function, which its file does not keep
        name = held
    return name + title_label(curve.label[len(held) :], curve.parameters)


def plot_curves(curves: Sequence[Curve], ax: Axes | None = None, *, special: bool = True) -> Axes:
    r"""Draw curves of bifurcations in their plane.

    The colour is that of the kind. A line is solid where it bounds a region of stable orbits, else dashed.

    Parameters
    ----------
    curves : sequence of Curve
    ax : Axes, optional
        Where to draw; new axes by default.
    special : bool
        Whether to mark and name the points of codimension two.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> fold = cf.continue_orbit(orbit, "Omega", (0.4, 0.6)).bifurcations[-2]
    >>> ranges = {"Omega": (0.5, 0.6), "S": (0.2, 0.4)}
    >>> plot_curves([cf.continue_bifurcation(fold, ("Omega", "S"), ranges)]).get_ylabel()
    '$S$'
    """
    points = [s for curve in curves for s in curve.special] if special else []
    return _draw(
        axes_or_new(ax), curves, range(len(curves)), points, NEXT_TO if ax is None else _INSIDE
    )


def plot_plane(
    plane: Plane, ax: Axes | None = None, *, special: bool = True, legend_below: bool = False
) -> Axes:
    """Draw the curves of a plane, as Figs. 8 to 11 of the reference.

    Parameters
    ----------
    plane : Plane
    ax : Axes, optional
        Where to draw; new axes by default.
    special : bool
        Whether to mark and name the points of codimension two.
    legend_below : bool
        Whether the legend stands below given axes, and not inside.
    """
    new = axes_or_new(ax)
    new.set_xlim(*plane.ranges[0])
    new.set_ylim(*plane.ranges[1])
    points = plane.special if special else ()
    where = NEXT_TO if ax is None else _BELOW if legend_below else _INSIDE
    return _draw(new, plane.curves, plane.twins, points, where)


def _draw(
    ax: Axes,
    curves: Sequence[Curve],
    twins: Sequence[int],
    special: Sequence[SpecialPoint],
    legend: Mapping[str, Any],
) -> Axes:
    for index, curve in enumerate(curves):
        first = index == twins[index]
        for kind, values, stable in _pieces(curve):
            colour, width = _LOOKS.get(kind, (GREY, 1.0))
            if (
                stable or first
            ):  # another itinerary for the same solution shows where it is stable, no more
                style = STABLE if stable else UNSTABLE
                (line,) = ax.plot(*values.T, color=colour, linewidth=width, linestyle=style)
                line.set_gid(curve.label)
    names = curves[0].parameters if curves else ("", "")
    name_axes(ax, parameter_label(names[0]), parameter_label(names[1]))
    _mark(ax, special, names)
    _legend(ax, curves, special, legend)
    lay_out(ax)
    shown = [c for k, c in enumerate(curves) if twins[k] == k]
    shown.sort(key=lambda c: -float(_lengths(ax, c)[-1]))
    anchors = [a for a in (_label_of(ax, c) for c in shown[:_MOST_LABELS]) if a is not None]
    named = [s for s in special if not s.name.endswith(_RELABELS)]
    if len(named) <= _MOST_NAMES:
        anchors += [Anchor(*_place(s, names), s.name) for s in named]
    place_labels(ax, anchors)
    return ax


def _pieces(curve: Curve) -> list[tuple[str, FloatArray, bool]]:
    """Return the stretches of one kind and stability; each reaches to the start of the next one."""
    kinds = [kind.value for kind in curve.kinds]
    values, stable = curve.values, curve.stable
    change = [
        k for k in range(1, len(kinds)) if kinds[k] != kinds[k - 1] or stable[k] != stable[k - 1]
    ]
    edges = [0, *change, len(kinds)]
    return [(kinds[a], values[a : b + 1], bool(stable[a])) for a, b in itertools.pairwise(edges)]


def _place(special: SpecialPoint, names: tuple[str, str]) -> tuple[float, float]:
    return special.params[names[0]], special.params[names[1]]


def _mark(ax: Axes, special: Sequence[SpecialPoint], names: tuple[str, str]) -> None:
    """Mark points of codimension two; small where segments are relabelled only."""
    for point in special:
        relabels = point.name.endswith(_RELABELS)
        (line,) = ax.plot(
            *_place(point, names),
            linestyle="none",
            marker="." if relabels else "o",
            markersize=3.0 if relabels else 4.5,
            markerfacecolor=GREY if relabels else "white",
            markeredgecolor=GREY if relabels else BLACK,
            markeredgewidth=0.8,
            zorder=5,
        )
        line.set_gid(point.name)


def _label_of(ax: Axes, curve: Curve) -> Anchor | None:
    """Return the label of a curve at the middle of what is seen of it."""
    values, along = curve.values, _lengths(ax, curve)
    if along[-1] <= 0.0:
        return None
    middle = int(np.searchsorted(along, 0.5 * along[-1]))
    return Anchor(float(values[middle, 0]), float(values[middle, 1]), event_label(curve.label))


def _lengths(ax: Axes, curve: Curve) -> FloatArray:
    """Return how much of a curve is seen up to each of its points, in sizes of the axes."""
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    places = (curve.values - (left, low)) / (right - left, high - low)
    inside = np.all((places >= 0.0) & (places <= 1.0), axis=1)
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1) * (inside[1:] & inside[:-1])
    return np.concatenate([[0.0], np.cumsum(steps)])


def _legend(
    ax: Axes, curves: Sequence[Curve], special: Sequence[SpecialPoint], where: Mapping[str, Any]
) -> None:
    """Say what colours and dashes mean."""
    kinds: dict[str, str] = {}
    for curve in curves:
        for name, text in curve.meanings.items():
            kinds[name] = either(kinds.get(name, ""), text)
    handles = [
        Line2D([], [], color=colour, linewidth=width, label=f"{name}: {kinds[name]}")
        for name, (colour, width) in _LOOKS.items()
        if name in kinds
    ]
    styles: dict[str, Any] = {
        "bounds stable orbits": STABLE,
        "unstable orbits only": UNSTABLE,
    }
    for meaning, style in styles.items():
        handles.append(Line2D([], [], color=GREY, linestyle=style, label=meaning))
    relabels = [point.name.endswith(_RELABELS) for point in special]
    if not all(relabels):
        ring = Line2D([], [], linestyle="none", marker="o", label="codimension two")
        ring.set(markersize=4.5, markerfacecolor="white", markeredgecolor=BLACK)
        handles.append(ring)
    if any(relabels):
        dot = Line2D([], [], linestyle="none", marker=".", label="T: segments relabelled")
        dot.set(markersize=3.0, color=GREY)
        handles.append(dot)
    ax.legend(handles=handles, fontsize=sized(SMALL), **where)
