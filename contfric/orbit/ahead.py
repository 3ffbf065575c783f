"""To which side a solution leaves a surface that it begins on, compiled.

A solution that meets a surface as soon as it begins has still its other surfaces under it: those that it
was leaving when the mode changed. Whether such a surface is left by the mode that follows as well, or is met
at once, is asked as at a start (:mod:`contfric.orbit.entered`): by the first change of the observable that is
more than rounding.
"""

from __future__ import annotations

from contfric.compiled import helper
from contfric.models.parts import MOST_SURFACES

#: Shares of a period after which it is asked to which side an observable has moved: the first, each ten
#: times the one before, and how many. As short as the change allows.
_FIRST_STEP, _STEPS = 1e-8, 6
#: The change that counts, against what the observable is summed up from: a hundred roundings.
_MOVED = 2e-14


@helper
def size_of(functions, observable, surface, t, y, widths, p, workspace):  # type: ignore[no-untyped-def]
    """Return what the height over a surface is summed up from.

    ``widths`` is added to the states' sizes, but no more than 1 + the largest of these: near a resonance
    solutions may grow a thousand times larger.
    """
    slopes, largest = workspace.slopes, 1.0
    for j in range(y.shape[0]):
        largest = max(largest, 1.0 + abs(y[j]))
    functions.observe(observable, t, y, p, workspace.none, slopes)
    size = abs(functions.level(surface, p, workspace.none, workspace.empty)) + abs(slopes[0] * t)
    for j in range(y.shape[0]):
        size += abs(slopes[1 + j]) * (abs(y[j]) + min(abs(widths[j]), largest))
    return size


@helper
def side_ahead(functions, mode, observable, t, y, p, unit, size, workspace):  # type: ignore[no-untyped-def]
    """Return the side to which the solution of a mode changes an observable; 0 if it does not."""
    none, empty, share = workspace.none, workspace.empty, _FIRST_STEP
    here = functions.observe(observable, t, y, p, none, empty)
    for _ in range(_STEPS):
        step = share * unit
        functions.flow(mode, t, y, step, p, none, workspace.trial, workspace.nothing)
        change = functions.observe(observable, t + step, workspace.trial, p, none, empty) - here
        if abs(change) > _MOVED * size:
            return 1 if change > 0.0 else -1
        share *= 10.0
    return 0


@helper
def still_left(functions, tables, before, mode, begun_on, t, y, p, unit, workspace):  # type: ignore[no-untyped-def]
    """Return those of the surfaces that a mode of no length began on which the next mode leaves alike."""
    found = 0
    for k in range(min(tables.observables.shape[0], MOST_SURFACES)):
        if begun_on >> k & 1 == 0 or tables.bounds[mode, k] != 1 or tables.bounds[before, k] != 1:
            continue
        c = tables.observables[k]
        size = size_of(functions, c, k, t, y, y, p, workspace)
        side = side_ahead(functions, before, c, t, y, p, unit, size, workspace)
        if side != 0 and side == side_ahead(functions, mode, c, t, y, p, unit, size, workspace):
            found |= 1 << k
    return found
