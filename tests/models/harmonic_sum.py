"""A model whose first observable is a sum of harmonics of time: anything that an observable can be."""

from __future__ import annotations

from typing import Any


def definition(harmonics: int) -> dict[str, Any]:
    """Return the model as a mapping; its parameters are om and a0, a1 (cosine), a2 (sine), a3 ..."""
    terms = ["x", "a0"]
    for k in range(1, harmonics + 1):
        terms += [f"a{2 * k - 1}*cos({k}*om*t)", f"a{2 * k}*sin({k}*om*t)"]
    names = [f"a{i}" for i in range(2 * harmonics + 1)]
    return {
        "name": "harmonic-sum",
        "states": ["x", "v"],
        "parameters": {"om": 1.0, **dict.fromkeys(names, 0.1)},
        "period": "2*pi/om",
        "observables": {"q": " + ".join(terms), "v": "v"},
        "surfaces": {
            "sum": {"observable": "q", "level": 0},
            "stop": {"observable": "v", "level": 0},
        },
        "field": {"x": "v", "v": "0"},
        "modes": {"up": {"in": {"stop": "+"}}, "down": {"in": {"stop": "-"}}},
        "spread": {"x": 1, "v": 1},
    }
