"""Ticks measured once in a layout: matplotlib does it two to four times for each axis that has not moved.

A layout asks each axis for its size. The axis then updates its ticks and measures their labels for itself,
and once more for every axis whose label is aligned with its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from matplotlib.axis import Axis
from matplotlib.figure import Figure

#: What an axis calls, by names that are no part of matplotlib's interface.
_UPDATE, _MEASURE = "_update_ticks", "_get_ticklabel_bboxes"


@contextmanager
def ticks_measured_once(figure: Figure) -> Iterator[None]:
    """Let the axes of a figure keep their ticks while they stay where they are, in a ``with``.

    Nothing else may change in the figure there but its layout. Where matplotlib has no methods of these names
    nothing is kept.
    """
    known = all(hasattr(Axis, name) for name in (_UPDATE, _MEASURE))
    axes = [axis for ax in figure.axes for axis in (ax.xaxis, ax.yaxis)] if known else []
    for axis in axes:
        for name in (_UPDATE, _MEASURE):
            setattr(axis, name, _kept(axis, getattr(axis, name)))
    try:
        yield
    finally:
        for axis in axes:
            for name in (_UPDATE, _MEASURE):
                delattr(axis, name)


def _kept(axis: Axis, method: Callable[..., Any]) -> Callable[..., Any]:
    """Return a method that answers as the last time where axes, limits and arguments are those of then."""
    last: list[Any] = [None, None, ()]

    def answer(*given: Any) -> Any:
        where = (*axis.axes.bbox.bounds, *axis.get_view_interval())
        asked = (where, [*map(id, given[0])] if given else None)
        if last[0] != asked:
            last[:] = asked, method(*given), given  # what is held keeps its identity
        return last[1]

    return answer
