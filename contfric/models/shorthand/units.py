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

from contfric.base.yaml_lines import Address
from contfric.errors import ModelError
from contfric.models.described.description import Description
from contfric.models.described.evaluate import Sampler, defaults, floats
from contfric.models.entries import AUTO, EntryError, known_keys
from contfric.models.language.grammar import TIME
from contfric.models.shorthand.clocks import is_clock
from contfric.models.shorthand.rewriting import OF_MODES, OTHERS, SHARED, rewritten
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

    def over(expression: Any, unit: float) -> Any:
        return expression if unit == 1.0 else f"({expression})/{unit!r}"

    def inside(expression: Any, state: str) -> Any:
        """Return the number that is meant by one in the units of the data."""
        origin = origins.get(state)
        from_it = f"({expression}) - {origin}" if origin else expression
        return over(from_it, states.get(state, 1.0))

    def rate(expression: Any, address: Address) -> str:
        return f"({rates.get(str(address[-1]), '1.0')})*({text(expression)})"

    def named(expression: Any, address: Address) -> Any:
        return expression if address[1] in data["states"] else text(expression)

    def width(expression: Any, address: Address) -> Any:
        state = str(address[1])
        is_range = isinstance(data["spread"][state], list)
        return inside(expression, state) if is_range else over(expression, states.get(state, 1.0))

    def law(expression: Any, address: Address) -> str:
        found = text(expression)
        return f"{time!r}*({found})" if str(address[-1]).startswith("power") else found

    first = data["states"][0]
    bundled = {name: outside(name, first) for name in ("x_max", "x_min")}
    own = Substitution(bundled if time == 1.0 else {**bundled, "period": f"({time!r}*period)"})
    changes: dict[str | int, Callable[[Any, Address], Any]] = {
        **{"define": named, "observables": named, "field": rate, "modes": rate},
        "surfaces": lambda e, at: inside(e, data["surfaces"][at[1]]["observable"]),
        "resets": lambda e, at: inside(text(e), str(at[2])) if at[2] in data["states"] else e,
        **{"spread": width, "forces": law},
        "period": lambda e, _: over(e, time),
        "symmetry": lambda e, at: e if at[1] == TIME else inside(put.text(e), str(at[1])),
        "quantities": lambda e, _: own.text(text(e)).replace("integral(", f"{time!r}*integral("),
    }
    places = (*SHARED, *OF_MODES, *OTHERS, ("symmetry", None))
    without = tuple(place for place in places if place[-1] != "at")  # where a contact rests stays
    return rewritten(data, without, lambda e, address: changes[address[0]](e, address))


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

    def changed(expression: Any, address: Address) -> Any:
        key, name = address[:2]
        if key == "surfaces":
            name, found = data["surfaces"][name]["observable"], expression
        else:
            found = put.text(expression) if isinstance(expression, str) else expression
        divided = key in ("surfaces", "observables") and name in sizes
        return f"({found})/{sizes[str(name)]!r}" if divided else found

    others = ("surfaces", None, "level"), ("quantities", None), ("forces", None, "texts", None)
    return rewritten(data, (*SHARED, *OF_MODES, *others), changed)
