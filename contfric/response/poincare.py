"""Return maps: of one solution on a section, and of all releases from rest."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from contfric.base.memory import must_fit
from contfric.errors import (
    ParameterError,
    did_you_mean,
    mapping_of,
    real_number,
    shown,
    whole_number,
)
from contfric.models import ModelSource, Parameters
from contfric.models.definition import FloatArray, Model
from contfric.models.tied import tied
from contfric.orbit.starts import checked_state
from contfric.orbit.structure import mirror_mode
from contfric.orbit.system import IntArray
from contfric.orbit.tables import tables
from contfric.response.collecting import collect
from contfric.response.cuts import Following, Points
from contfric.response.outcome import Outcome
from contfric.response.returns import ReleaseMap, Returns
from contfric.response.sections import RELEASES, SectionLike, section_of, usual_section
from contfric.response.sweeping import positive

#: Points without a limit, as the kernel takes them.
_ALL = np.iinfo(np.int64).max
#: Newton steps for the state at a release, from the origin; observables of friction are nearly linear.
_STEPS = 30
#: A release counts if the surfaces are met to this (relative to 1 + state).
_MET = 1e-12
#: Bytes of a release: its parameters, its events, its results.
_BYTES = 512


def poincare(
    model: ModelSource,
    params: Parameters | None = None,
    state: ArrayLike | None = None,
    *,
    section: SectionLike | None = None,
    sense: str = "either",
    time: float = 0.0,
    periods: float = 1000.0,
    transient: float = 100.0,
) -> Returns:
    """Collect the points of one solution on a section: a Poincare section and its return map.

    Parameters
    ----------
    model, params : the model (or its name) and its parameters; defaults fill in
    section : "stops", "releases", a surface of the model by its name, or a phase of the excitation as a share
        of its period; by default the stops, or phase 0 where an excited model has none, such as a structure
    sense : of a surface: "either", "rising" or "falling"
    state, time : initial condition; by default displaced from rest at time 0
    periods, transient : periods of the excitation (units of time without one) of which points are
        collected, and before that

    Raises
    ------
    ParameterError
        If an argument is not valid.

    Examples
    --------
    >>> import contfric as cf
    >>> found = cf.poincare("coulomb", {"Omega": 0.35, "S": 0.05}, section="v", periods=50)
    >>> bool(abs(found.coordinate("v")).max() < 1e-12)
    True
    """
    model, params = tied(model, params)
    section = usual_section(model) if section is None else section
    cut = section_of(model, section, sense)
    vector = model.vector(mapping_of("params", {} if params is None else params, "{'S0': 0.4}"))
    y, begins = checked_state(model, vector, state), real_number("time", time)
    skipped = real_number("transient", transient, least=0.0)
    how = Following(skipped, skipped + positive("periods", periods), 0.0, _ALL, 0)
    at, one = np.array([begins]), np.array([-1], dtype=np.int64)
    points, ends = collect(model, cut, how, vector[None], (at, y[None], one, 0 * one))
    outcome = list(Outcome)[int(ends.outcomes[0])]
    return Returns(
        model, vector, section, outcome, points.cycles, points.modes, points.times, points.states
    )


class _Release(NamedTuple):
    """A way out of rest: mode, surface, mode that follows, surfaces that it starts on as bits."""

    mode: int
    surface: int
    following: int
    on: int


def release_map(
    model: ModelSource,
    params: Parameters | None = None,
    *,
    surface: str | None = None,
    count: int = 2000,
    periods: float = 1000.0,
) -> ReleaseMap:
    """Compute the one-dimensional map from the phase of a release to that of the next one.

    Where a model of two states rests on its switching surface, all that it remembers when it is released is
    the phase of the excitation: the motion between two releases is a map of the circle. With a symmetry
    that takes one surface of release to the other, the map is that of both, reduced by it.

    Parameters
    ----------
    model, params : the model (or its name) and its parameters; defaults fill in
    surface : the surface of the release; by default the first one
    count : phases at which releases are looked for
    periods : periods within which the next release has to come

    Raises
    ------
    ParameterError
        If an argument is not valid, or releases of the model are not told by their phase.

    Examples
    --------
    >>> import contfric as cf
    >>> found = cf.release_map("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4}, count=200)
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> bool(len(found.fixed_points()) >= 1)
    True
    """
    model, params = tied(model, params)
    vector = model.vector(mapping_of("params", {} if params is None else params, "{'S0': 0.4}"))
    count = whole_number("count", count, least=2)
    must_fit(f"a map of {count} releases", _BYTES * count)
    release, rest = _release_of(model, surface)
    period = model.view(vector).period
    times: FloatArray = np.arange(count, dtype=np.float64) * (period / count)
    states: FloatArray = np.array(
        [_state_at(model, vector, release, rest, float(t)) for t in times]
    )
    possible = np.flatnonzero(
        [_leaves(model, vector, release, float(t), y) for t, y in zip(times, states, strict=True)]
    )
    times, states = times[possible], states[possible]
    cut, image = section_of(model, RELEASES), _image_of(model, release)
    cut.joints[:] = 0
    cut.joints[release.mode, release.surface] = 1
    if image is not None:
        cut.joints[image] = 1
    k = len(times)
    times, states = times.copy(), states.reshape(k, len(model.states)).copy()
    modes = np.full(k, release.following, dtype=np.int64)
    starts = times, states, modes, np.full(k, release.on, dtype=np.int64)
    how = Following(0.0, positive("periods", periods), 0.0, 1, 0)
    points, ends = collect(model, cut, how, np.tile(vector, (k, 1)), starts)
    found = np.diff(ends.upto, prepend=0) > 0
    returns, images = np.full(k, np.nan), np.full(k, np.nan)
    returns[found] = points.times + points.cycles * period - times[found]
    images[found] = np.mod(points.times + _shifts(model, vector, release, period, points), period)
    branch = _branches(ends.itineraries, times, images, 1.5 * period / count, period)
    names = model.modes[release.mode].name, model.surfaces[release.surface].name
    return ReleaseMap(model, vector, *names, period, times, images, returns, branch, states)


def _release_of(model: Model, surface: str | None) -> tuple[_Release, str]:
    """Return the way out of rest, and the surface that the mode rests on."""
    wanted = [m for m in model.modes if m.sliding]
    if model.autonomous or len(model.states) != 2 or not wanted:
        raise ParameterError(
            f"releases of '{model.name}' are not told by their phase: that takes two states, rest and a "
            "period of excitation (cf.poincare(..., section='releases') takes more)"
        )
    surfaces = [s.name for s in model.surfaces]
    ways = {
        exit_: (domain, target)
        for (domain, exit_), target in model.transitions.items()
        if model.domain_by_name[domain].mode == wanted[0].name
    }
    surface = next((name for name in surfaces if name in ways), "") if surface is None else surface
    if surface not in [*ways]:
        raise ParameterError(
            f"surface is one that rest is left at, one of {', '.join(ways)}, got {shown(surface)}"
            f"{did_you_mean(surface, ways)}"
        )
    domain, target = (model.domain_by_name[name] for name in ways[surface])
    rests = next((n for n, sign in domain.signs.items() if sign == 0), surface)
    mode, k, found = model.mode_index[domain.mode], model.surface_index[surface], tables(model)
    on = int(found.landed[k] | (found.lies_on[mode] & found.kept[k]))
    return _Release(mode, k, model.mode_index[target.mode], on), rests


def _image_of(model: Model, release: _Release) -> tuple[int, int] | None:
    """Return (mode, surface) of the image of a release under the symmetry; None if there is no other."""
    if model.symmetry is None:
        return None
    name = model.surfaces[release.surface].name
    image = model.symmetry.surfaces.get(name, name)
    mode = mirror_mode(model)[model.modes[release.mode].name]
    if image == name:
        return None
    return model.mode_index[mode], model.surface_index[image]


def _gap(
    model: Model, vector: FloatArray, surface: int, t: float, y: FloatArray
) -> tuple[float, FloatArray]:
    """Return how far a state is from a surface, and its derivatives with respect to the state."""
    flow, there = model.view(vector), model.surfaces[surface]
    return flow.height(there.name, t, y), flow.gradient(there.observable, t, y)[1:]


def _state_at(
    model: Model, vector: FloatArray, release: _Release, rests: str, t: float
) -> FloatArray:
    """Return the state at a release at a time: on both surfaces, by Newton's method; nan if there is none."""
    y = np.zeros(len(model.states))
    pair = release.surface, model.surface_index[rests]
    for _ in range(_STEPS):
        gaps = [_gap(model, vector, k, t, y) for k in pair]
        missed, slopes = np.array([g[0] for g in gaps]), np.array([g[1] for g in gaps])
        if np.max(np.abs(missed)) <= _MET * (1.0 + np.max(np.abs(y))):
            return y
        try:
            y = y - np.linalg.solve(slopes, missed)
        except np.linalg.LinAlgError:
            break
    return np.full(len(y), np.nan)


def _leaves(model: Model, vector: FloatArray, release: _Release, t: float, y: FloatArray) -> bool:
    """Tell whether rest comes to its limit there, from within."""
    if not np.all(np.isfinite(y)):
        return False
    surface = model.surfaces[release.surface]
    domain = next(d for d in model.domains if d.mode == model.modes[release.mode].name)
    rate = model.view(vector).rate(domain.mode, surface.observable, t, y)
    return -domain.signs[surface.name] * rate > 0.0


def _shifts(
    model: Model, vector: FloatArray, release: _Release, period: float, points: Points
) -> FloatArray:
    """Return the shift in time of each point: none at the surface itself, that of the symmetry elsewhere."""
    if model.symmetry is None:
        return np.zeros(len(points.times))
    rows = zip(points.times.tolist(), points.states, strict=True)
    apart = [abs(_gap(model, vector, release.surface, t, y)[0]) for t, y in rows]
    image = _image_of(model, release)
    if image is None:
        return np.zeros(len(points.times))
    rows = zip(points.times.tolist(), points.states, strict=True)
    other = [abs(_gap(model, vector, image[1], t, y)[0]) for t, y in rows]
    return np.where(np.array(apart) <= np.array(other), 0.0, model.symmetry.fraction * period)


def _branches(
    itineraries: IntArray, phases: FloatArray, images: FloatArray, step: float, period: float
) -> IntArray:
    """Return the number of the branch of each release: it ends where the itinerary, or the grid, does."""
    branch = np.full(len(itineraries), -1, dtype=np.int64)
    number = -1
    for k in range(len(itineraries)):
        if not np.isfinite(images[k]):
            continue
        joined = (
            k > 0
            and branch[k - 1] >= 0
            and itineraries[k] == itineraries[k - 1]
            and phases[k] - phases[k - 1] <= step
            and abs(images[k] - images[k - 1]) <= 0.5 * period
        )
        number += 0 if joined else 1
        branch[k] = number
    return branch
