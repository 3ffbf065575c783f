r"""Two-folds: places on a switching surface at which the fields of both sides are tangent to it.

On a surface ``h = 0`` between ``f+`` (h > 0) and ``f-`` let ``L h = h_t + h_y f`` be the rate of h along a
field. A field is tangent where it vanishes, and its second derivative ``L L h`` tells how:

============  ===================  ===================
tangency      ``f+``               ``f-``
============  ===================  ===================
visible       ``L L h > 0``        ``L L h < 0``
invisible     ``L L h < 0``        ``L L h > 0``
============  ===================  ===================

Motion that is visible leaves into its side; one that is invisible comes back to the surface at once. Where
both tangencies meet, crossing, sliding and escaping regions of the surface meet in one place, and what
follows from there may not be unique: a two-fold, visible, visible-invisible, or invisible (Teixeira's
singularity). (A. F. Filippov, Differential Equations with Discontinuous Righthand Sides, Kluwer 1988, section
19; M. R. Jeffrey, A. Colombo, The two-fold singularity of discontinuous vector fields, SIAM J. Appl. Dyn.
Syst. 8 (2009) 624-640.)

Two-folds obey three equations, ``h = L+ h = L- h = 0``, in the states and, under excitation, the time: in
three unknowns they are points, in more of them sets. A plane without excitation has them by accident only.

This module imports sympy, and is loaded where two-folds are asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.shown import AtParameters
from contfric.errors import ParameterError, whole_number
from contfric.models.definition import Domain, Model
from contfric.models.described.description import Description
from contfric.models.generated.symbols import Formulas
from contfric.models.language.formulas import vanishes
from contfric.models.language.numbers import function_of_numbers
from contfric.models.tied import tied

if TYPE_CHECKING:
    from contfric.models import ModelSource, Parameters

#: Newton's method: steps, and what is short, relative to the natural sizes.
_STEPS, _SHORT = 60, 1e-12
#: A residual below this, relative to what it changes by over the natural sizes, is zero.
_ZERO = 1e-9
#: Two places nearer than this are one; a place within this of another surface lies on it.
_SAME, _ON = 1e-6, 1e-9
#: Second derivatives, and gradients that depend on each other, are zero below this share.
_FLAT, _RANK = 1e-8, 1e-8
#: Places next to a two-fold, how far they are, and Newton's steps that put them onto the surface. Rates that
#: differ do so by about their slopes times that distance; rounding is far below a thousandth of it.
_NEIGHBOURS, _NEAR, _ONTO, _JUMP = 30, 1e-4, 3, 1e-7
#: Unknowns of the three equations.
_LEAST = 3


class TwoFoldKind(str, Enum):
    """Kinds of two-folds; the text says what motion does there."""

    VISIBLE = "visible: solutions on both sides leave the surface"
    MIXED = "visible-invisible: solutions leave the surface on one side, and come back on the other"
    INVISIBLE = "invisible (Teixeira's singularity): solutions on both sides come back"
    DEGENERATE = "degenerate: a tangency of higher order"


@dataclass(frozen=True, eq=False)
class TwoFold(AtParameters):
    """A two-fold, or one place of a set of them.

    Attributes
    ----------
    surface, above, below : the surface and the modes on its sides
    time, state : where it is; the time counts under excitation only
    curvatures : (float, float)
        Second derivatives of the height of the surface along both fields, that above first.
    dimension : int
        0 where it is alone; else that of the set of two-folds that it is the nearest of to the origin.
    """

    model: Model
    vector: FloatArray
    surface: str
    above: str
    below: str
    time: float
    state: FloatArray
    curvatures: tuple[float, float]
    kind: TwoFoldKind
    dimension: int

    def __repr__(self) -> str:
        at = ", ".join(f"{s}={v:.6g}" for s, v in zip(self.model.states, self.state, strict=True))
        when = "" if self.model.autonomous else f", t={self.time:.6g}"
        wide = f", one of a set of dimension {self.dimension}" if self.dimension else ""
        name = self.kind.value.partition(":")[0]
        return (
            f"<two-fold on {self.surface} ({self.above}, {self.below}), {name}: {at}{when}{wide}>"
        )


def find_two_folds(
    model: ModelSource, params: Parameters | None = None, *, starts: int = 100, seed: int = 0
) -> tuple[TwoFold, ...]:
    """Find the two-folds of a model's switching surfaces.

    Newton's method starts from random states within twice the model's ``spread``: what it does not find
    may exist.

    Parameters
    ----------
    params : mapping, optional
        Parameters; defaults fill in.
    starts, seed : int
        Starts of Newton's method on each surface, and their seed.

    Returns
    -------
    tuple of TwoFold
        All that were found where they are points; of a set of them the nearest to the origin of each kind.

    Raises
    ------
    ParameterError
        If the model is not declared by formulas.

    Examples
    --------
    >>> import contfric as cf
    >>> cf.find_two_folds("relay-sliding")
    ()
    """
    model, params = tied(model, params)
    starts, seed = whole_number("starts", starts, least=1), whole_number("seed", seed, least=0)
    checked = model.check_params(params)
    if not model.definition:
        raise ParameterError(
            f"two-folds of '{model.name}' are found from its formulas, and it is not declared by formulas"
        )
    vector = model.vector(checked)
    dimension = len(model.states) + int(not model.autonomous) - _LEAST
    if dimension < 0:
        return ()
    found: list[TwoFold] = []
    for pair in _pairs(model):
        found += _of_pair(_Tangencies.of(model, vector, *pair), starts, seed, dimension)
    return tuple(found)


def _pairs(model: Model) -> Iterator[tuple[str, str, str]]:
    """Yield (surface, mode above, mode below) wherever two fields that differ meet."""
    resets = {reset.surface for reset in model.resets}
    seen = set()
    moving = [d for d in model.domains if not model.mode_by_name[d.mode].sliding]
    by_signs: dict[tuple[int, ...], list[str]] = {}
    for domain in moving:
        by_signs.setdefault(tuple(domain.signs.values()), []).append(domain.mode)
    for domain in moving:
        for surface in model.surfaces:
            if domain.signs.get(surface.name) != 1 or surface.name in resets:
                continue
            for other in by_signs.get(tuple({**domain.signs, surface.name: -1}.values()), ()):
                pair = surface.name, domain.mode, other
                if other != domain.mode and pair not in seen:
                    seen.add(pair)
                    yield pair


@lru_cache(maxsize=4)
def _formulas(description: Description) -> tuple[Formulas, list[list[Any]]]:
    """Return a description as formulas, and its fields: the same for all of its surfaces."""
    formulas = Formulas(description)
    return formulas, formulas.fields


@dataclass(frozen=True, eq=False)
class _Tangencies:
    """The three equations of a surface and two modes, in (t, y)."""

    model: Model
    vector: FloatArray
    surface: str
    above: str
    below: str
    equations: Callable[..., FloatArray]
    slopes: Callable[..., FloatArray]
    curvatures: Callable[..., FloatArray]
    identical: bool

    @classmethod
    def of(
        cls, model: Model, vector: FloatArray, surface: str, above: str, below: str
    ) -> _Tangencies:
        """Derive them from the formulas of a model."""
        description = model.description
        formulas, fields = _formulas(description)
        names = [mode.name for mode in description.modes]
        height = formulas.heights()[surface]
        pieces = len(formulas.pieces)
        own = [fields[names.index(mode) * pieces] for mode in (above, below)]

        rates = [formulas.rate(height, field) for field in own]
        second = [formulas.rate(r, field) for r, field in zip(rates, own, strict=True)]
        unknowns = list(formulas.moving)
        args = [unknowns, list(formulas.p)]
        equations = [height, *rates]
        return cls(
            model,
            vector,
            surface,
            above,
            below,
            function_of_numbers(args, equations),
            function_of_numbers(args, [[e.diff(u) for u in unknowns] for e in equations]),
            function_of_numbers(args, second),
            vanishes(rates[0] - rates[1]),
        )

    def jacobian(self, z: FloatArray) -> FloatArray:
        """Return the derivatives of the equations by (t, y), shape (3, 1 + n)."""
        found = self.slopes(z, self.vector)
        if self.model.autonomous:
            found[:, 0] = 0.0
        return found

    def newton(self, z: FloatArray, sizes: FloatArray) -> FloatArray | None:
        """Return the solution that the shortest steps lead to from (t, y), or None."""
        for _ in range(_STEPS):
            value = self.equations(z, self.vector)
            slopes = self.jacobian(z) * sizes
            if not (np.all(np.isfinite(slopes)) and np.all(np.isfinite(value))):
                return None
            step = np.linalg.lstsq(slopes, -value, rcond=_RANK)[0]
            z = z + step * sizes
            if np.max(np.abs(step)) < _SHORT * (1.0 + np.max(np.abs(z / sizes))):
                small = np.abs(value) <= _ZERO * np.max(np.abs(slopes), axis=1)
                return z if np.all(small) else None
        return None

    def is_regular(self, z: FloatArray, sizes: FloatArray) -> bool:
        """Tell whether the three gradients are independent."""
        slopes = self.jacobian(z) * sizes
        norms = np.linalg.norm(slopes, axis=1)
        if np.any(norms == 0.0):
            return False
        return bool(np.linalg.svd(slopes / norms[:, None])[1][-1] > _RANK)


def _of_pair(tangencies: _Tangencies, starts: int, seed: int, dimension: int) -> Iterator[TwoFold]:
    """Yield the two-folds between two modes."""
    if (
        tangencies.identical
    ):  # one rate on both sides: a tangency of one field, which is continuous there
        return
    model, vector = tangencies.model, tangencies.vector
    period = model.view(vector).period if not model.autonomous else 0.0
    widths = np.abs(model.spread(model.mapping(vector)))
    sizes = np.array([period or 1.0, *np.where(widths > 0.0, widths, 1.0)])
    low, high = model.region(vector)
    ranged = low != -high
    rng = np.random.default_rng(seed)
    found: list[tuple[FloatArray, TwoFold]] = []
    for _ in range(starts):
        start = rng.uniform(-2.0, 2.0, len(sizes)) * sizes
        start[1:][ranged] = rng.uniform(low[ranged], high[ranged])
        start[0] = rng.uniform(0.0, period) if period else 0.0
        z = tangencies.newton(start, sizes)
        if z is None or not tangencies.is_regular(z, sizes):
            continue
        z[0] = z[0] % period if period else 0.0
        if _adjoins(tangencies, z) and _jumps_near(tangencies, z, sizes):
            found.append((z, _two_fold(tangencies, z, dimension)))
    found.sort(key=lambda item: float(np.linalg.norm(item[0] / sizes)))
    kept: list[tuple[FloatArray, TwoFold]] = []
    for z, fold in found:
        if dimension:
            known = any(fold.kind is other.kind for _, other in kept)
        else:
            known = any(_is_same(z, other, sizes, period) for other, _ in kept)
        if not known:
            kept.append((z, fold))
            yield fold


def _is_same(z: FloatArray, other: FloatArray, sizes: FloatArray, period: float) -> bool:
    apart = np.abs(z - other)
    if period:
        apart[0] = min(apart[0], period - apart[0])
    return bool(np.max(apart / sizes) < _SAME)


def _adjoins(tangencies: _Tangencies, z: FloatArray) -> bool:
    """Tell whether both modes hold near a place on their surface."""
    model, flow = tangencies.model, tangencies.model.view(tangencies.vector)
    heights = {s.name: flow.height(s.name, float(z[0]), z[1:]) for s in model.surfaces}

    def holds(domain: Domain) -> bool:
        return all(
            s == tangencies.surface or heights[s] * side > -_ON for s, side in domain.signs.items()
        )

    return all(
        any(
            holds(d)
            for d in model.domains
            if d.mode == mode and d.signs[tangencies.surface] == side
        )
        for mode, side in ((tangencies.above, 1), (tangencies.below, -1))
    )


def _jumps_near(tangencies: _Tangencies, z: FloatArray, sizes: FloatArray) -> bool:
    """Tell whether the rates of both modes differ on the surface near a place, where both modes hold.

    Else the field is continuous there, and solutions are unique: two levels of a saturation meet.
    """
    rng = np.random.default_rng(0)
    fixed = tangencies.model.autonomous
    for _ in range(_NEIGHBOURS):
        near = z + _NEAR * sizes * rng.standard_normal(len(z))
        near[0] = z[0] if fixed else near[0]
        for _ in range(_ONTO):
            gradient = tangencies.jacobian(near)[0] * sizes
            height = tangencies.equations(near, tangencies.vector)[0]
            near = near - height * gradient / (gradient @ gradient) * sizes
        if not _adjoins(tangencies, near):
            continue
        _, up, down = tangencies.equations(near, tangencies.vector)
        if abs(up - down) > _JUMP * np.max(np.abs(tangencies.jacobian(near)[1:] * sizes)):
            return True
    return False


def _two_fold(tangencies: _Tangencies, z: FloatArray, dimension: int) -> TwoFold:
    with np.errstate(all="ignore"):
        up, down = (float(v) for v in tangencies.curvatures(z, tangencies.vector))
    size = max(abs(up), abs(down), 1e-300)
    if min(abs(up), abs(down)) <= _FLAT * size:
        kind = TwoFoldKind.DEGENERATE
    else:
        visible = (up > 0.0) + (down < 0.0)
        kind = (TwoFoldKind.INVISIBLE, TwoFoldKind.MIXED, TwoFoldKind.VISIBLE)[visible]
    return TwoFold(
        tangencies.model,
        tangencies.vector,
        tangencies.surface,
        tangencies.above,
        tangencies.below,
        float(z[0]),
        z[1:].copy(),
        (up, down),
        kind,
        dimension,
    )
