"""A fit: measured values with their standard deviations, and predictions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from contfric.plot.appearance.names import parameter_label
from contfric.plot.appearance.save import axes_or_new, name_axes
from contfric.plot.appearance.style import LINE_WIDTH, SMALL, sized

if TYPE_CHECKING:
    from contfric.base.tabled import Columns
    from contfric.fitting.result import Fit


def plot_fit(found: Fit, ax: Axes | None = None) -> Axes:
    """Draw measured and fitted values: series against time, values against what varies between them.

    Parameters
    ----------
    found : Fit
    ax : Axes, optional
        Where to draw; new axes by default.
    """
    ax = axes_or_new(ax)
    table = found.columns()
    in_time = np.isfinite(table["t"])
    across = "t" if np.any(in_time) else _varied(found, table)
    shown = in_time if across == "t" else np.full(len(in_time), True)
    number = table["datum"] if across == "t" else np.unique(table["what"], return_inverse=True)[1]
    for k in np.unique(number[shown]):
        own = np.flatnonzero(shown & (number == k))
        own = own[np.argsort(table[across][own], kind="stable")]
        x, label = table[across][own], str(table["what"][own[0]])
        points = ax.errorbar(
            *(x, table["value"][own], table["sigma"][own]), fmt=".", ms=3.0, lw=0.8, label=label
        )
        colour = points.lines[0].get_color()
        look = "-" if across == "t" else "-x"
        ax.plot(x, table["fitted"][own], look, ms=4.0, color=colour, linewidth=LINE_WIDTH)
    if across == "datum":
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
        ax.set_xlim(0.5, table["datum"].max() + 0.5)
    names = {"t": "$t$", "datum": "datum"}
    look = "line" if across == "t" else "crosses"
    name_axes(ax, names.get(across) or parameter_label(across), f"measured, and fitted ({look})")
    ax.legend(fontsize=sized(SMALL), loc="best")
    return ax


def _varied(found: Fit, table: Columns) -> str:
    """Return the first parameter that differs between the data; their numbers if none does."""
    names = (n for n in found.model.parameter_names if len(np.unique(table[n])) > 1)
    return next(names, "datum")
