"""Angles: states that are the same a turn later.

``angles: [theta]`` puts two surfaces into a model, at ``theta = pi`` and ``theta = -pi``; what meets one goes
on at the other. So a pendulum oscillates and rotates, and its rotations close. Nothing happens to the motion
there: the surfaces are joints of orbits that turn, and bound nothing (:class:`contfric.models.parts.Reset`).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from contfric.models.entries import EntryError, Part, mapping_in

#: The key of a model.
ANGLES = "angles"


def wraps_of(angle: str) -> dict[str, int]:
    """Return the surfaces of an angle, and the side of each on which motion lies."""
    return {f"{angle}+": -1, f"{angle}-": 1}


def with_angles(data: dict[str, Any]) -> dict[str, Any]:
    """Return a model's data with the surfaces and resets of its angles; unchanged without any.

    Raises
    ------
    EntryError
        If an angle is no state, or a surface has the name of one of its own.
    """
    part = Part(data)
    angles, states = part.texts(ANGLES), [str(s) for s in data.get("states") or ()]
    for index, angle in enumerate(angles):
        if angle not in states:
            raise EntryError(
                (ANGLES, index), f"'{angle}' is no state: an angle is one of {', '.join(states)}"
            )
    surfaces, resets = mapping_in(data, "surfaces"), mapping_in(data, "resets")
    wanted = {s: angle for angle in angles for s in wraps_of(angle)}
    if not wanted or all(name in resets for name in wanted):  # a model that was stored has them
        return data
    for name in wanted:
        if name in surfaces:
            raise EntryError(
                ("surfaces", name), f"'{name}' is the surface at which an angle begins again"
            )
    sides: dict[str, int] = {}
    for name, angle in wanted.items():
        side = wraps_of(angle)[name]
        sides[name] = side
        surfaces[name] = {"observable": angle, "level": "pi" if side < 0 else "-pi"}
        resets[name] = {angle: f"{angle} {'-' if side < 0 else '+'} 2*pi"}
    modes = {
        name: {**mode, "in": {**mapping_in(mode, "in"), **sides}}
        if isinstance(mode, Mapping)
        else mode
        for name, mode in mapping_in(data, "modes").items()
    }
    return {**data, "surfaces": surfaces, "resets": resets, "modes": modes}
