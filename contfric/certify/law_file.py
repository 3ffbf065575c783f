"""The certificate of an orbit of a piecewise-linear model as plain data: it states the law of the model, too.

The law is what :mod:`contfric.verify.piecewise` reads: the fields, surfaces and maps of the modes that an
orbit visits, as formulas of the parameters, the sides on which each mode holds, and the transitions.
The orbit is written as a whole, not as its half.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import sympy

from contfric.bvp.system import System
from contfric.certify.certificate import Certificate
from contfric.certify.orbit import certify_orbit
from contfric.errors import ParameterError
from contfric.models.balls.declared import AffineModel, affine_of
from contfric.models.definition import Model
from contfric.models.mode_domains import mode_domains
from contfric.verify.piecewise import check_text

#: The checker inverts a dense matrix of as many rows: 250 take it 2 s, and twice as many eight times that.
_MOST_UNKNOWNS = 600


@dataclass(frozen=True)
class _Writer:
    """The rows of a model as mappings from the names of states and harmonics to formulas."""

    model: Model
    affine: AffineModel

    @property
    def columns(self) -> list[str]:
        """The names of the entries of the extended state."""
        waves = [f"{f}({k})" for k in self.affine.turns for f in ("cos", "sin")]
        return [*self.model.states, "1", *waves]

    def text(self, formula: Any) -> str:
        """Return a formula with its numbers as exact fractions."""
        found = sympy.sympify(formula)
        exact = {x: sympy.Rational(*float(x).as_integer_ratio()) for x in found.atoms(sympy.Float)}
        names = {symbol: sympy.Symbol(name) for name, symbol in self.affine.parameters.items()}
        return str(found.xreplace(exact | names))

    def row(self, formulas: Sequence[Any]) -> dict[str, str]:
        """Return what a row has that is not 0."""
        return {
            name: self.text(e) for name, e in zip(self.columns, formulas, strict=True) if e != 0
        }

    def rows(self, formulas: Sequence[Sequence[Any]]) -> dict[str, dict[str, str]]:
        """Return a row for each state."""
        return {name: self.row(row) for name, row in zip(self.model.states, formulas, strict=True)}

    @property
    def frequency(self) -> str | None:
        """One turn in a period of the excitation; None without one."""
        if self.model.autonomous:
            return None
        if self.affine.turns:
            return self.text(sympy.simplify(self.affine.frequencies[0] / self.affine.turns[0]))
        return self.text(2 * sympy.pi / self.affine.period)


def law_data(system: System) -> tuple[dict[str, Any], list[list[Any]]]:
    """Return the law of the modes that an orbit visits, and its segments: mode, surface and transition."""
    model, layout = system.model, system.layout
    affine = affine_of(model)
    write, names = _Writer(model, affine), [s.name for s in model.surfaces]
    own, inside = zip(*(_held_in(system, i, names) for i in range(system.segments)), strict=True)
    segments, transitions = list[list[Any]](), list[dict[str, Any]]()
    for i, (_, exit_) in enumerate(system.itinerary):
        following = (i + 1) % system.segments
        reset = int(layout.resets[following])
        one = {
            "from": own[i],
            "at": exit_,
            "when": {names[k]: s for j, k, s, at in layout.joint.tolist() if (j, at) == (i, 0)},
            "map": names[reset] if reset >= 0 else None,
            "after": {
                names[k]: s for j, k, s, at in layout.joint.tolist() if (j, at) == (following, 1)
            },
            "to": own[following],
        }
        if one not in transitions:
            transitions.append(one)
        segments.append([own[i], exit_, transitions.index(one)])
    used = {name for one in transitions for name in (one["at"], *one["when"], *one["after"])}
    used |= {name for sides in inside for name in sides}
    maps = {one["map"] for one in transitions if one["map"]}
    law = {
        "states": list(model.states),
        "frequency": write.frequency,
        "harmonics": list(affine.turns),
        "modes": {
            name: {"field": write.rows(affine.fields[mode]), "inside": sides}
            for name, (mode, _), sides in zip(own, system.itinerary, inside, strict=True)
        },
        "surfaces": {name: write.row(affine.surfaces[name][0]) for name in names if name in used},
        "maps": {name: write.rows(affine.resets[name]) for name in names if name in maps},
        "transitions": transitions,
    }
    return law, segments


def _held_in(system: System, i: int, names: list[str]) -> tuple[str, dict[str, int]]:
    """Return the mode of a segment, the surfaces that it stays on, 0, and the sides of those that bound it.

    A mode that ends on a section, on which nothing changes, is written as the part of it on one side.
    """
    model, layout, (mode, exit_) = system.model, system.layout, system.itinerary[i]
    domains = [model.domain_by_name[name].signs for name in mode_domains(model, mode)]
    sides = {name: 0 for name in domains[0] if all(signs[name] == 0 for signs in domains)}
    sides |= {names[k]: side for j, k, side in layout.interior.tolist() if j == i}
    if exit_ in sides:
        return mode, sides
    side = -int(layout.exit_signs[i])
    return f"{mode} ({exit_} {'>' if side > 0 else '<'} 0)", sides | {exit_: side}


def law_certificate(
    certificate: Certificate, written: Callable[[Certificate], dict[str, Any]]
) -> dict[str, Any]:
    """Return the certificate of an orbit with the law of its model as plain data.

    Parameters
    ----------
    written : callable
        Returns the entries that are common to the orbits of all models, with all unknowns of their joints

    Raises
    ------
    ParameterError
        If the file cannot state it, or the checker does not verify it: the message says why.
    """
    orbit = certificate.orbit
    if orbit.system.holds or certificate.kept:
        what = "holds" if orbit.system.holds else "a family of orbits"
        raise ParameterError(f"certificate files are not offered for {what} of declared models")
    size = orbit.joints.size * (2 if orbit.system.half else 1)
    if size > _MOST_UNKNOWNS:
        raise ParameterError(
            f"certificate files of declared models have at most {_MOST_UNKNOWNS} unknowns, "
            f"and the joints of this orbit have {size}"
        )
    if orbit.system.half:
        certificate = certify_orbit(orbit.as_whole())
        orbit = certificate.orbit
    law, segments = law_data(orbit.system)
    data = written(certificate) | {"equations": law, "segments": segments}
    data["periods"] = None if orbit.model.autonomous else data["periods"]
    data.pop("half")
    answer = check_text(json.dumps(data))
    if not answer.yes and data["multipliers"]:
        data["multipliers"] = []
        answer = check_text(json.dumps(data))
    if not answer.yes:
        raise ParameterError(f"the checker does not verify this certificate: {answer.why}")
    return data
