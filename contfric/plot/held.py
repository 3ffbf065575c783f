"""Curves in two parameters on which a quantity has one value."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from matplotlib.axes import Axes

from contfric.plot.names import parameter_label
from contfric.plot.save import axes_or_new, name_axes
from contfric.plot.style import BLUE, LINE_WIDTH, SMALL, STABLE, UNSTABLE, sized

if TYPE_CHECKING:
    from contfric.curves.quantity_curve import QuantityCurve


def plot_quantity_curve(curve: QuantityCurve, ax: Axes | None = None) -> Axes:
    """Draw a curve in its plane, dashed where orbits are unstable.

    Parameters
    ----------
    curve : QuantityCurve
    ax : Axes, optional
        Where to draw; new axes by default.
    """
    ax = axes_or_new(ax)
    label: str | None = curve.label
    for stable, group in groupby(range(len(curve)), key=lambda k: bool(curve.stable[k])):
        run = list(group)
        part = curve.values[run[0] : run[-1] + 2]  # to the first point of the next run
        look = STABLE if stable else UNSTABLE
        ax.plot(*part.T, linestyle=look, color=BLUE, linewidth=LINE_WIDTH, label=label)
        label = None
    name_axes(ax, parameter_label(curve.parameters[0]), parameter_label(curve.parameters[1]))
    ax.legend(fontsize=sized(SMALL), loc="best")
    return ax
