"""Branch points and period doublings of bridges, which have no multipliers: from signs of determinants.

An orbit with holds has no multipliers. But its equations can be singular for a disturbance that changes
sign after a turn as those of any orbit, and a branch leaves there: of a symmetric orbit the asymmetric
ones, of others those of twice the period. The sign of the determinant tells (:mod:`contfric.orbit.index`),
and the location is located as at the vertex of a pitchfork.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from contfric.base.arrays import with_entries
from contfric.continuation.accuracy.rounding import LEAST
from contfric.continuation.branch import Branch
from contfric.continuation.half_branch import first_point
from contfric.continuation.points import Settings
from contfric.events.bifurcation import ACCURACY, Bifurcation, Kind
from contfric.events.doubling_point import location_error, opening, refined_opening
from contfric.orbit.index import opening_sign, opening_signs
from contfric.orbit.orbit import Orbit

#: Halvings of the step in which an opening is seen: to far below where secants take over.
_HALVINGS = 24
#: An opening is open to this (relative to the size of the equations); near a pole it is not.
_OPEN = 1e-5


def with_openings(branch: Branch, settings: Settings) -> Branch:
    """Return a bridge with its branch points; with its doublings, too, where several copies are asked for."""
    if not branch.bridge or branch.model.autonomous or len(branch) < 2:
        return branch
    if not (branch.system.half or settings.copies > 1):
        return branch
    signs = opening_signs(branch[:])
    found = []
    for k, (a, b) in enumerate(pairwise(signs)):
        if a is not None and b is not None and a * b < 0:
            event = _located(branch, k, a, settings)
            if event is not None and not _belongs_to_another(branch, event, settings.width):
                found.append(event)
    if not found:
        return branch
    return replace(branch, bifurcations=in_order(branch, found))


def _located(branch: Branch, k: int, before: int, settings: Settings) -> Bifurcation | None:
    """Return the event in the step after a point; None where the sign changes through a pole."""
    active = branch.model.index_of(branch.parameter)
    settings = replace(settings, stability=False)
    low, high = 0.0, 1.0
    best: Orbit | None = None
    for _ in range(_HALVINGS):
        share = 0.5 * (low + high)
        orbit = _between(branch, k, share, active, settings)
        sign = None if orbit is None else opening_sign(orbit)
        if sign is None:
            break
        best = orbit
        low, high = (share, high) if sign == before else (low, share)
    if best is None:
        return None
    refined = refined_opening(best, active)
    there = refined or best
    if not abs(opening(there)) < _OPEN:
        return None
    step = branch.arc[k + 1] - branch.arc[k]
    around = branch.arc[k] + low * step, branch.arc[k] + high * step
    if refined is None and _turns_within(branch, *around):
        return None
    kind = Kind.BP if branch.system.half else Kind.PD
    bound = (
        ACCURACY if refined is None else max(LEAST, location_error(there, active) / settings.width)
    )
    return Bifurcation(
        *(kind, there.params, there, (), float(around[0]), False, False),
        bound=bound,
        parameter=branch.parameter,
    )


def _between(branch: Branch, k: int, share: float, active: int, settings: Settings) -> Orbit | None:
    """Return the orbit at a share of the step after a point, solved normal to the chord."""
    chord = branch.joints[k + 1] - branch.joints[k]
    slope = float(branch.values[k + 1] - branch.values[k])
    vector = with_entries(branch.vector, active, branch.values[k] + share * slope)
    guess = Orbit(branch.system, branch.joints[k] + share * chord, vector, 0.0)
    size = float(np.sqrt(np.sum(chord**2) / len(chord) + slope**2 * settings.scale))
    point = first_point(guess, settings, chord / size, slope / size)
    return None if point is None else point.orbit(branch, active)


def _belongs_to_another(branch: Branch, event: Bifurcation, width: float) -> bool:
    """Tell whether the branch turns or ends there: what opens there is a part of that."""
    value = event.params[branch.parameter]
    return any(
        abs(b.params[branch.parameter] - value) < max(ACCURACY, b.accuracy) * width
        for b in branch.bifurcations
        if b.kind is not Kind.T
    )


def _turns_within(branch: Branch, low: float, high: float) -> bool:
    """Tell whether a fold lies where an opening was looked for until its sign was rounding.

    Where one hold turns by itself both determinants vanish at the fold, which is known better.
    """
    return any(b.kind is Kind.SN and low <= b.position <= high for b in branch.bifurcations)


def in_order(branch: Branch, found: list[Bifurcation]) -> tuple[Bifurcation, ...]:
    """Return the bifurcations of a branch with others, in order; those at its ends stay there."""
    first, last = (end.bifurcation for end in branch.ends)
    inner = [b for b in branch.bifurcations if b is not first and b is not last]
    inner = sorted([*inner, *found], key=lambda b: b.position)
    ends = ([first] if first is not None else []), ([last] if last is not None else [])
    return (*ends[0], *inner, *ends[1])
