"""A model's data in other units of states, time and parameters: formulas are rewritten by their names."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any


def put_in(text: Any, images: Mapping[str, str]) -> str:
    """Return a text in which whole names are replaced."""
    names = "|".join(map(re.escape, sorted(images, key=len, reverse=True)))
    return re.sub(rf"(?<![\w.])({names})(?!\w)", lambda found: images[found[1]], str(text))


def rescaled(data: Mapping[str, Any], units: Mapping[str, float]) -> dict[str, Any]:
    """Return a model whose states, time ``t`` and parameters are numbers of such units.

    ``data`` is written out: each mode has its field, and parameters are mappings.
    """
    images = {name: f"({unit!r}*{name})" for name, unit in units.items()}
    constant = {name: image for name, image in images.items() if name in data["parameters"]}
    states = data["states"]

    def written(rows: Mapping[str, Any], power: float) -> dict[str, str]:
        return {
            s: f"{units['t'] ** power / units[s]!r}*({put_in(e, images)})" for s, e in rows.items()
        }

    found = {**data, "parameters": {}, "surfaces": {}}
    for name, entry in data["parameters"].items():
        found["parameters"][name] = {**entry, "default": entry["default"] / units[name]}
    found["constraints"] = [put_in(text, constant) for text in data.get("constraints", ())]
    for key in ("define", "observables"):
        found[key] = {
            n: e if n in states else put_in(e, images) for n, e in data.get(key, {}).items()
        }
    for name, entry in data["surfaces"].items():
        level, unit = put_in(entry.get("level", 0), constant), units.get(entry["observable"], 1.0)
        found["surfaces"][name] = {**entry, "level": f"({level})/{unit!r}"}
    found["modes"] = {
        n: {**mode, "field": written(mode["field"], 1.0)} for n, mode in data["modes"].items()
    }
    found["resets"] = {
        surface: {k: e for k, e in rows.items() if k not in states}
        | written({k: e for k, e in rows.items() if k in states}, 0.0)
        for surface, rows in data.get("resets", {}).items()
    }
    found["spread"] = {
        s: f"({put_in(e, constant)})/{units[s]!r}" for s, e in data["spread"].items()
    }
    if data.get("period"):
        found["period"] = f"({put_in(data['period'], constant)})/{units['t']!r}"
    return {k: e for k, e in found.items() if k not in ("forces", "quantities", "in_units")}
