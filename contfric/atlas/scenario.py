"""The scenario of a non-smooth event for nearby orbits: persistence, a non-smooth fold, or a jump.

At an event of the vector field's discontinuities (CS, SS, AS, GS) the branches that meet exist on one side
of the parameter value each. One below and one above: an orbit persists, with another signature. Two on one
side and none on the other: they annihilate each other, as at a fold, without a vertical tangent (di Bernardo,
Budd, Champneys, Kowalczyk 2008). One alone: no orbit is near on the other side, and motion jumps. Orbits
with a hold, which no solution follows, do not count.
"""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

from contfric.events.bifurcation import TERMINAL, Bifurcation

if TYPE_CHECKING:
    from contfric.atlas.diagram import Diagram, Node
    from contfric.continuation.branch import Branch

#: Events that are one agree in the parameter to this share of the range, or to their accuracy.
_SAME = 1e-8


class Scenario(str, Enum):
    """What becomes of the orbits that meet an event; the text says it."""

    PERSISTENCE = "persistence"
    FOLD = "non-smooth fold"
    JUMP = "jump"


def scenario_of(diagram: Diagram, node: Node) -> Scenario | None:
    """Return what an event is for nearby orbits; None if it is smooth, or only of orbits with holds.

    Examples
    --------
    >>> import contfric as cf
    >>> found = cf.explore(cf.find_orbit("impact"), "A", (0.05, 1.0))
    >>> [scenario_of(found, node).value for node in found.events if node.bifurcation.kind.value == "GS"]
    ['non-smooth fold']
    """
    event = node.bifurcation
    if event.kind not in TERMINAL:
        return None
    sides: list[int] = []
    for index in node.branches:
        if not diagram.branches[index].bridge:
            sides += _sides(diagram.branches[index], event, diagram)
    if not sides:
        return None
    if len(sides) == 1:
        return Scenario.JUMP
    return Scenario.FOLD if len(set(sides)) == 1 else Scenario.PERSISTENCE


def _sides(branch: Branch, event: Bifurcation, diagram: Diagram) -> list[int]:
    """Return the sides of an event on which a branch lies: of each end there, or both if it passes."""
    low, high = diagram.range
    near = max(_SAME, event.accuracy) * (high - low)
    at = event.params[branch.parameter]
    found = []
    for end, values in zip(branch.ends, (branch.values, branch.values[::-1]), strict=True):
        b = end.bifurcation
        if b is None or b.kind not in TERMINAL or abs(b.params[branch.parameter] - at) > near:
            continue
        away = next((v - at for v in values if abs(v - at) > near), 0.0)
        found.append(1 if away > 0.0 else -1)
    return found or [-1, 1]
