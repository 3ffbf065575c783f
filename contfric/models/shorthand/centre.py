"""The centre of a symmetry with a shift: ``x -> c - x`` is ``X -> -X`` of X, measured from ``c/2``.

A symmetry ``y -> K y + k`` leaves ``k/2`` where it is, if it takes solutions back when it is applied twice
(``K k = -k``). States that are shifted are measured from there, as others are measured in units: then the
symmetry is linear, and all that uses it knows of no shift. The shift may depend on parameters.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from contfric.errors import ModelError
from contfric.models.entries import EntryError
from contfric.models.language.coefficients import (
    AFFINE,
    CONSTANT,
    Affine,
    Coefficient,
    number,
    symbols,
)
from contfric.models.language.grammar import TIME, Scope, parse
from contfric.models.language.not_affine import NotAffineError
from contfric.models.shorthand.tied import Substitution
from contfric.models.shorthand.units import measured

#: The key of a model that is written out: its formulas are measured from these origins already.
APPLIED = "measured_from"


def centred(data: dict[str, Any]) -> dict[str, Any]:
    """Return a model's data with states measured from the centre of its symmetry; unchanged without a shift.

    Parameters
    ----------
    data : with surfaces whose observables have names

    Raises
    ------
    EntryError
        If the symmetry is not linear, or leaves no state where it is; for a structure of many contacts.
    """
    images, states = data.get("symmetry"), data["states"]
    if not images:
        return data
    forms = _affine(data, {s: images.get(s, s) for s in states})
    shifts = {s: form.parts.get(CONSTANT, Coefficient()) for s, form in forms.items()}
    if not any(shifts.values()):
        return data
    if data.get("structure"):
        raise EntryError(("symmetry",), "the symmetry of a structure of many contacts has no shift")
    rows = {s: _row(s, form, len(states)) for s, form in forms.items()}
    for s, row in rows.items():
        again = shifts[s]
        for factor, other in zip(row, states, strict=True):
            again = again + number(factor) * shifts[other]
        if again:
            raise EntryError(
                ("symmetry", s),
                f"the symmetry leaves no {s} where it is: applied twice, it is still a shift",
            )
    rest = _at_rest(data)
    origins = {
        s: _half(shift) or f"0.5*({rest.text(images[s])})" for s, shift in shifts.items() if shift
    }
    found = measured({k: v for k, v in data.items() if k != "symmetry"}, {}, origins)
    linear = {s: _text(row, states) for s, row in rows.items()}
    return found | {"symmetry": {**images, **linear}, APPLIED: origins}


def _affine(data: Mapping[str, Any], images: Mapping[str, str]) -> dict[str, Affine]:
    """Return images as affine forms of the states; none where one has no such form."""
    if {*data["states"]} & {*data["parameters"]}:
        return {}  # whoever reads the names says so
    names = symbols(tuple(data["states"]), tuple(data["parameters"]))
    names = {name: form for name, form in names.items() if name != TIME}
    try:
        scope = Scope(AFFINE, names, {n: parse(f) for n, f in data["define"].items()})
        return {s: scope.evaluate(parse(text)) for s, text in images.items()}
    except (NotAffineError, ModelError):  # whoever reads them says why
        return {}


def _row(state: str, form: Affine, n: int) -> tuple[float, ...]:
    """Return the factors of the states in an image."""
    found = [form.parts.get(("y", i), Coefficient()).number for i in range(n)]
    known = tuple(c for c in found if c is not None)
    if len(known) < n:
        raise EntryError(
            ("symmetry", state),
            f"the image of {state} must be linear in the states, its factors numbers, such as c - {state}",
        )
    return known


def _at_rest(data: Mapping[str, Any]) -> Substitution:
    """Return what puts definitions into an expression, and 0 for the states."""
    known = dict.fromkeys(data["states"], "0")
    for name, text in data["define"].items():
        known[name] = f"({Substitution(known).text(text)})"
    return Substitution(known)


def _half(shift: Coefficient) -> str:
    """Return half of a shift as an expression; nothing if it has functions of parameters."""
    terms = []
    for powers, factor in shift.parts:
        if any(atom.of for atom, _ in powers):
            return ""
        names = [atom.name if n == 1 else f"{atom.name}**({n})" for atom, n in powers]
        size = [repr(abs(factor)).removesuffix(".0")] if abs(factor) != 1.0 or not names else []
        terms.append((factor < 0.0, "*".join([*size, *names])))
    terms.sort(key=lambda term: term[0])  # what is added comes first
    text = "".join(f" {'-' if minus else '+'} {term}" for minus, term in terms)
    text = f"-{text[3:]}" if terms[0][0] else text[3:]
    return f"({text})/2" if len(terms) > 1 else f"{text}/2"


def _text(row: tuple[float, ...], states: list[str]) -> str:
    return " + ".join(f"{c!r}*{s}" for c, s in zip(row, states, strict=True) if c) or "0"
