"""Units: ``units: {x: 1.0e-3, t: 1.0e-3}``, what states and time are measured in.

Formulas are written in the units of the file, SI for instance. Newton's method, steps along branches and
distances between orbits weigh all unknowns alike, and rounding is compared with 1: they want numbers of
order 1. So a state of unit U is ``x = U X``, time is ``t = U_t T``, and

    dX/dT = (U_t/U) dx/dt ,    period/U_t ,    X after a reset = (new value)/U .

What is solved, and all that results say of states and times, is in these units; parameters and quantities
that the file declares stay as they are. Observables are divided by their size.

``units: auto`` chooses units by the sizes of states (:mod:`contfric.models.shorthand.sizes`): then a model
in any units is solved as the same numbers. Scaling formulas takes the place of a scale in each comparison
with 1; there are some 170 of these.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from contfric.errors import ModelError
from contfric.models.described.description import Description
from contfric.models.described.evaluate import Sampler, defaults, floats
from contfric.models.entries import AUTO, EntryError, known_keys
from contfric.models.language.grammar import TIME
from contfric.models.shorthand.clocks import is_clock
from contfric.models.shorthand.sizes import chosen_units, rounded
from contfric.models.shorthand.tied import Substitution

KEY = "units"
#: The key of a model that is written out: its formulas are in these units already.
APPLIED = "in_units"
#: States at which the sizes of observables are looked at.
_SAMPLES = 50

Read = Callable[[dict[str, Any]], Description]


def in_units(data: dict[str, Any], read: Read) -> dict[str, Any]:
    """Return a model's data in its own units; unchanged where it has none.

    Parameters
    ----------
    data : with nothing in short
    read : reads what is written out

    Raises
    ------
    EntryError
        If a unit is wrong, or an angle has one.
    """
    units, plain = data.get(KEY), {key: value for key, value in data.items() if key != KEY}
    if units and AUTO in units:
        units = chosen_units(read(plain), data["spread"], data["angles"], data["alike"])
    if not units:
        return plain
    known_keys(units, (*data["states"], TIME), (KEY,))
    for angle in data["angles"]:
        if units.get(angle, 1.0) != 1.0:
            raise EntryError(
                (KEY, angle), f"'{angle}' is an angle: a turn of it is 2 pi, in radians"
            )
    clocks = filter(is_clock, data["states"])  # times since the last ticks
    units = units | dict.fromkeys(clocks, units.get(TIME, 1.0))
    found = measured(plain, units)
    return _observables_in_units(found, _sizes(read(found))) | {APPLIED: units}


def measured(
    data: Mapping[str, Any], units: Mapping[str, float], origins: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """Return a model's data with states and time in units, and states measured from origins.

    Parameters
    ----------
    units : of states and time; 1 if left out
    origins : expressions of the parameters, by state; 0 if left out. They are in the units of the data
    """
    time, origins = units.get(TIME, 1.0), origins or {}
    states = {name: unit for name, unit in units.items() if name != TIME}

    def outside(name: str, state: str) -> str:
        """Return a number of a state in the units of the data."""
        unit, origin = states.get(state, 1.0), origins.get(state)
        own = name if unit == 1.0 else f"{unit!r}*{name}"
        return f"({own} + {origin})" if origin else own if unit == 1.0 else f"({own})"

    put = Substitution({s: outside(s, s) for s in (*states, *origins)})
    rates = {s: f"{time / states.get(s, 1.0)!r}" for s in data["states"]}
    clock = Substitution({TIME: f"({time!r}*{TIME})"} if time != 1.0 else {})

    def text(expression: Any) -> str:
        return put.text(clock.text(str(expression)))

    def field(rows: Mapping[str, Any]) -> dict[str, str]:
        return {s: f"({rates.get(s, '1.0')})*({text(row)})" for s, row in rows.items()}

    def over(expression: Any, unit: float) -> Any:
        return expression if unit == 1.0 else f"({expression})/{unit!r}"

    def inside(expression: Any, state: str) -> Any:
        """Return the number that is meant by one in the units of the data."""
        origin = origins.get(state)
        from_it = f"({expression}) - {origin}" if origin else expression
        return over(from_it, states.get(state, 1.0))

    found = dict(data)
    for key in ("define", "observables"):
        found[key] = {n: f if n in data["states"] else text(f) for n, f in data[key].items()}
    if "field" in data:
        found["field"] = field(data["field"])
    found["modes"] = {
        name: {**mode, "field": field(mode["field"])} if "field" in mode else mode
        for name, mode in data["modes"].items()
    }
    found["surfaces"] = {
        name: {**s, "level": inside(s["level"], s["observable"])}
        for name, s in data["surfaces"].items()
    }
    found["resets"] = {
        name: {k: inside(text(v), k) if k in data["states"] else v for k, v in reset.items()}
        for name, reset in data["resets"].items()
    }
    found["spread"] = {
        s: [inside(end, s) for end in w] if isinstance(w, list) else over(w, states.get(s, 1.0))
        for s, w in data["spread"].items()
    }
    if "period" in data:
        found["period"] = over(data["period"], time)
    if "symmetry" in data:
        found["symmetry"] = {
            n: image if n == TIME else inside(put.text(image), n)
            for n, image in data["symmetry"].items()
        }
    first = data["states"][0]
    bundled = {name: outside(name, first) for name in ("x_max", "x_min")}
    return found | _measured(data, text, time, bundled)


def _measured(
    data: Mapping[str, Any],
    text: Callable[[Any], str],
    time: float,
    bundled: Mapping[str, str],
) -> dict[str, Any]:
    """Return quantities, and the laws of contacts, in the units of the file."""
    outside = Substitution(bundled if time == 1.0 else {**bundled, "period": f"({time!r}*period)"})
    quantities = {
        name: outside.text(text(q)).replace("integral(", f"{time!r}*integral(")
        for name, q in data["quantities"].items()
    }
    forces = {
        name: {
            **law,
            "texts": {
                k: f"{time!r}*({text(v)})" if k.startswith("power") else text(v)
                for k, v in law["texts"].items()
            },
            **({"rest": text(law["rest"])} if "rest" in law else {}),
        }
        for name, law in data["forces"].items()
    }
    return {"quantities": quantities, "forces": forces}


def _sizes(found: Description) -> dict[str, float]:
    """Return the size of each observable that is no state."""
    params, evaluator = defaults(found), floats(found)
    places = list(Sampler(evaluator, params).states(_SAMPLES))
    sizes = {}
    for observable in found.observables:
        if observable.name in found.states:
            continue
        try:
            values = [abs(evaluator.observable(observable.name, params, t, y)) for t, y in places]
        except (ModelError, ArithmeticError, ValueError):
            continue  # where it has no value the check of the model says so
        values = [v for v in values if 0.0 < v < math.inf]
        if values:
            sizes[observable.name] = rounded(math.exp(sum(map(math.log, values)) / len(values)))
    return {name: size for name, size in sizes.items() if size != 1.0}


def _observables_in_units(data: dict[str, Any], sizes: Mapping[str, float]) -> dict[str, Any]:
    if not sizes:
        return data
    put = Substitution({name: f"({size!r}*{name})" for name, size in sizes.items()})

    def within(value: Any, key: str = "") -> Any:
        if key in ("to", "from", "in", "mode", "label"):
            return value
        if isinstance(value, Mapping):
            return {k: within(v, k) for k, v in value.items()}
        return put.text(value) if isinstance(value, str) else value

    found = dict(data)
    for key in ("define", "field", "resets", "quantities"):
        if key in data:
            found[key] = within(data[key])
    found["modes"] = {
        name: {**mode, "field": within(mode["field"])} if "field" in mode else mode
        for name, mode in data["modes"].items()
    }
    found["forces"] = {
        name: {**law, "texts": within(law["texts"])} for name, law in data["forces"].items()
    }
    found["observables"] = {
        name: f"({put.text(formula)})/{sizes[name]!r}" if name in sizes else put.text(formula)
        for name, formula in data["observables"].items()
    }
    found["surfaces"] = {
        name: {**s, "level": f"({s['level']})/{sizes[s['observable']]!r}"}
        if s["observable"] in sizes
        else s
        for name, s in data["surfaces"].items()
    }
    return found
