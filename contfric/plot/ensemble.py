"""Bands of an ensemble, each name in its colour: quantiles as areas, medians as lines, events below."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from contfric.errors import ParameterError
from contfric.plot.appearance.names import event_label, parameter_label
from contfric.plot.appearance.save import axes_or_new, name_axes
from contfric.plot.appearance.style import (
    LINE_WIDTH,
    NEXT_TO,
    SMALL,
    STABLE,
    UNSTABLE,
    branch_colours,
    row_of,
    sized,
)
from contfric.quantities.registry import name_of

if TYPE_CHECKING:
    from contfric.ensembles.ensemble import Ensemble

#: Share of the samples that have an orbit there, above which a band is drawn: quantiles of fewer say little.
_FEW = 0.02
#: Events in at least so many of the diagrams are drawn, a tenth, and of these the most frequent.
_FREQUENT, _MOST = 0.1, 12
#: Height of an event's line, as a share of the axes: below the bands, one above the other.
_LINE = 0.022
#: Opacity of the area of stable and of unstable orbits.
_STABLE_AREA, _UNSTABLE_AREA = 0.30, 0.14


def plot_ensemble(found: Ensemble, ax: Axes | None = None, *, bridges: bool = False) -> Axes:
    r"""Draw the bands of an ensemble: medians as lines within areas of 90 %, and the locations of events.

    Parameters
    ----------
    found : Ensemble
    ax : Axes, optional
        Where to draw; new axes by default.
    bridges : bool
        Whether bands of bridges are drawn, too.

    Examples
    --------
    >>> import contfric as cf
    >>> box, fixed = {"S": (0.30, 0.34)}, {"Omega": 0.5, "S0": 0.4}
    >>> plot_ensemble(cf.ensemble("coulomb", "Omega", (0.5, 0.55), box, fixed, samples=6)).get_xlabel()
    '$\\Omega$'
    """
    ax = axes_or_new(ax)
    most = _FEW * len(found)
    bands = [
        b for b in found.bands() if b.samples.max() > most and (bridges or "hold" not in b.name)
    ]
    called = [b.name.removesuffix(" (image)") for b in bands]
    colours = branch_colours(called)
    named: set[str] = set()
    for name, band in zip(called, bands, strict=True):
        low, middle, high = (np.where(band.samples > most, q, np.nan) for q in band.quantiles)
        stable, colour = band.stable != "unstable", colours[name]
        area = _STABLE_AREA if stable else _UNSTABLE_AREA
        ax.fill_between(found.values, low, high, color=colour, alpha=area, linewidth=0)
        label = None if name in named else name
        named.add(name)
        style = STABLE if stable else UNSTABLE
        ax.plot(found.values, middle, color=colour, ls=style, lw=LINE_WIDTH, label=label)
    _draw_events(ax, found)
    ax.set_xlim(*found.range)
    name_axes(ax, parameter_label(found.parameter), _row_label(found))
    ax.legend(fontsize=sized(SMALL), frameon=False, **NEXT_TO)
    return ax


def _row_label(found: Ensemble) -> str:
    try:
        return row_of(found.row, found.model).name(found.model.states[0])
    except ParameterError:  # a user's function, which its file does not keep
        return name_of(found.row)


def _draw_events(ax: Axes, found: Ensemble) -> None:
    """Draw median and 90 % of each frequent event, each on a line of its own at the foot of the axes."""
    told = [e for e in found.events if e.share >= _FREQUENT and not e.label.startswith("T ")]
    frequent = told[:_MOST]
    if not frequent:
        return
    bottom, top = ax.get_ylim()
    strip = _LINE * (2 + len(frequent))  # of the axes as they are then
    ax.set_ylim(bottom - (top - bottom) * strip / (1.0 - strip), top)
    where = ax.get_xaxis_transform()
    for k, event in enumerate(frequent, start=1):
        low, middle, high = event.quantiles()
        ax.plot([low, high], [k * _LINE] * 2, color="black", lw=1.0, transform=where)
        ax.plot([middle], [k * _LINE], "|", color="black", ms=sized(6.0), transform=where)
        kind, names = event.label.split(" ", 1)
        text = f" {event_label(kind)} {names}, {event.share:.0%} "
        ahead = low + high < sum(found.range)  # the text has more space there
        side = ax.text(high if ahead else low, k * _LINE, text, transform=where, va="center")
        side.set(ha="left" if ahead else "right", fontsize=sized(0.8 * SMALL))
