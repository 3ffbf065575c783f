"""The legend of a diagram: what is seen in it, and nothing else."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from contfric.errors import either
from contfric.plot.appearance.style import (
    BRIDGE_COLOUR,
    BRIDGE_NAME,
    BRIDGE_WIDTH,
    GREY,
    LINE_WIDTH,
    MARKERS,
    MIRROR_WIDTH,
    OTHER_MARKER,
    UNKNOWN_WIDTH,
    lighter,
    sized,
)
from contfric.plot.diagrams.events import Mark
from contfric.plot.diagrams.inset import WIDTH, crowd
from contfric.plot.diagrams.look import Look
from contfric.plot.response import overlay_handle

if TYPE_CHECKING:
    from contfric.continuation.branch import Branch

#: A bridge that is shorter than this share of the axis lies beneath the markers of its ends, and so does a
#: tangency that is this near to an event.
_SMALLEST = 0.01
#: More branches than this are not all named: colours do not tell them apart, and the list would be longer
#: than the figure.
_MOST = 12


def handles_of(
    branches: Sequence[Branch], marks: Sequence[Mark], look: Look, *, mirrors: bool
) -> list[Line2D]:
    """Return the entries of the legend: branches, meaning of the lines, meaning of the markers.

    Where all rows are even, ``mirrors`` is false: images lie on their originals.
    """
    styles = look.styles
    named = _named(branches, list(look.colours))
    handles = [_line(look.names[name], look.colours[name], styles["stable"]) for name in named]
    if len(named) < len(look.colours):
        left = len(look.colours) - len(named)
        handles.append(Line2D([], [], linestyle="none", label=f"and {left} more branches"))
    if mirrors and any(b.mirrored for b in branches):
        handles.append(
            _line("mirror image: lighter", lighter(GREY), styles["stable"], MIRROR_WIDTH)
        )
    regular = [b for b in branches if not b.bridge]
    known = {bool(s) for b in regular if b.stable is not None for s in b.stable}
    if True in known:
        handles.append(_line("stable", GREY, styles["stable"]))
    if False in known:
        handles.append(_line("unstable", GREY, styles["unstable"]))
    if any(b.stable is None for b in regular):
        handles.append(_line("stability not computed", GREY, styles["unknown"], UNKNOWN_WIDTH))
    width = max((float(b.values.max()) for b in branches), default=0.0)
    width -= min((float(b.values.min()) for b in branches), default=0.0)
    windows = [(-np.inf, np.inf, _SMALLEST * width), *_enlarged(marks, width, look)]
    bridges = [b.values for b in branches if b.bridge]
    if any(np.ptp(np.clip(x, a, b)) > least for x in bridges for a, b, least in windows):
        handles.append(_line(BRIDGE_NAME, BRIDGE_COLOUR, styles["bridge"], BRIDGE_WIDTH))
    kinds: dict[str, str] = {}
    for m in (m for window in windows for m in _seen(marks, *window)):
        kinds[m.kind.value] = either(kinds.get(m.kind.value, ""), m.meaning)
    if look.overlay:
        handles.append(overlay_handle())
    order = [*MARKERS, *(k for k in kinds if k not in MARKERS)]
    return handles + [_marker(k, kinds[k]) for k in order if k in kinds]


def _named(branches: Sequence[Branch], names: list[str]) -> list[str]:
    """Return the names that the legend has, in their order: if there are too many, the widest."""
    widths = dict.fromkeys(names, 0.0)
    for branch in branches:
        if branch.name in widths:
            widths[branch.name] = max(widths[branch.name], float(np.ptp(branch.values)))
    widest = sorted(names, key=lambda name: -widths[name])[:_MOST]
    return [name for name in names if name in widest]


def _line(label: str, colour: str, style: Any, width: float = LINE_WIDTH) -> Line2D:
    return Line2D([], [], color=colour, linestyle=style, linewidth=sized(width), label=label)


def _marker(kind: str, meaning: str) -> Line2D:
    marker = MARKERS.get(kind, OTHER_MARKER)
    return Line2D([], [], label=f"{kind}: {meaning}", **marker.look())


def _enlarged(
    marks: Sequence[Mark], width: float, look: Look
) -> Iterator[tuple[float, float, float]]:
    """Yield the part that an inset enlarges, with the least length that is seen in it."""
    part = crowd(marks, width) if look.inset is True else look.inset
    if part:
        yield (*part, _SMALLEST / WIDTH * (part[1] - part[0]))


def _seen(marks: Sequence[Mark], low: float, high: float, least: float) -> list[Mark]:
    """Return the marks of a part that do not lie beneath others: a tangency is a small stroke."""
    inside = [m for m in marks if low <= m.x <= high]
    large = [m.x for m in inside if m.kind.value != "T"]
    return [m for m in inside if m.kind.value != "T" or all(abs(m.x - x) > least for x in large)]
