"""All equilibria of a model at some parameters."""

from __future__ import annotations

import math

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.equilibria.newton import Zeros
from contfric.equilibria.regions import ModeRegion, check_no_excitation, regions_of, scale_of
from contfric.equilibria.result import (
    ComplexArray,
    Equilibria,
    Equilibrium,
    EquilibriumSet,
    Location,
)
from contfric.equilibria.sets import followed, holds_state, set_of_plane, sets_of_line
from contfric.errors import whole_number
from contfric.models import ModelSource, Parameters
from contfric.models.definition import Model
from contfric.models.tied import tied

#: Two zeros nearer than this, in natural sizes of the states, are one.
_SAME = 1e-7


def find_equilibria(
    model: ModelSource, params: Parameters | None = None, *, starts: int = 200, seed: int = 0
) -> Equilibria:
    """Find all equilibria of a model without excitation, and its pseudo-equilibria on surfaces.

    Where a mode is affine, they are the solution of a linear system, and all of them. Elsewhere Newton's
    method starts from random states within twice the model's ``spread``, and some farther away.

    Parameters
    ----------
    params : mapping, optional
        Parameters; defaults fill in. A model that is excited has to have its excitation switched off by them.
    starts : int
        Starts of Newton's method in each mode that is not affine.
    seed : int
        Seed of the starts.

    Returns
    -------
    Equilibria
        ``for e in found`` goes through those that are admissible; ``found.points`` has virtual ones too,
        ``found.sets`` whole sets (a mass that sticks), ``found.complete`` says which modes are known
        completely.

    Raises
    ------
    ParameterError
        If the model is excited, or is not declared by formulas.

    Examples
    --------
    >>> import contfric as cf
    >>> cf.find_equilibria("belt", {"vb": 0.5})[0].state.round(9).tolist()
    [0.4, 0.0]
    """
    model, params = tied(model, params)
    starts, seed = whole_number("starts", starts, least=1), whole_number("seed", seed, least=0)
    checked = model.check_params(params)
    regions = regions_of(model)
    check_no_excitation(model, checked)
    vector = model.vector(checked)
    points: list[Equilibrium] = []
    sets: list[EquilibriumSet] = []
    complete: dict[str, bool] = {}
    for region in regions:
        complete[region.mode] = complete.get(region.mode, True) and region.fields.affine
        own, wide = _of_region(Zeros(region, vector, scale_of(model, vector)), starts, seed)
        points += own
        sets += wide
    scale = scale_of(model, vector)
    kept = [
        e
        for e in points
        if e.location is not Location.BOUNDARY
        or not any(holds_state(s, e.state, scale) for s in sets)
    ]
    return Equilibria(model, vector, tuple(kept), tuple(sets), complete)


def _of_region(
    zeros: Zeros, starts: int, seed: int
) -> tuple[list[Equilibrium], list[EquilibriumSet]]:
    """Return the equilibria of one region, and its sets of them."""
    if zeros.region.fields.affine:
        found = zeros.affine()
        if found is None:
            return [], []
        y, directions = found
        if len(directions) == 0:
            return [equilibrium_at(zeros.region, y, zeros.p)], []
        if len(directions) == 1:
            return [], sets_of_line(zeros, y, directions[0])
        plane = set_of_plane(zeros, y, directions)
        return [], [] if plane is None else [plane]
    states: list[FloatArray] = []
    sets: list[EquilibriumSet] = []
    for y in zeros.from_starts(starts, seed):
        wound = _unwound(zeros.region.model, y)
        if any(np.max(np.abs((wound - other) / zeros.scale)) < _SAME for other in states):
            continue
        directions = zeros.null_space(wound)
        if len(directions) == 1 and _goes_on(zeros, wound, directions[0]):
            if not any(holds_state(s, wound, zeros.scale) for s in sets):
                wide = followed(zeros, wound, directions[0])
                sets += [] if wide is None else [wide]
            continue
        states.append(wound)
    states.sort(key=lambda y: y.tolist())
    return [equilibrium_at(zeros.region, y, zeros.p) for y in states], sets


def _goes_on(zeros: Zeros, y: FloatArray, direction: FloatArray) -> bool:
    """Tell whether there is another zero near a singular one: a whole set of them, not a fold."""
    length = 1e-3 * float(np.min(zeros.scale))
    nearby = zeros.newton(y + length * direction)
    return nearby is not None and float((nearby - y) @ direction) > 0.5 * length


def _unwound(model: Model, y: FloatArray) -> FloatArray:
    """Return a state with its angles in (-pi, pi]."""
    found = y.copy()
    for reset in model.resets:
        if reset.wraps:
            k = model.states.index(model.surface_by_name[reset.surface].observable)
            found[k] = math.pi - (math.pi - found[k]) % (2.0 * math.pi)
    return found


def equilibrium_at(
    region: ModeRegion, y: FloatArray, p: FloatArray, known: ComplexArray | None = None
) -> Equilibrium:
    """Return a zero of a region's field as a result: where it lies, and its eigenvalues if not known."""
    _, wrong = region.domain_of(y, p)
    location = Location.VIRTUAL if wrong else Location.ADMISSIBLE
    if not wrong and region.touched(y, p):
        location = Location.BOUNDARY
    own = region.fields.eigenvalues(y, p) if known is None else known
    return Equilibrium(region, p, y, own, location, wrong)
