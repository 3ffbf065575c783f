"""How results are displayed: as a short table of attributes in a notebook, as aligned text elsewhere."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from typing import Any

#: Of each class, the attributes that its table shows; those of its base classes if it is not named.
_FACTS = {
    "Orbit": "signature periods period multipliers stable x_max x_min residual status",
    "Trajectory": "params end",
    "Gradient": "value ahead notes",
    "Branch": "name bifurcations ends mirrored notes",
    "Bifurcation": "meaning params orbit stable_before stable_after located contacts proposals",
    "Diagram": "branches bifurcations loose_ends complete verified notes",
    "Curve": "meanings special ends",
    "SpecialPoint": "kind params meets orbit located",
    "QuantityCurve": "quantity value parameters ends",
    "Plane": "ranges curves special regions complete notes",
    "Region": "point share families",
    "Census": "params periods orbits complete",
    "Window": "itinerary turns range branch",
    "LyapunovExponents": "motion exponents errors params periods",
    "LyapunovMap": "shape params counts complete",
    "Sweep": "parameter section params counts complete",
    "Returns": "section params outcome cycles complete",
    "ReleaseMap": "mode surface period params branches complete",
    "StableSet": "orbit phase breaks ends",
    "Basins": "shape shares orbits params complete",
    "Ensemble": "parameter range distributions counts classes events complete",
    "Equilibria": "points sets params complete",
    "Rest": "state eigenvalues stable params",
    "EquilibriumBranch": "parameter params events ends",
    "EquilibriumDiagram": "parameter params branches events complete",
    "EquilibriumEvent": "meaning value stable_before stable_after equilibrium",
    "Fit": "params sigma chi_square converged message orbits",
    "Certificate": "orbit proved why width multipliers",
    "EventCertificate": "event proved why radius",
    "BranchCertificate": "branch proved why covered gaps",
    "DiagramCertificate": "branches events covered undecided",
    "Model": "states parameters surfaces modes",
    "ModelReport": "ok findings",
    "TwoFold": "kind params state time",
    "Signature": "segments periods symmetric",
    "StudyResult": "out status files",
}
#: A sequence shows so many of its entries, a text so many of its characters.
_MOST, _LONGEST = 12, 300


class Shown:
    """A result that a notebook shows as a table; elsewhere its ``repr`` is one line."""

    def _repr_html_(self) -> str:
        names = next((_FACTS[c.__name__] for c in type(self).__mro__ if c.__name__ in _FACTS), "")
        rows = "".join(
            f'<tr><th style="text-align:left">{_cut(name.replace("_", " "))}</th>'
            f'<td style="text-align:left">{"<br/>".join(lines)}</td></tr>'
            for name in names.split()
            if (lines := [_cut(line) for line in _lines(getattr(self, name))])
        )
        return f"<p><b>{_cut(repr(self).splitlines()[0])}</b></p><table>{rows}</table>"


class AtParameters(Shown):
    """A result at one set of parameters: ``vector`` of a ``model``."""

    @property
    def params(self) -> dict[str, float]:
        """All parameters by name."""
        return self.model.mapping(self.vector)  # type: ignore[attr-defined,no-any-return]


def _cut(text: str) -> str:
    """Return a text for a cell, without its end if it is long."""
    from html import escape  # a notebook needs it, a run does not

    return escape(text if len(text) <= _LONGEST else f"{text[: _LONGEST - 2]} …")


def _lines(value: Any) -> Iterator[str]:
    """Yield what a cell shows of a value, line by line; nothing of one that is absent or empty."""
    value = value() if callable(value) else value
    if isinstance(value, Mapping):
        if value:
            yield ", ".join(f"{_text(k)} = {_text(v)}" for k, v in value.items())
    elif _is_many(value):
        entries = list(value)
        if entries and all(isinstance(e, str | int | float | complex) for e in entries):
            yield ", ".join(map(_text, entries))
            return
        for entry in entries[:_MOST]:
            yield ", ".join(map(_text, entry)) if _is_many(entry) else _text(entry)
        if len(entries) > _MOST:
            yield f"… and {len(entries) - _MOST} more"
    elif value is not None and value != "":
        yield _text(value)


def _is_many(value: Any) -> bool:
    """Tell a plain sequence from a result that can be indexed, and from text."""
    return hasattr(value, "__len__") and not isinstance(value, str | Shown | Mapping)


def _text(value: Any) -> str:
    """Return one value as text.

    Examples
    --------
    >>> _text(True), _text(0.5), _text(0.5 - 0.25j)
    ('yes', '0.5', '0.5-0.25j')
    """
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.8g}"
    if isinstance(value, complex):
        return f"{value.real:.6g}{value.imag:+.6g}j" if value.imag else f"{value.real:.6g}"
    return (
        repr(value)
        if isinstance(value, Shown) and type(value).__name__ != "Signature"
        else str(value)
    )


def aligned(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yield rows of a table as lines with aligned columns.

    Examples
    --------
    >>> list(aligned([["name", "points"], ["1a", "104"]]))
    ['name  points', '1a    104']
    """
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        yield "  ".join(cells).rstrip()
