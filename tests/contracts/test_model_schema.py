"""The schema of model files: what the manual says of it, and that every mistake is explained."""

from __future__ import annotations

import copy
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from pydantic_core import PydanticUndefined

import contfric as cf
from contfric.base.resources import bundled_dir
from contfric.base.yaml_schema import _values
from contfric.models.entries import EntryError
from contfric.models.reading import schema
from contfric.models.reading.describe import describe

MANUAL = Path(__file__).parents[2] / "docs" / "models.md"
#: The parts of a file, as the manual calls them, and their schemas.
PARTS = {
    "a model": schema.ModelFile,
    "a structure": schema.StructureFile,
    "a parameter": schema.Parameter,
    "a surface": schema.Surface,
    "a mode": schema.Mode,
    "a domain": schema.Domain,
    "a departure": schema.Departure,
    "a reset": schema.Reset,
    "`integration`": schema.Integration,
    "a friction contact": schema.Friction,
    "a Jenkins element": schema.Jenkins,
    "a spring across a gap": schema.Spring,
    "a wall": schema.Impact,
}

#: A file in which everything is said that a model of states can say.
EVERYTHING = """\
name: spring
title: a title
references: [one]
states: [x, v]
parameters:
  Omega: {default: 0.5, meaning: frequency}
  S: 0.2
  S0: {tie: 1.2*S}
constraints: {Omega > 0: why, S >= 0: }
period: 2*pi/Omega
define: {f: cos(Omega*t), g: 3}
observables: {u: x - f}
surfaces:
  F+: {observable: u, level: S}
  F-: {observable: u, level: -S}
  v: {observable: v, level: 0, switching: true}
  w: {observable: x - 4}
field: {x: v, v: -u - S*sign(v)}
modes:
  forward: {in: {v: +}}
  backward: {in: {v: below}}
  stick: {in: {v: 0, F+: -, F-: +}, field: {x: 0, v: 0}, rank: 1, sliding: yes}
domains:
  a: {mode: forward, in: {F+: +}, label: big}
departures: [{where: {v: 0, F+: 1}, leaves: {v: -1}}]
resets: {w: {v: -v, from: [forward], to: {backward: {F+: +}}}}
symmetry: x -> -x, v -> -v, t -> t + T/2
stop_surface: v
kinks: [v]
spread: {x: 2, v: [-1, 1]}
units: {x: 1.0e-3}
integration: {method: explicit, tolerance: 1.0e-10}
max_step: 0.01
quantities: {e: integral(v**2)}
"""

#: What may stand in the place of an entry by mistake.
WRONG: list[Any] = [
    *(None, True, 3, -1, "text x", "'1e-2'", [1], ["a", "b"], {"a": 1}, {}, []),
    *({"a": {"b": None}}, float("inf"), float("nan"), 10**5000, {1: 2}, [[1], 2], 1j),
]


def reference() -> str:
    """Return the table of all keys as the schema has them."""
    rows = ["| of | key | must be | if left out |", "|---|---|---|---|"]
    for part, kind in PARTS.items():
        above = schema.AnyModel.model_fields if kind is schema.StructureFile else {}
        for name, info in kind.model_fields.items():
            if name in above:
                continue
            # what is not described is one of some names, or an expression that may be missing
            what = info.description or " or ".join(_values(info.annotation)) or "an expression"
            default = (
                f"`{info.default}`" if info.default not in (None, "", PydanticUndefined) else ""
            )
            default = "needed" if info.is_required() else default
            rows.append(
                f"| {part} | `{info.alias or name}` | {what} | {default} |".replace("|  |", "| |")
            )
    return "\n".join(rows)


def test_the_manual_has_the_keys_of_the_schema() -> None:
    assert reference() in MANUAL.read_text(encoding="utf-8"), f"write into {MANUAL}:\n{reference()}"


def _places(data: Any, above: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    pairs = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in pairs:
        yield (*above, key)
        if isinstance(value, (dict, list)):
            yield from _places(value, (*above, key))


def _changed(base: Any, place: tuple[Any, ...], value: Any) -> Any:
    data = copy.deepcopy(base)
    inside = data
    for key in place[:-1]:
        inside = inside[key]
    inside[place[-1]] = value
    return data


@pytest.mark.parametrize("source", ["everything", "two-blocks", "pounding", "buck"])
def test_whatever_is_written_is_read_or_explained(source: str) -> None:
    """No entry ends in another error than that of the file, and each has an address in it."""
    path = bundled_dir("models") / f"{source}.yaml"
    text = EVERYTHING if source == "everything" else path.read_text(encoding="utf-8")
    base, draw = yaml.safe_load(text), random.Random(source)
    cases = [(place, value) for place in _places(base) for value in WRONG]
    explained = 0
    for place, value in draw.sample(cases, 150):
        try:
            describe(_changed(base, place, value))
        except EntryError as error:
            explained += 1
            assert len(str(error)) < 500, (place, value)
            assert "\n" not in str(error), (place, value)
    assert explained > 60


@pytest.mark.parametrize(
    ("place", "value", "address", "says"),
    [
        (("domains",), 3, ("domains",), "'domains' must be a mapping of names to {mode"),
        (("constraints",), 3, ("constraints",), "a list of inequalities"),
        (("constraints",), "Omega > 0", ("constraints",), "a list of inequalities"),
        (("domains", "a", "mode"), ["a"], ("domains", "a", "mode"), "the name of a mode"),
        (
            ("resets", "w"),
            3,
            ("resets", "w"),
            "{state: new value, to: mode, from: modes}, got w: 3",
        ),
        (("resets", "w", "form"), ["a"], ("resets", "w", "form"), "did you mean 'from'"),
        (
            ("resets", "w", "to"),
            {"backward": {"F+": "up"}},
            None,
            "the side of 'F+' must be + (above)",
        ),
        (("define", "b)"), None, ("define", "b)"), "an expression with a comma needs quotes"),
        (("modes", "stick", "label"), "s", ("modes", "stick", "label"), "unknown key 'label'"),
        (("label",), "s", ("label",), "here: it belongs into domains"),
        (("symmetry",), "x, v", ("symmetry",), "a text such as 'x -> -x"),
        (("units", "x"), "mm", ("units", "x"), "the unit of 'x' must be a positive number"),
        (("spread", "v"), [1], ("spread", "v"), "the spread of 'v' must be a half-width"),
        (("surfaces", "v", "sliding"), "yes", ("surfaces", "v", "sliding"), "Valid: filippov"),
    ],
)
def test_mistakes_have_their_place(place, value, address, says) -> None:
    with pytest.raises(EntryError) as caught:
        describe(_changed(yaml.safe_load(EVERYTHING), place, value))
    assert says in str(caught.value)
    assert address is None or caught.value.address == address


@pytest.mark.parametrize(
    ("contact", "key", "says"),
    [
        (
            {"velocity": "v1", "kinetic": "S"},
            None,
            "key 'kind' is missing; it must be friction, jenkins",
        ),
        ({"kind": "frictoin"}, "kind", "'kind' has no 'frictoin'; did you mean 'friction'?"),
        ({"kind": "spring", "gap": "q1"}, None, "key 'stiffness' is missing"),
        ({"kind": "impact", "gap": "q1", "restitution": 0.5, "at": 0}, "at", "unknown key 'at'"),
        (
            {"kind": "jenkins", "gap": "q1"},
            "gap",
            "Valid: kind, displacement, stiffness, limit, at",
        ),
    ],
)
def test_a_contact_has_the_keys_of_its_kind(contact, key, says) -> None:
    data = yaml.safe_load((bundled_dir("models") / "two-blocks.yaml").read_text(encoding="utf-8"))
    data["contacts"]["first"] = contact
    with pytest.raises(EntryError) as caught:
        describe(data)
    assert says in str(caught.value)
    assert caught.value.address == ("contacts", "first", *([key] if key else []))


def test_the_line_is_that_of_the_entry(tmp_path: Path) -> None:
    path = tmp_path / "spring.yaml"
    path.write_text(EVERYTHING.replace("label: big", "labell: big"), encoding="utf-8")
    line = EVERYTHING.splitlines().index("domains:") + 2
    with pytest.raises(
        cf.ModelError, match=f"{path}:{line}: unknown key 'labell'; did you mean 'label'"
    ):
        cf.load_model(path)
