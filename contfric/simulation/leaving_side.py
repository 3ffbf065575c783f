"""To which side a solution leaves a surface that it begins on, compiled.

Where a mode begins, the state may lie on more of its surfaces than the one that was met: those that a segment
of no length was leaving, and those that a contact at rest stands on. Whether such a surface is met at once is
asked as at a start (:mod:`contfric.simulation.entered_domain`): by the first change of the observable that
is more than rounding.
"""

from __future__ import annotations

from contfric.compiled import helper
from contfric.models.parts import MOST_SURFACES

#: Shares of a period after which it is asked to which side an observable has moved: the first, each ten
#: times the one before, and how many. As short as the change allows.
_FIRST_STEP, _STEPS = 1e-8, 6
#: The change that counts, against what the observable is summed up from: a hundred roundings.
_MOVED = 2e-14
#: How far beyond a surface, relative to 1 + its level, a state lies by rounding: as far as surfaces that are
#: met together are apart (:mod:`contfric.simulation.met_together`). No mode begins beyond its surfaces
#: otherwise.
_BEYOND = 1e-12
#: How far before a surface a state lies on it: what its observable may be off by, against what that is summed
#: up from, as at a start. A root that is nearer cannot be told from the time of the start.
_ON = 16.0 * 2.0**-52


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
def begun_on(functions, tables, mode, on, t, y, p, unit, workspace):  # type: ignore[no-untyped-def]
    """Return (surfaces, as bits, that a mode begins on and keeps to its side of; one that it crosses, or -1).

    The state is on these but for rounding, and they are not among those that are known (``on``). An
    element that has stopped at its limit stands there until a mass next to it is released, what sticks may
    keep a velocity of rounding, and contacts that stop together do so one after the other. Where the state
    crosses a surface at once, there may be no root ahead.
    """
    kept, observed, value = 0, -1, 0.0
    for k in range(min(tables.observables.shape[0], MOST_SURFACES)):
        side = tables.inside[mode, k]
        if side == 0 or tables.bounds[mode, k] != 1 or on >> k & 1:
            continue
        c = tables.observables[k]
        if c != observed:  # surfaces of one observable stand together
            observed = c
            value = functions.observe(c, t, y, p, workspace.none, workspace.empty)
        level = functions.level(k, p, workspace.none, workspace.empty)
        beyond = (level - value) * side
        if abs(beyond) <= _BEYOND * (1.0 + abs(level)):
            size = size_of(functions, c, k, t, y, y, p, workspace)
            if beyond < -_ON * size:
                continue
            if side_ahead(functions, mode, c, t, y, p, unit, size, workspace) == -side:
                return kept, k
            kept |= 1 << k
    return kept, -1
