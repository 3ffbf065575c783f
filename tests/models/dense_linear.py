"""A model of some states whose matrix and excitation are parameters: any affine motion of that size."""

from __future__ import annotations

from typing import Any

SIZE = 4


def definition(size: int = SIZE) -> dict[str, Any]:
    """Return the model as a mapping: one affine field on both sides of a section."""
    states = [f"y{i}" for i in range(size)]
    entries = {(i, j): f"a{i}{j}" for i in range(size) for j in range(size)}
    parameters = dict.fromkeys(entries.values(), 0.1)
    field = {}
    for i, state in enumerate(states):
        parameters |= {f"b{i}": 0.1, f"c{i}": 0.1, f"s{i}": 0.1}
        matrix = " + ".join(f"{entries[i, j]}*{other}" for j, other in enumerate(states))
        field[state] = f"{matrix} + b{i} + c{i}*cos(w*t) + s{i}*sin(w*t)"
    return {
        "name": "dense-linear",
        "states": states,
        "parameters": {**parameters, "w": 1.0},
        "period": "2*pi/w",
        "observables": {"q": "y0", "u": "y1 - y2 - cos(w*t)"},
        "surfaces": {
            "section": {"observable": "q", "level": 0},
            "gate": {"observable": "u", "level": 0},
        },
        "field": field,
        "modes": {"above": {"in": {"section": "+"}}, "below": {"in": {"section": "-"}}},
        "spread": dict.fromkeys(states, 1),
    }
