"""Sweeps: simulated points along a parameter, alone or after the branches of a diagram."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, cast

from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from contfric.base.arrays import FloatArray
from contfric.errors import ParameterError
from contfric.plot.appearance.names import parameter_label
from contfric.plot.appearance.save import axes_or_new, name_axes, title_axes
from contfric.plot.appearance.style import GREY, SMALL, lighter, sized

if TYPE_CHECKING:
    from contfric.quantities.registry import QuantityLike
    from contfric.response.sweep import Sweep

#: Colours of the directions: both read in grey.
_COLOURS = {"up": "#1F4E79", "down": "#C04F15"}
#: Colour of points in the background of branches.
_BACKGROUND = lighter(GREY, 0.2)
#: Size of a point: a thousand values give a thousand columns, which a page does not resolve finer.
_POINT = 1.2
#: Largest size, of few values; values times size that fill the width of axes; and how much larger points of
#: the first direction are.
_LARGE, _DENSE, _LARGER = 4.0, 400.0, 1.8


def plot_sweep(sweep: Sweep, ax: Axes | None = None, state: str | None = None) -> Axes:
    r"""Draw one state of the points of a sweep against its parameter.

    Parameters
    ----------
    sweep : Sweep
    ax : Axes, optional
        Where to draw; new axes by default.
    state : str, optional
        The state; the displacement by default.

    Examples
    --------
    >>> import contfric as cf
    >>> plot_sweep(cf.sweep("coulomb", "Omega", [0.4, 0.45, 0.5])).get_xlabel()
    '$\\Omega$'
    """
    name = sweep.model.states[sweep.state_index(state)]
    ax = axes_or_new(ax)
    size = max(_POINT, min(_LARGE, _DENSE / len(sweep.values)))
    for k, direction in enumerate(sweep.runs):
        x, y = sweep.points(direction, state)
        # points of the first one are larger: seen below those of the second
        larger = _LARGER ** (len(sweep.runs) - 1 - k)
        _draw(ax, x, y, _COLOURS[direction], 2.0, direction, size * larger)
    name_axes(
        ax,
        parameter_label(sweep.parameter),
        f"{parameter_label(name)} at {_section(sweep.section)}",
    )
    title_axes(ax, sweep.model, sweep.params)
    if len(sweep.runs) > 1:
        ax.legend(fontsize=sized(SMALL), markerscale=4.0 * _POINT / size, loc="best")
    return ax


def draw_overlay(
    axes: Sequence[Axes], rows: Sequence[QuantityLike], parameter: str, overlay: Sweep | None
) -> None:
    """Draw the points of a sweep after the rows of a diagram; nothing without a sweep.

    Raises
    ------
    ParameterError
        If it is along another parameter, or its section does not have a row.
    """
    if overlay is None:
        return
    if not hasattr(overlay, "runs"):
        raise ParameterError(f"overlay is a sweep (cf.sweep), got a {type(overlay).__name__}")
    if overlay.parameter != parameter:
        raise ParameterError(
            f"the sweep is along '{overlay.parameter}', and the diagram along '{parameter}'"
        )
    # all of them, before anything is drawn; it says itself what it does not have
    found = [list(overlay.quantity(cast("str", row))) for row in rows]
    for ax, points in zip(axes, found, strict=True):
        for _, x, y in points:
            _draw(ax, x, y, _BACKGROUND, 0.5, None)


def overlay_handle() -> Line2D:
    """Return what a legend shows of the points of a sweep in the background."""
    size = 4.0 * sized(_POINT)
    label = "simulated (sweep)"
    return Line2D([], [], ls="none", marker=".", markersize=size, color=_BACKGROUND, label=label)


def _draw(
    ax: Axes,
    x: FloatArray,
    y: FloatArray,
    colour: str,
    zorder: float,
    label: str | None,
    size: float = _POINT,
) -> None:
    (points,) = ax.plot(
        x, y, linestyle="none", marker=".", markersize=size, color=colour, zorder=zorder
    )
    points.set_label(label or "_nolegend_")
    points.set_rasterized(True)  # a vector file of a million points opens nowhere


def _section(section: str | float) -> str:
    return section if isinstance(section, str) else f"phase {section:g}"
