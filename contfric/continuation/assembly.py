"""Branches from their two half-branches: one array a column, bifurcations in order."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.base.attributes import altered
from contfric.continuation.branch import Branch
from contfric.continuation.families.continuum import continua_of
from contfric.continuation.families.passed import with_families
from contfric.continuation.half_branch import Side
from contfric.continuation.points import Point, Settings
from contfric.continuation.singular_points.openings import with_openings
from contfric.events.bifurcation import ACCURACY, TERMINAL, Bifurcation, End, Kind
from contfric.orbit.orbit import Orbit

#: Share of the range above which a branch is wider than any event's accuracy that makes sense: those need not
#: be computed.
_NARROW = 0.01
#: A multiplier on the unit circle next to the end of a branch (a few roots of rounding; at the end itself
#: it is known to a few digits only), and how near (arclength) events are to it that are rounding then.
_CRITICAL, _NEAR_END = 1e-6, 1e-3


def join(orbit: Orbit, settings: Settings, behind: Side, ahead: Side) -> Branch:
    """Return one branch from the two sides of its start."""
    shift = behind.position
    back = [_turned(b, shift) for b in reversed(behind.bifurcations)]
    front = [altered(b, position=shift + b.position) for b in ahead.bifurcations]
    first, last = behind.end, ahead.end
    if first.bifurcation is not None:
        first = altered(first, bifurcation=_turned(first.bifurcation, shift))
    if last.bifurcation is not None:
        moved = altered(last.bifurcation, position=shift + last.bifurcation.position)
        last = altered(last, bifurcation=moved)
    return _branch(orbit, settings, behind, ahead, (*back, *front), (first, last))


def _turned(b: Bifurcation, shift: float) -> Bifurcation:
    """Return an event of a side that the branch runs through backwards."""
    turned = altered(b, position=shift - b.position)
    if b.kind is not Kind.SN:
        return turned
    # at a fold both sides lie at the same values: only the order of the branch tells them apart
    return altered(turned, stable_before=b.stable_after, stable_after=b.stable_before)


def assemble(
    orbit: Orbit, settings: Settings, side: Side, first: End, origin: Point | None = None
) -> Branch:
    """Return a branch of one side, with the end at which it starts and, if known, the point there."""
    ends = first, side.end
    return _branch(orbit, settings, None, side, tuple(side.bifurcations), ends, origin)


def _told_upward(first: End, values: FloatArray) -> End:
    """Return the event that a branch starts from with the stability in the order of the parameter."""
    b = first.bifurcation
    if b is None or b.kind is Kind.SN or b.stable_before is not None:
        return first
    if len(values) < 2 or values[1] >= values[0]:
        return first
    upward = altered(b, stable_before=b.stable_after, stable_after=None)
    return altered(first, bifurcation=upward)


def _branch(
    orbit: Orbit,
    settings: Settings,
    behind: Side | None,
    ahead: Side,
    bifurcations: tuple[Bifurcation, ...],
    ends: tuple[End, End],
    origin: Point | None = None,
) -> Branch:
    columns = _joined(behind, ahead, origin)
    bifurcations, unknown = _known(bifurcations, ends, columns, settings)
    if behind is None:
        ends = _told_upward(ends[0], columns["values"]), ends[1]
    events = [end.bifurcation for end in ends]
    listed = (
        *([events[0]] if events[0] is not None else []),
        *bifurcations,
        *([events[1]] if events[1] is not None else []),
    )
    notes = (*(() if behind is None else behind.notes), *ahead.notes, *unknown)
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
        notes=tuple(dict.fromkeys(notes)),
    )
    _renew_ends(branch)
    branch = _without_critical_ends(branch, settings)
    if continua := tuple(continua_of(branch)):
        branch = altered(branch, notes=(*branch.notes, *continua))
    return with_openings(with_families(branch, settings), settings)


def _known(
    events: tuple[Bifurcation, ...],
    ends: tuple[End, End],
    columns: dict[str, NDArray[Any]],
    settings: Settings,
) -> tuple[tuple[Bifurcation, ...], list[str]]:
    """Return the events without folds that are not known to be any, and a note for each of these."""
    kept, notes = [], []
    for b in events:
        turns = _turns_by(b, ends, columns, settings.parameter) if b.kind is Kind.SN else np.inf
        if turns < _NARROW * settings.width and turns <= b.accuracy * settings.width:
            location = f"{settings.parameter} = {b.params[settings.parameter]:.12g}"
            notes.append(
                f"{location}: the slope changes its sign within rounding, no fold is listed"
            )
        else:
            kept.append(b)
    return tuple(kept), notes


def _turns_by(
    fold: Bifurcation, ends: tuple[End, End], columns: dict[str, NDArray[Any]], name: str
) -> float:
    """Return by how much the parameter changes over a branch, or from a fold to a sliding event at its end.

    If that is less than a fold's is known to, the sign of the slope is rounding: on a branch between two
    events in one location, next to a continuum of orbits, or where the equations are singular at the end.
    """
    values, arc = columns["values"], columns["arc"]
    turns = float(np.ptp(values)) if len(values) else 0.0
    for end, beyond in zip(ends, (arc <= fold.position, arc >= fold.position), strict=True):
        if (last := end.bifurcation) is not None and last.kind in TERMINAL:
            part = np.append(values[beyond], last.params[name]) - fold.params[name]
            turns = min(turns, float(np.abs(part).max()))
    return turns


def _without_critical_ends(branch: Branch, settings: Settings) -> Branch:
    """Return a branch without the branch points of a multiplier that is 1 at an AS that ends it.

    Where a contact comes to rest for good the locations at which it may are a continuum: a multiplier tends
    to 1 there, and before that, where segments are about to vanish, on which side it is is rounding.
    """
    found = branch.turn_multipliers
    if found is None:
        return branch
    idle = set()
    for k, end in zip((0, -1), branch.ends, strict=True):
        last = end.bifurcation
        if last is None or last.kind is not Kind.AS:
            continue
        apart = np.abs(branch.arc - branch.arc[k])
        nearby = np.abs(found[(apart > 0.0) & (apart < _NEAR_END)])
        if not np.any(np.abs(nearby - 1.0) < _CRITICAL):
            continue
        for b in branch.bifurcations:
            gap = abs(b.params[branch.parameter] - last.params[branch.parameter]) / settings.width
            near = abs(b.position - float(branch.arc[k])) < _NEAR_END
            if b.kind is Kind.BP and near and gap <= max(b.accuracy, ACCURACY):
                idle.add(id(b))
    if not idle:
        return branch
    return altered(branch, bifurcations=tuple(b for b in branch.bifurcations if id(b) not in idle))


def _renew_ends(branch: Branch) -> None:
    """Evaluate the multipliers at both ends anew, from the joints that stand there.

    At an end an exit may be tangential. What the march knows are the multipliers of its last Jacobian, from
    near the event, and near it they change with the root of the distance.
    """
    if branch.turn_multipliers is None:
        return
    for k in (0, -1):
        branch.turn_multipliers[k] = branch[k].turn_multipliers


def _joined(behind: Side | None, ahead: Side, origin: Point | None) -> dict[str, NDArray[Any]]:
    """Return the columns of both sides as one; the first point of ``behind`` is that of ``ahead``.

    ``origin`` is a point before the first one.
    """
    front = ahead.columns()
    if behind is None:
        joined = {name: front.take(name) for name in ahead.names}
    else:
        back, shift = behind.columns(), behind.position
        back.arrays["arc"] *= -1.0
        joined = {name: front.take_behind(name, back) for name in ahead.names}
        joined["arc"] += shift
    if origin is not None:
        first = {"values": origin.value, "joints": origin.joints, "arc": origin.arc}
        first |= {"labels": origin.labels, "mu": origin.mu}
        joined = {n: np.concatenate([np.array([first[n]]), joined[n]]) for n in ahead.names}
    return joined
