"""Branches from the sides of their starts: one array a column, bifurcations in order."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contfric.continuation.branch import Branch
from contfric.continuation.events import Bifurcation, End
from contfric.continuation.openings import with_openings
from contfric.continuation.points import Point, Settings
from contfric.continuation.side import Side
from contfric.orbit.orbit import Orbit


def join(orbit: Orbit, settings: Settings, behind: Side, ahead: Side) -> Branch:
    """Return one branch from the two sides of its start."""
    shift = behind.tip.arc
    back = [
        replace(
            b,
            position=shift - b.position,
            stable_before=b.stable_after,
            stable_after=b.stable_before,
        )
        for b in reversed(behind.bifurcations)
    ]
    front = [replace(b, position=shift + b.position) for b in ahead.bifurcations]
    first, last = behind.end, ahead.end
    if first.bifurcation is not None:
        b = first.bifurcation
        first = replace(
            first,
            bifurcation=replace(
                b,
                position=shift - b.position,
                stable_before=b.stable_after,
                stable_after=b.stable_before,
            ),
        )
    if last.bifurcation is not None:
        moved = replace(last.bifurcation, position=shift + last.bifurcation.position)
        last = replace(last, bifurcation=moved)
    return _branch(orbit, settings, behind, ahead, (*back, *front), (first, last))


def assemble(
    orbit: Orbit, settings: Settings, side: Side, first: End, origin: Point | None = None
) -> Branch:
    """Return a branch of one side, with the end at which it starts and, if known, the point there."""
    ends = first, side.end
    return _branch(orbit, settings, None, side, tuple(side.bifurcations), ends, origin)


def _branch(
    orbit: Orbit,
    settings: Settings,
    behind: Side | None,
    ahead: Side,
    bifurcations: tuple[Bifurcation, ...],
    ends: tuple[End, End],
    origin: Point | None = None,
) -> Branch:
    events = [end.bifurcation for end in ends]
    listed = (
        *([events[0]] if events[0] is not None else []),
        *bifurcations,
        *([events[1]] if events[1] is not None else []),
    )
    columns = _joined(behind, ahead, origin)
    branch = Branch(
        orbit.system,
        settings.parameter,
        orbit.vector,
        columns["values"],
        columns["joints"],
        columns["arc"],
        columns["labels"],
        columns["mu"][:, : orbit.model.directions] if settings.stability else None,
        listed,
        ends,
    )
    return with_openings(branch, settings.width)


def _joined(behind: Side | None, ahead: Side, origin: Point | None) -> dict[str, NDArray[Any]]:
    """Return the columns of both sides as one; the first point of ``behind`` is that of ``ahead``.

    ``origin`` is a point before the first one.
    """
    front = ahead.columns()
    if behind is None:
        joined = {name: front.take(name) for name in ahead.names}
    else:
        back, shift = behind.columns(), behind.tip.arc
        back.arrays["arc"] *= -1.0
        joined = {name: front.take_behind(name, back) for name in ahead.names}
        joined["arc"] += shift
    if origin is not None:
        first = {"values": origin.value, "joints": origin.joints, "arc": origin.arc}
        first |= {"labels": origin.labels, "mu": origin.mu}
        joined = {n: np.concatenate([np.array([first[n]]), joined[n]]) for n in ahead.names}
    return joined
