"""Surfaces that one segment crosses, from its stationary points: where they are too many for a label."""

from __future__ import annotations

from typing import TYPE_CHECKING

from contfric.base.arrays import FloatArray

if TYPE_CHECKING:
    from contfric.orbit.orbit import Orbit

#: An observable this near to a level, relative to 1 + the level, touches it to rounding (ten units in
#: the last place): that is no crossing.
TOUCH = 2e-15


def crossed_by(orbit: Orbit, i: int, number: int) -> list[str]:
    """Return the surfaces of an observable that a segment crosses, in order, however many they are."""
    name, flow = orbit.model.observables[number].name, orbit.flow
    levels = {s.name: flow.level(s.name) for s in orbit.model.surfaces if s.observable == name}

    def at_joint(exit_: str, at: FloatArray) -> float:
        return levels[exit_] if exit_ in levels else flow.observe(name, at[0], at[1:])

    before = at_joint(orbit.itinerary[i - 1][1], orbit.begins[i])
    last = at_joint(orbit.itinerary[i][1], orbit.ends[i])
    mode, start = orbit.itinerary[i][0], orbit.begins[i]
    _, turns = flow.stationary(mode, name, float(start[0]), start[1:], float(orbit.durations[i]))
    crossed, above = [], {s: before > level for s, level in levels.items() if before != level}
    for value in (*turns, last):
        for surface in sorted(levels, key=lambda s: levels[s], reverse=bool(value < before)):
            if abs(value - levels[surface]) <= TOUCH * (1.0 + abs(levels[surface])):
                continue
            if above.get(surface, value > levels[surface]) != (value > levels[surface]):
                crossed.append(surface)
            above[surface] = value > levels[surface]
        before = value
    return crossed
