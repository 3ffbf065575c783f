r"""Sliding where two switching surfaces cross, of fields that add up.

Near the place where ``h1 = 0`` and ``h2 = 0`` cross there are four fields ``f(s1, s2)``, s = +1 or -1.
Filippov's convex combinations of four fields that keep two functions leave one of them free. They are one
field where

.. math:: f(+,+) - f(+,-) - f(-,+) + f(-,-) = 0,

that is ``f = f0 + s1 g1 + s2 g2``: two switches, each with an effect of its own, as of two contacts with
friction. A solution then has ``s1, s2`` in [-1, 1], each ``sgn h`` off its surface, and along it ``h_i``
changes at the rate

.. math:: r_i = c_i + A_{i1} s_1 + A_{i2} s_2 .

* on both surfaces ``s = -A^{-1} c``, the equivalent control of V. I. Utkin (Sliding Modes in Control and
  Optimization, Springer 1992), which needs A regular;
* on the first one, ``s1 = -(c1 + A12 s2) / A11`` with ``s2 = sgn h2``, and the like on the second one.

Which of these goes on from the place is a linear complementarity problem: one s of each that stays is inside
of [-1, 1], and one that leaves is +-1 with its h growing to that side. Where ``-A`` is a P-matrix
(``A11 < 0``, ``A22 < 0``, ``det A > 0``: each switch drives back to its own surface, and both together do) it
has exactly one solution for every c (R. W. Cottle, J.-S. Pang, R. E. Stone, The Linear Complementarity
Problem, SIAM 2009, theorem 3.3.7). The signs of a few heights tell it. Motion goes on

* on both where ``|s1| < 1`` and ``|s2| < 1`` of ``s* = -A^{-1} c``;
* on the first, with h2 to the side s2, where ``|s1| < 1`` of ``-(c1 + A12 s2)/A11``, and ``s2 s2* > 1``;
* on none, to the sides s1 and s2, where ``s1 s1(s2) > 1`` and ``s2 s2(s1) > 1``.

If A depends on parameters only, on the surfaces, all of these are levels of four observables, ``c1``, ``c2``
and both ``s*``. If it depends on the state or on time (the inertia of an arm with two joints), they are the
levels 1 and -1 of six: ``-(c1 + A12 s2)/A11`` for each s2, the like on the second, and both ``s*``.

This module imports sympy, and is loaded where a model asks for it.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

import sympy

from contfric.models.described.description import Description, ModeText
from contfric.models.described.evaluate import Sampler, defaults, floats
from contfric.models.entries import EntryError
from contfric.models.generated.symbols import Formulas

_SIGNS = ((1, 1), (1, -1), (-1, 1), (-1, -1))
_MARK = {1: "+", -1: "-", 0: 0}
#: Entries of the matrix, and levels that must differ, at the default parameters: rounding of numbers of order
#: 1.
_NOTHING = 1e-12
#: States at which a matrix that varies is looked at.
_PLACES = 200


class CrossingSurfaces:
    """Two switching surfaces that cross, and the four modes around the place."""

    def __init__(self, formulas: Formulas, surfaces: tuple[str, str]) -> None:
        self.formulas, self.surfaces = formulas, surfaces
        description = formulas.description
        modes = _quadrants(description, surfaces)
        self.others = {s: v for s, v in modes[1, 1].sides.items() if s not in surfaces}
        names = [mode.name for mode in description.modes]
        fields, heights = formulas.fields, [formulas.heights()[name] for name in surfaces]
        f = {signs: fields[names.index(mode.name)] for signs, mode in modes.items()}
        self._check_sum(f)
        self.mean = [sum(row) / 4 for row in zip(*f.values(), strict=True)]
        self.pulls = [  # g1 and g2
            [(a - b) / 2 for a, b in zip(f[1, 1], f[other], strict=True)]
            for other in ((-1, 1), (1, -1))
        ]
        self.known = [self._known(height) for height in heights]
        r = {  # each rate counts on its own surface only
            s: [formulas.rate(heights[i], field).subs(self.known[i]) for i in (0, 1)]
            for s, field in f.items()
        }
        self.rates = [_short(sum(r[s][i] for s in _SIGNS) / 4) for i in (0, 1)]
        self.matrix = sympy.Matrix(
            2,
            2,
            lambda i, j: _short((r[1, 1][i] - r[((-1, 1), (1, -1))[j]][i]) / 2),
        )
        self.det = _short(self.matrix.det())
        self._check_matrix()

    def _check_sum(self, f: Mapping[tuple[int, int], list[Any]]) -> None:
        for k, state in enumerate(self.formulas.description.states):
            rest = sympy.simplify(_short(f[1, 1][k] - f[1, -1][k] - f[-1, 1][k] + f[-1, -1][k]))
            if rest != 0:
                self.refuse(
                    f"the fields around that place do not add up in '{state}' (f++ - f+- - f-+ + f-- is "
                    "not 0), so that sliding there is not determined by them"
                )

    def _check_matrix(self) -> None:
        """Refuse a matrix that is singular, or does not drive back to both surfaces."""
        if self.det == 0:
            self.refuse("the 2 x 2 system for both switches is singular")
        formulas = self.formulas
        arguments = list(formulas.moving)
        entries = sympy.lambdify(
            arguments, [a.subs(formulas.defaults) for a in self.matrix], "math"
        )
        description = formulas.description
        sampler = Sampler(floats(description), defaults(description))
        for t, y in sampler.states(_PLACES if self.varies else 1):
            a, b, c, d = map(float, entries(t, *y))
            if not (a < 0 and d < 0 and a * d > b * c):
                self.refuse(
                    "at the defaults solutions are not driven back to both (the matrix of rates is "
                    f"{[[a, b], [c, d]]}{self._at(t, y)}; its diagonal has to be negative, its "
                    "determinant positive)"
                )

    @property
    def varies(self) -> bool:
        """Whether the matrix depends on the state or on time."""
        moving = {self.formulas.t, *self.formulas.y}
        return any(entry.free_symbols & moving for entry in self.matrix)

    def _at(self, t: float, y: list[float]) -> str:
        """Return in words where a matrix that varies was evaluated."""
        names = ("t", *self.formulas.description.states)
        values = ", ".join(f"{n} = {v:.6g}" for n, v in zip(names, (t, *y), strict=True))
        return f" at {values}" if self.varies else ""

    def is_linear(self, formula: Any) -> bool:
        """Tell whether a formula is linear in the parameters, as constraints have to be."""
        p = self.formulas.p
        return all(formula.diff(a, b) == 0 for a in p for b in p)

    def refuse(self, why: str) -> None:
        """Raise the error that says why sliding on both surfaces is not derived."""
        one, other = self.surfaces
        raise EntryError(
            ("surfaces", one, "sliding"),
            f"'{one}' and '{other}' cross each other, and solutions could slide on both: {why}. Write the "
            "sliding modes yourself",
        )

    def _known(self, height: Any) -> dict[Any, Any]:
        """Return what is known of states on a surface: that of its level, where it is one of a state."""
        moving = {self.formulas.t, *self.formulas.y}
        levels = {state: state - height for state in self.formulas.y}
        return {s: level for s, level in levels.items() if not level.free_symbols & moving}

    def on_both(self, formula: Any) -> Any:
        """Return a formula on both surfaces."""
        return formula.subs({**self.known[0], **self.known[1]})

    def text(self, formula: Any) -> str:
        """Return a formula as an expression of the model."""
        # factors, as derivatives of an expanded quotient are long
        return self.formulas.text((sympy.factor if self.varies else sympy.simplify)(formula))

    def field(self, values: tuple[Any, Any], on: tuple[int, ...]) -> dict[str, str]:
        """Return the field of both switches at some values, on some of the surfaces."""
        s1, s2 = values
        known = {key: value for i in on for key, value in self.known[i].items()}
        rows = zip(self.formulas.description.states, self.mean, *self.pulls, strict=True)
        return {state: self.text((f + s1 * g1 + s2 * g2).subs(known)) for state, f, g1, g2 in rows}


def _short(formula: Any) -> Any:
    """Return a formula as one fraction without common factors: 0 where it vanishes."""
    return sympy.cancel(formula)


def _quadrants(
    description: Description, surfaces: tuple[str, str]
) -> dict[tuple[int, int], ModeText]:
    """Return the mode on each pair of sides of two surfaces."""
    one, other = surfaces
    found: dict[tuple[int, int], ModeText] = {}
    for signs in _SIGNS:
        fits = [
            m
            for m in description.modes
            if (m.sides.get(one), m.sides.get(other)) == signs and 0 not in m.sides.values()
        ]
        rest = {
            tuple(sorted((s, v) for s, v in m.sides.items() if s not in surfaces)) for m in fits
        }
        if len(fits) != 1 or len(rest) != 1:
            raise EntryError(
                ("surfaces", one, "sliding"),
                f"'{one}' and '{other}' cross each other: sliding there is derived from one mode on each "
                "pair "
                f"of their sides ({one}: {_MARK[signs[0]]} with {other}: {_MARK[signs[1]]} has {len(fits)})",
            )
        found[signs] = fits[0]
    return found


def crossing_parts(
    description: Description, surfaces: tuple[str, str], data: Mapping[str, Any]
) -> dict[str, Any]:
    """Return observables, surfaces, modes and departures of a model with sliding on two surfaces that cross.

    Raises
    ------
    EntryError
        If what motion does where they cross does not follow from the fields.
    """
    crossing = CrossingSurfaces(Formulas(description), surfaces)
    found: dict[str, Any] = {k: dict(data[k]) for k in ("observables", "surfaces", "modes")}
    found["departures"] = list(data["departures"])
    found["constraints"] = dict(data["constraints"])
    limits = _Limits(crossing, found)
    a, b = surfaces
    matrix, c = crossing.matrix, crossing.rates
    for i, s in itertools.product((0, 1), (1, -1)):
        own = -(c[i] + matrix[i, 1 - i] * s) / matrix[i, i]
        both = (own, s) if i == 0 else (s, own)
        on, beside = (a, b) if i == 0 else (b, a)
        found["modes"][f"slide_{on}_{beside}{'_above' if s > 0 else '_below'}"] = {
            "in": {**crossing.others, on: 0, beside: _MARK[s], **limits.alone(i, s)},
            "field": crossing.field(both, (i,)),
            "derived": True,
        }
        found["departures"] += [
            {
                "where": {on: 0, beside: _MARK[s], **limits.beyond(i, s, out)},
                "leaves": {on: _MARK[out]},
            }
            for out in (1, -1)
        ]
        found["departures"].append(
            {
                "where": {a: 0, b: 0, **limits.alone(i, s), **limits.corner_beyond(1 - i, s)},
                "leaves": {beside: _MARK[s]},
            }
        )
    s_both = (
        -(matrix[1, 1] * c[0] - matrix[0, 1] * c[1]) / crossing.det,
        -(matrix[0, 0] * c[1] - matrix[1, 0] * c[0]) / crossing.det,
    )
    found["modes"][f"slide_{a}_{b}"] = {
        "in": {**crossing.others, a: 0, b: 0, **limits.corner(0), **limits.corner(1)},
        "field": crossing.field(s_both, (0, 1)),
        "derived": True,
    }
    found["departures"] += [
        {
            "where": {a: 0, b: 0, **limits.beyond(0, s2, s1), **limits.beyond(1, s1, s2)},
            "leaves": {a: _MARK[s1], b: _MARK[s2]},
        }
        for s1, s2 in _SIGNS
    ]
    limits.keep_order()
    return found


class _Limits:
    """The surfaces that bound sliding, on one surface and on both, put into a model as they are asked for."""

    def __init__(self, crossing: CrossingSurfaces, found: dict[str, Any]) -> None:
        self.crossing, self.found = crossing, found
        self.levels: dict[str, list[tuple[str, Any]]] = {}

    def _surface(self, observable: str, formula: Any, level: Any) -> str:
        """Return the name of the surface of an observable at a level; a new one if needed."""
        known = self.levels.setdefault(observable, [])
        for name, other in known:
            if sympy.simplify(level - other) == 0:
                return name
        name = f"{observable}_{len(known) + 1}"
        known.append((name, level))
        self.found["observables"][observable] = self.crossing.text(formula)
        self.found["surfaces"][name] = {
            "observable": observable,
            "level": self.crossing.text(level),
        }
        return name

    def _limit(self, i: int, s: int, out: int) -> str:
        """Return the surface at which sliding on surface i, on the side s of the other, ends to a side."""
        matrix, name = self.crossing.matrix, self.crossing.surfaces[i]
        if self.crossing.varies:
            own = -(self.crossing.rates[i] + matrix[i, 1 - i] * s) / matrix[i, i]
            side = "" if matrix[i, 1 - i] == 0 else "_above" if s > 0 else "_below"
            return self._surface(f"switch_{name}_alone{side}", own, sympy.Integer(out))
        # s_i = out, that is c_i = -A_ii out - A_ij s
        level, rate = -matrix[i, i] * out - matrix[i, 1 - i] * s, self.crossing.rates[i]
        if matrix[i, 1 - i] == 0 and not self.crossing.is_linear(matrix[i, i]):
            level, rate = sympy.Integer(out), -rate / matrix[i, i]
        return self._surface(f"rate_{name}", rate, level)

    def alone(self, i: int, s: int) -> dict[str, Any]:
        """Return the sides on which sliding on surface i holds, on the side s of the other."""
        return {self._limit(i, s, 1): "-", self._limit(i, s, -1): "+"}

    def beyond(self, i: int, s: int, out: int) -> dict[str, Any]:
        """Return the side on which it has ended to the side ``out``."""
        return {self._limit(i, s, out): _MARK[out]}

    def _corner_limit(self, i: int, out: int) -> str:
        matrix, det = self.crossing.matrix, self.crossing.det
        if matrix[i, 1 - i] == 0:  # the other switch has no part in it
            return self._limit(i, 1, out)
        name = f"switch_{self.crossing.surfaces[i]}"
        own, cross = matrix[1 - i, 1 - i], matrix[i, 1 - i]
        both = -(own * self.crossing.rates[i] - cross * self.crossing.rates[1 - i]) / det
        return self._surface(name, self.crossing.on_both(both), sympy.Integer(out))

    def corner(self, i: int) -> dict[str, Any]:
        """Return the sides on which the switch i is inside of [-1, 1] on both surfaces."""
        if self.crossing.matrix[i, 1 - i] == 0:
            return self.alone(i, 1)
        return {self._corner_limit(i, 1): "-", self._corner_limit(i, -1): "+"}

    def corner_beyond(self, i: int, out: int) -> dict[str, Any]:
        """Return the side on which it is beyond ``out`` there."""
        inside = self.corner(i)
        name = self._corner_limit(i, out)
        return {name: "-" if inside[name] == "+" else "+"}

    def keep_order(self) -> None:
        """Add the constraints under which the levels of an observable keep the order that they have now.

        The regions of a model lie between its surfaces in their order at the default parameters.
        """
        formulas = self.crossing.formulas
        values = formulas.defaults
        for known in self.levels.values():
            placed = sorted(known, key=lambda item: float(item[1].subs(values)))
            for (_, low), (_, high) in itertools.pairwise(placed):
                apart = sympy.expand(high - low)
                if abs(float(apart.subs(values))) < _NOTHING:
                    self.crossing.refuse(
                        "two of the limits of sliding agree at the defaults, where their order is not told "
                        f"({self.crossing.text(low)} and {self.crossing.text(high)}): choose other defaults"
                    )
                if not apart.free_symbols:
                    continue
                if not self.crossing.is_linear(apart):
                    self.crossing.refuse(
                        "the order of the limits of sliding is no linear condition on the parameters "
                        f"({self.crossing.text(apart)} > 0)"
                    )
                text = f"{self.crossing.text(apart / 2)} > 0"
                self.found["constraints"].setdefault(
                    text,
                    "the limits of derived sliding keep their order: else choose other defaults",
                )
