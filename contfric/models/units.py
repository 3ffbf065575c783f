"""Units: ``units: {x: 1.0e-3, t: 1.0e-3}``, what states and time are measured in.

Formulas are written in the units of the file, SI for instance. Newton's method, steps along branches and
distances between orbits weigh all unknowns alike, and rounding is compared with 1: they want numbers of
order 1. So a state of unit U is ``x = U X``, time is ``t = U_t T``, and

    dX/dT = (U_t/U) dx/dt ,    period/U_t ,    X after a reset = (new value)/U .

What is solved, and all that results say of states and times, is in these units; parameters and quantities
that the file declares stay as they are. Observables are divided by their size.

``units: auto`` chooses units by the sizes of states (:mod:`contfric.models.sizes`): then a model in any units
is solved as the same numbers. Scaling formulas takes the place of a scale in each comparison with 1; there
are some 170 of these.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from contfric.errors import ModelError
from contfric.models.clocks import is_clock
from contfric.models.description import Description
from contfric.models.entries import EntryError, Part, mapping_in
from contfric.models.evaluate import Sampler, defaults, floats
from contfric.models.grammar import TIME, number_of
from contfric.models.sizes import chosen_units, rounded
from contfric.models.tied import Substitution

KEY = "units"
#: Units that are chosen by the sizes of the states.
AUTO = "auto"
#: The key of a model that is written out: its formulas are in these units already.
APPLIED = "in_units"
#: States at which the sizes of observables are looked at.
_SAMPLES = 50

Read = Callable[[dict[str, Any]], Description]


def read_units(top: Part, key: str, states: Sequence[str]) -> dict[str, float]:
    """Return the units of states and time that are given.

    Raises
    ------
    EntryError
        If one is no positive number, or of what is no state.
    """
    wanted = "'auto', or a mapping of states and t to numbers, such as {x: 1.0e-3, t: 0.01}"
    part = top.part(key, wanted)
    part.only((*states, TIME))
    found = {}
    for name, value in part.data.items():
        try:
            number = math.nan if isinstance(value, bool) else number_of(str(value), {})
        except ModelError:
            number = math.nan
        if not 1e-100 < number < 1e100:
            part.fail(name, f"the unit of '{name}' is a positive number, got {value!r}")
        found[name] = number
    return found


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
    given = data.get(KEY)
    alike = given.get(AUTO) if isinstance(given, Mapping) else None  # of a structure
    if given == AUTO or alike:
        plain = read({key: value for key, value in data.items() if key != KEY})
        spread, angles = [*mapping_in(data, "spread")], Part(data).texts("angles")
        units = chosen_units(plain, spread, angles, alike or ())
    else:
        units = read_units(Part(data), KEY, [str(s) for s in data["states"]])
    if not units:
        return {key: value for key, value in data.items() if key != KEY}
    for angle in Part(data).texts("angles"):
        if units.get(angle, 1.0) != 1.0:
            raise EntryError(
                (KEY, angle), f"'{angle}' is an angle: a turn of it is 2 pi, in radians"
            )
    clocks = filter(is_clock, map(str, data["states"]))  # times since the last ticks
    units |= dict.fromkeys(clocks, units.get(TIME, 1.0))
    found = _states_in_units(data, units)
    return _observables_in_units(found, _sizes(read(found))) | {APPLIED: units}


def _states_in_units(data: Mapping[str, Any], units: Mapping[str, float]) -> dict[str, Any]:
    time = units.get(TIME, 1.0)
    states = {name: unit for name, unit in units.items() if name != TIME}
    put = Substitution({n: f"({u!r}*{n})" for n, u in states.items() if u != 1.0})
    rates = {s: f"{time / states.get(s, 1.0)!r}" for s in map(str, data["states"])}
    clock = Substitution({TIME: f"({time!r}*{TIME})"} if time != 1.0 else {})

    def text(expression: Any) -> str:
        return put.text(clock.text(str(expression)))

    def field(rows: Mapping[str, Any]) -> dict[str, str]:
        return {s: f"({rates.get(s, '1.0')})*({text(row)})" for s, row in rows.items()}

    def over(expression: Any, unit: float) -> Any:
        return expression if unit == 1.0 else f"({expression})/{unit!r}"

    found = {key: value for key, value in data.items() if key != KEY}
    for key in ("define", "observables"):
        if key in data:
            given = mapping_in(data, key)
            found[key] = {n: f if n in data["states"] else text(f) for n, f in given.items()}
    if "field" in data:
        found["field"] = field(data["field"])
    found["modes"] = {
        name: {**mode, "field": field(mode["field"])} if "field" in mode else mode
        for name, mode in data["modes"].items()
    }
    found["surfaces"] = {
        name: {**s, "level": over(s.get("level", 0), states.get(str(s.get("observable")), 1.0))}
        for name, s in data["surfaces"].items()
    }
    if "resets" in data:
        found["resets"] = {
            name: {
                k: v if k in ("to", "from") else over(text(v), states.get(k, 1.0))
                for k, v in reset.items()
            }
            for name, reset in data["resets"].items()
        }
    if data.get("spread"):
        found["spread"] = {
            s: [over(end, states.get(s, 1.0)) for end in w]
            if isinstance(w, (list, tuple))
            else over(w, states.get(s, 1.0))
            for s, w in data["spread"].items()
        }
    if data.get("period") is not None:
        found["period"] = over(data["period"], time)
    if isinstance(data.get("symmetry"), (str, Mapping)):
        found["symmetry"] = _symmetry(data["symmetry"], states, put)
    return found | _measured(data, text, time, str(data["states"][0]), states)


def _symmetry(
    symmetry: str | Mapping[str, Any], states: Mapping[str, float], put: Substitution
) -> dict[str, str]:
    if isinstance(symmetry, str):
        pairs = [piece.partition("->") for piece in symmetry.split(",")]
        symmetry = {name.strip(): image.strip() for name, _, image in pairs}
    return {
        name: str(image) if name == TIME else f"({put.text(str(image))})/{states.get(name, 1.0)!r}"
        for name, image in symmetry.items()
    }


def _measured(
    data: Mapping[str, Any],
    text: Callable[[Any], str],
    time: float,
    first: str,
    states: Mapping[str, float],
) -> dict[str, Any]:
    """Return quantities, and the laws of contacts, in the units of the file."""
    found: dict[str, Any] = {}
    bundled = {"period": time, "x_max": states.get(first, 1.0), "x_min": states.get(first, 1.0)}
    outside = Substitution({n: f"({u!r}*{n})" for n, u in bundled.items() if u != 1.0})
    if "quantities" in data:
        found["quantities"] = {
            name: outside.text(text(q)).replace("integral(", f"{time!r}*integral(")
            for name, q in data["quantities"].items()
        }
    if "forces" in data:
        found["forces"] = {
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
    return found


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
    if "forces" in data:
        found["forces"] = {
            name: {**law, "texts": within(law["texts"])} for name, law in data["forces"].items()
        }
    found["observables"] = {
        name: f"({put.text(str(formula))})/{sizes[name]!r}" if name in sizes else put.text(formula)
        for name, formula in mapping_in(data, "observables").items()
    }
    found["surfaces"] = {
        name: {**s, "level": f"({s['level']})/{sizes[s['observable']]!r}"}
        if s.get("observable") in sizes
        else s
        for name, s in data["surfaces"].items()
    }
    return found
