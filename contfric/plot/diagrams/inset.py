"""Insets: the part of a row in which events crowd, drawn larger in an empty corner."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.transforms import Bbox

from contfric.errors import ParameterError
from contfric.plot.appearance.labels import line_pixels, marker_pixels
from contfric.plot.appearance.style import SMALL, sized
from contfric.plot.diagrams.events import Mark

#: False, True (where events crowd), or the part of the parameter that is enlarged.
Inset: TypeAlias = bool | tuple[float, float]

#: Events crowd where so many lie within this share of the range.
_CROWD, _WINDOW = 4, 0.08
#: Space on both sides of the first and last of them, as a share of their distance.
_NEARBY = 0.3
#: Size of an inset, its distance from the frame and what is too near to it, as shares of the axes; space on
#: its left and beneath it for its numbers, at least, and in heights of their letters.
WIDTH, _HEIGHT, _EDGE, _NEAR = 0.3, 0.4, 0.06, 0.03
_LEFT, _BENEATH = (0.03, 4.3), (0.06, 1.5)


def checked_inset(inset: object) -> Inset:
    """Return the part that is asked for.

    Raises
    ------
    ParameterError
        If it is neither a truth value nor two numbers in their order.
    """
    if isinstance(inset, bool):
        return inset
    try:
        low, high = (float(value) for value in inset)  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        low, high = 1.0, 0.0
    if not -np.inf < low < high < np.inf:
        raise ParameterError(
            f"inset is True, False, or (low, high) of the parameter, got {inset!r}"
        )
    return low, high


def crowd(marks: Sequence[Mark], width: float) -> tuple[float, float] | None:
    """Return where the most events lie close together, with space around them; None where they do not.

    Tangencies and events of bridges, which give way to others, do not count.
    """
    at = sorted(m.x for m in marks if m.kind.value != "T" and not m.on_bridges)
    counts = [sum(1 for x in at if 0.0 <= x - first <= _WINDOW * width) for first in at]
    if not counts or max(counts) < _CROWD:
        return None
    k = int(np.argmax(counts))
    low, high = at[k], at[k + counts[k] - 1]
    margin = max(_NEARBY * (high - low), 1e-3 * width)
    return low - margin, high + margin


def add_inset(
    ax: Axes, marks: Sequence[Mark], inset: Inset, draw: Callable[[Axes], None]
) -> tuple[Axes | None, list[Mark]]:
    """Draw a part of a row once more, larger; return it, and the marks that it leaves to the others.

    The axes have their limits and their place. Two lines lead from the part to the inset.
    """
    low, high = sorted(ax.get_xlim())
    part = crowd(marks, high - low) if inset is True else inset
    if not part:
        return None, list(marks)
    inner = ax.inset_axes(_place(ax), zorder=5.5)
    draw(inner)
    inner.set_xlim(*part)
    inner.set_ylim(*_extent(inner, marks, *part))
    inner.set(xlabel="", ylabel="")
    inner.locator_params(nbins=4)
    inner.tick_params(labelsize=sized(SMALL - 1.5))
    ax.indicate_inset_zoom(inner, edgecolor="black", linewidth=0.6)
    return inner, [m for m in marks if not part[0] <= m.x <= part[1]]


def _extent(ax: Axes, marks: Sequence[Mark], low: float, high: float) -> tuple[float, float]:
    """Return the range of the events between two values of the parameter; of the lines, if there are none."""
    values = [m.y for m in marks if low <= m.x <= high]
    if not values:
        for line in ax.lines:
            x, y = np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)
            values.append(y[(x >= low) & (x <= high) & np.isfinite(y)])
    found = np.concatenate([*values, np.empty(0)])
    if not len(found):
        return ax.get_ylim()
    margin = 0.2 * float(np.ptp(found)) or 0.1
    return float(found.min()) - margin, float(found.max()) + margin


def _place(ax: Axes) -> tuple[float, float, float, float]:
    """Return a place in which nothing is drawn, as a share of the axes, which grow upwards if need be."""
    aside, beneath = _numbers(ax)
    found = _empty_place(ax)
    if found is None:
        low, high = ax.get_ylim()
        drawn = 1.0 - _HEIGHT - _EDGE - beneath - 2.0 * _NEAR  # the share that is left to the lines
        ax.set_ylim(low, low + (high - low) / drawn)
        found = _empty_place(ax)
    return found or (_EDGE + aside, 1.0 - _EDGE - _HEIGHT, WIDTH, _HEIGHT)


def _numbers(ax: Axes) -> tuple[float, float]:
    """Return the space for the numbers of an inset, on its left and beneath it, as shares of the axes."""
    frame = ax.get_window_extent()
    letter = sized(SMALL - 1.5) * ax.figure.dpi / 72.0
    return (
        max(_LEFT[0], _LEFT[1] * letter / frame.width - _EDGE),
        max(_BENEATH[0], _BENEATH[1] * letter / frame.height),
    )


def _empty_place(ax: Axes) -> tuple[float, float, float, float] | None:
    """Return a corner, or the middle of a side, in which nothing is drawn."""
    aside, beneath = _numbers(ax)
    points = np.vstack([line_pixels(ax), marker_pixels(ax)])
    shares = ax.transAxes.inverted().transform(points) if len(points) else points
    for left in (_EDGE + aside, 0.5 * (1.0 - WIDTH), 1.0 - _EDGE - WIDTH):
        for bottom in (1.0 - _EDGE - _HEIGHT, _EDGE + beneath):
            box = Bbox.from_bounds(
                left - aside, bottom - beneath, WIDTH + aside, _HEIGHT + beneath
            ).padded(_NEAR)
            if not np.any(np.all((shares > box.min) & (shares < box.max), axis=1)):
                return left, bottom, WIDTH, _HEIGHT
    return None
