"""Labels next to points, off the lines and off each other.

Ticks are measured once in a layout: matplotlib does it two to four times for each axis. A layout asks each
axis for its size. The axis then updates its ticks and measures their labels for itself, and once more for
every axis whose label is aligned with its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure, SubFigure
from matplotlib.path import Path
from matplotlib.text import Annotation
from matplotlib.transforms import Bbox, BboxBase
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.plot.appearance.style import GREY, SMALL, sized

#: Distances from the point to the label that are tried, in points; leader lines beyond the first.
_DISTANCES = (5.0, 12.0, 20.0, 30.0, 42.0, 56.0)
_DIRECTIONS = 16
#: Costs: a sampled point of a line beneath the label, a marker, another label, and beyond the axes.
_LINE, _MARKER, _LABEL, _BEYOND = 1.0, 15.0, 500.0, 500.0
#: Spacing at which lines are sampled, and distance at which equal labels are one, in points.
_SPACING, _ONE = 2.16, 10.0
#: Of more labels than this equal ones are one within a greater distance (points), and none stands far away:
#: leader lines that cross tell nothing. Nor does one of many hide more than this (a cost).
_FEW, _ONE_OF_MANY, _NEAREST, _HIDES = 14, 60.0, 3, 30.0
#: Side of the cells in which lines and markers are counted, in points: much finer than a letter.
_CELL = 0.5
#: Radius of a neighbourhood, in points.
_NEAR = 18.0
#: What an axis calls, by names that are no part of matplotlib's interface.
_UPDATE, _MEASURE = "_update_ticks", "_get_ticklabel_bboxes"


@dataclass(frozen=True)
class Anchor:
    """A point, in data coordinates, and the text that belongs to it."""

    x: float
    y: float
    text: str


def place_labels(ax: Axes, anchors: Iterable[Anchor]) -> list[Annotation]:
    """Write a text next to each point where it hides as little as possible.

    Equal texts at points that cannot be told apart are written once, and a text for which there is no place
    left inside of the axes and off the others is left out. Call it when everything else is drawn, the limits
    of the axes are set and the layout has converged (:func:`lay_out`).
    """
    pixels = _point_size(ax)
    todo = _merged(ax, sorted(anchors, key=lambda a: (a.x, a.y)), _ONE * pixels)
    distances: Sequence[float] = _DISTANCES
    most = _LABEL
    if len(todo) > _FEW:
        most = _HIDES
        todo = _merged(ax, todo, _ONE_OF_MANY * pixels)
        distances = _DISTANCES[:_NEAREST]
    drawn = _Drawn(ax, pixels)
    placed: list[Annotation] = []
    for anchor in todo:
        at = np.asarray(ax.transData.transform((anchor.x, anchor.y)))
        label = _annotation(ax, anchor, (0.0, 0.0), leader=False)
        size = np.asarray(label.get_window_extent().size) + 2.0 * pixels
        label.remove()
        centre, distance, cost = drawn.cheapest(at, size, distances)
        if cost >= most:
            continue  # wherever it stood it would hide another one, or too much
        leader = distance > _DISTANCES[0]
        drawn.add_label(at, centre, size, leader)
        x, y = (centre - at) / pixels
        placed.append(_annotation(ax, anchor, (float(x), float(y)), leader=leader))
    return placed


def near(ax: Axes, anchor: Anchor, others: Sequence[Anchor]) -> bool:
    """Tell whether a point lies so near to others that its label would be taken for theirs."""
    reach = _NEAR * _point_size(ax)
    at = ax.transData.transform((anchor.x, anchor.y))
    return any(np.hypot(*(ax.transData.transform((o.x, o.y)) - at)) < reach for o in others)


def lay_out(ax: Axes) -> None:
    """Let the layout of the figure decide where its axes are; labels are placed in pixels."""
    root = _root(ax)
    engine = root.get_layout_engine() if root is not None else None
    if root is not None and engine is not None:
        with ticks_measured_once(root):
            engine.execute(root)


def laid_out(figure: Figure) -> bool:
    """Tell whether a layout has moved the axes of a figure from where they were put."""
    for ax in figure.get_axes():
        spec = ax.get_subplotspec()
        if spec is not None:
            return not np.allclose(
                ax.get_position(original=True).extents, spec.get_position(figure).extents
            )
    return False


def _point_size(ax: Axes) -> float:
    root = _root(ax)
    return float(root.dpi) / 72.0 if root is not None else 1.0


def _root(ax: Axes) -> Figure | None:
    """Return the figure that axes, perhaps inside subfigures, belong to."""
    found: object = ax.figure
    while isinstance(found, SubFigure):
        found = found.figure
    return found if isinstance(found, Figure) else None


def _merged(ax: Axes, anchors: Sequence[Anchor], reach: float) -> list[Anchor]:
    kept: list[Anchor] = []
    for anchor in anchors:
        at = ax.transData.transform((anchor.x, anchor.y))
        same = (k for k in kept if k.text == anchor.text)
        if all(np.hypot(*(ax.transData.transform((k.x, k.y)) - at)) > reach for k in same):
            kept.append(anchor)
    return kept


def _annotation(
    ax: Axes, anchor: Anchor, offset: tuple[float, float], *, leader: bool
) -> Annotation:
    arrow = {"arrowstyle": "-", "color": GREY, "linewidth": 0.6, "shrinkA": 0.0, "shrinkB": 3.0}
    return ax.annotate(
        anchor.text,
        (anchor.x, anchor.y),
        xytext=offset,
        textcoords="offset points",
        ha="center",
        va="center",
        fontsize=sized(SMALL),
        arrowprops=arrow if leader else None,
        zorder=6,
    )


class _Drawn:
    """What is drawn on axes, in pixels: lines, markers, and the boxes of insets and labels."""

    def __init__(self, ax: Axes, pixels: float) -> None:
        self.bbox, self.pixels = ax.bbox, pixels
        self.lines, self.markers = (
            _Counts(ax.bbox, _CELL * pixels, found(ax)) for found in (line_pixels, marker_pixels)
        )
        insets = [child.get_tightbbox() for child in ax.child_axes if isinstance(child, Axes)]
        self.boxes: list[Bbox] = [box for box in insets if box is not None]  # with their numbers

    def cheapest(
        self, at: FloatArray, size: FloatArray, distances: Sequence[float]
    ) -> tuple[FloatArray, float, float]:
        """Return where a label hides least: its centre in pixels, its distance in points, and its cost."""
        angles = 2.0 * np.pi * (np.arange(_DIRECTIONS) + 1.0) / _DIRECTIONS
        towards = np.tile(np.column_stack([np.cos(angles), np.sin(angles)]), (len(distances), 1))
        away = np.repeat(distances, _DIRECTIONS)
        aside = 0.5 * size * np.clip(1.5 * towards, -1, 1)
        centres = at + towards * (away * self.pixels)[:, None] + aside
        low, high = centres - 0.5 * size, centres + 0.5 * size
        cost = 0.8 * away + 1.5 * (1.0 - towards[:, 1])
        cost += _LINE * self.lines.inside(low, high) + _MARKER * self.markers.inside(low, high)
        for other in self.boxes:
            cost += _LABEL * ((low <= other.max) & (other.min <= high)).all(axis=1)
        cost += _BEYOND * ((low < self.bbox.min) | (high > self.bbox.max)).any(axis=1)
        best = int(np.argmin(cost))
        return centres[best], float(away[best]), float(cost[best])

    def add_label(self, at: FloatArray, centre: FloatArray, size: FloatArray, leader: bool) -> None:
        """Add a label: later ones stand neither on it nor on the line that leads to it."""
        self.boxes.append(Bbox([centre - 0.5 * size, centre + 0.5 * size]))
        if leader:
            self.markers.add(np.linspace(at, centre, 12))


class _Counts:
    """Points of a figure, counted in square cells: four sums tell how many lie inside of a box.

    Points beyond the axes do not count: they are not seen.
    """

    def __init__(self, axes: Bbox, cell: float, points: FloatArray) -> None:
        self.cell = cell
        sides = zip(axes.min, np.ceil(np.asarray(axes.size) / cell), strict=True)
        self.edges = [low + cell * np.arange(count + 1.0) for low, count in sides]
        #: Points to the left of and below each corner of a cell.
        self.below = np.zeros([len(edges) for edges in self.edges])
        self.add(points)

    def add(self, points: FloatArray) -> None:
        """Count more points."""
        counts = np.histogram2d(points[:, 0], points[:, 1], bins=self.edges)[0]
        self.below[1:, 1:] += counts.cumsum(axis=0).cumsum(axis=1)

    def inside(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """Return how many points lie inside of each box, up to half a cell; corners of shape (boxes, 2)."""
        left, bottom = self._cells(low)
        right, top = self._cells(high)
        below = self.below
        return below[right, top] - below[left, top] - below[right, bottom] + below[left, bottom]

    def _cells(self, corners: FloatArray) -> list[NDArray[np.int64]]:
        return [
            np.clip(np.rint((corners[:, k] - edges[0]) / self.cell).astype(int), 0, len(edges) - 1)
            for k, edges in enumerate(self.edges)
        ]


def line_pixels(ax: Axes) -> FloatArray:
    """Return points along all lines inside of the axes, evenly spaced in pixels, shape (m, 2)."""
    found, spacing = [np.empty((0, 2))], _SPACING * _point_size(ax)
    for line in ax.lines:
        if line.get_linestyle() in ("None", "none", "", " ") or not line.get_visible():
            continue
        points = np.asarray(line.get_transform().transform(line.get_xydata()))
        gaps = np.flatnonzero(~np.isfinite(points).all(axis=1))
        for piece in np.split(points, gaps):
            drawn = piece[np.isfinite(piece).all(axis=1)]
            found += [_sampled(part, spacing) for part in _inside(drawn, ax.bbox) if len(part) > 1]
    return np.vstack(found)


def _inside(points: FloatArray, box: BboxBase) -> list[FloatArray]:
    """Return the parts of a line inside of a box: one that leaves it by far has points beyond number."""
    if len(points) < 2:
        return []
    left, bottom, right, top = box.extents
    path = Path(points).cleaned(clip=(left, bottom, right, top))
    assert path.codes is not None
    starts = np.flatnonzero(np.isin(path.codes, (Path.MOVETO, Path.STOP)))
    return np.split(path.vertices, starts)[:-1]  # the last one is no vertex


def _sampled(points: FloatArray, spacing: float) -> FloatArray:
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    at = np.arange(0.0, along[-1] + spacing, spacing)
    return np.column_stack([np.interp(at, along, column) for column in points.T])


def marker_pixels(ax: Axes) -> FloatArray:
    """Return points all over the markers of the axes, in pixels, shape (m, 2)."""
    angles = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    ring = np.column_stack([np.cos(angles), np.sin(angles)])
    disc = np.vstack([np.zeros((1, 2)), 0.5 * ring, ring])
    found = [np.empty((0, 2))]
    for line in ax.lines:
        if line.get_marker() in ("None", "none", "", " ", None):
            continue
        radius = 0.5 * float(line.get_markersize()) * _point_size(ax)
        centres = np.asarray(line.get_transform().transform(line.get_xydata()))
        found.append((centres[:, None, :] + radius * disc).reshape(-1, 2))
    return np.vstack(found)


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
