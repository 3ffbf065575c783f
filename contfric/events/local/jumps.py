"""Tests whether rest is left with an acceleration; if not, nothing jumps (Filippov's case).

Some models have no such acceleration (:attr:`contfric.models.definition.Model.filippov`). Others have none
at some of their parameters: where the static limit equals the kinetic one (S0 = S) there is no load at which
a mass may either stay or leave. Then nothing can be held, and the solution is continuous at CS, SS, AS, GS.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache, lru_cache

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.models.definition import Model
from contfric.models.mode_domains import mode_domains
from contfric.orbit.orbit import Orbit
from contfric.signature.holds import ends_rest, left_surface, release_mode

#: An acceleration this small, as a share of the largest at the joints of an orbit, is rounding: limits that
#: are equal differ by 1e-16, and the flow's derivatives are known to 1e-14.
_ROUNDING = 1e-12
#: Joints of an orbit that are moved to a limit: what a single one says may be an accident.
_JOINTS = 6
#: Steps of Newton's method for a state at the limit: a load is linear in the state in nearly every model.
_STEPS = 5
#: A state that is this near to its surfaces, relative to their levels, lies on them.
_MET = 1e-12


@lru_cache(maxsize=8)  # several questions are asked of one orbit
def nothing_jumps(orbit: Orbit) -> bool:
    """Tell whether rest is left without acceleration wherever it ends, at the parameters of an orbit."""
    model = orbit.model
    if model.filippov or model.composed:
        return model.filippov
    limits = _limits(model)
    return bool(limits) and all(
        _left_without(orbit, met, departures) for met, departures in limits.items()
    )


@cache
def _limits(model: Model) -> Mapping[tuple[str, str], tuple[tuple[str, str], ...]]:
    """Return where rests end: the surface that is left and the limit, with modes and those they are left to.

    What another contact or a clock meets meanwhile ends no rest, as what it moves on afterwards tells.
    """
    found: dict[tuple[str, str], dict[str, str]] = {}
    for domain in model.domains:
        mode = domain.mode
        for limit, _ in model.exits_of(domain.name) if model.mode_by_name[mode].sliding else ():
            departs = release_mode(model, mode, limit) if ends_rest(model, mode, limit) else None
            if departs is None:
                continue
            leaves = left_surface(model, mode, departs)
            if not model.lies_on(departs, leaves):
                found.setdefault((leaves, limit), {})[departs] = mode
    return {
        met: tuple((mode, departs) for departs, mode in pairs.items())
        for met, pairs in found.items()
    }


def _left_without(
    orbit: Orbit, met: tuple[str, str], departures: tuple[tuple[str, str], ...]
) -> bool:
    """Tell whether rests are left without acceleration where a load is at its limit."""
    cycle = orbit.cycle
    chosen = cycle[np.linspace(0, len(cycle) - 1, min(_JOINTS, len(cycle))).astype(int)]
    scale = {
        pair: max(abs(leaving_rate(orbit, *pair, joint)) for joint in chosen) for pair in departures
    }
    asked = False
    for there in (_moved(orbit, joint, met) for joint in chosen):
        if there is None:
            continue
        if any(
            abs(leaving_rate(orbit, *pair, there)) > _ROUNDING * scale[pair] for pair in departures
        ):
            return False
        asked = True
    return asked


def _moved(orbit: Orbit, joint: FloatArray, surfaces: tuple[str, ...]) -> FloatArray | None:
    """Return the nearest joint at the same time that lies on surfaces; None if Newton's method finds none."""
    flow, time, state = orbit.flow, float(joint[0]), joint[1:].copy()
    names = [orbit.model.surface_by_name[s].observable for s in surfaces]
    levels = np.array([flow.level(s) for s in surfaces])
    for _ in range(_STEPS):
        over = np.array([flow.observe(name, time, state) for name in names]) - levels
        if float(np.max(np.abs(over))) <= _MET * float(np.max(np.abs(levels), initial=1.0)):
            return np.concatenate([[time], state])
        slopes = np.array([flow.gradient(name, time, state)[1 : len(joint)] for name in names])
        state -= np.linalg.lstsq(slopes, over, rcond=None)[0]
    return None


def left_to(orbit: Orbit, mode: str, departs: str) -> tuple[int, str]:
    """Return the side to which a rest is left into a departing mode, and the observable that tells."""
    model = orbit.model
    leaves = left_surface(model, mode, departs)
    sign = model.domain_by_name[mode_domains(model, departs)[0]].signs[leaves]
    return sign, model.surface_by_name[leaves].observable


def leaving_rate(orbit: Orbit, mode: str, departs: str, joint: FloatArray) -> float:
    """Return the acceleration with which a mode of rest is left into a departing mode at a joint."""
    sign, observable = left_to(orbit, mode, departs)
    return sign * orbit.flow.rate(departs, observable, float(joint[0]), joint[1:])
