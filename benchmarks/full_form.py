"""The same orbit as a problem in all of the model's domains, one segment for each.

In the reduced form surfaces with the same field on both sides are labels. In the full form they are
joints, with one equation each. Both have the same solutions; the full form is a check, and what a
hand-assembled problem would be.
"""

from __future__ import annotations

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.system import build_system
from contfric.errors import ParameterError
from contfric.models.mode_domains import is_section
from contfric.orbit.clock import clocked
from contfric.orbit.orbit import Orbit, Status
from contfric.orbit.solve import refine
from contfric.signature import crossing


def full_form(orbit: Orbit) -> Orbit:
    """Return the orbit solved with one segment for each domain that it visits.

    Raises
    ------
    ParameterError
        If the model has resets: the full form is a check of transparent surfaces.

    Examples
    --------
    >>> import contfric as cf
    >>> full_form(cf.find_orbit("coulomb", {"Omega": 0.5})).system.segments
    6
    """
    if orbit.model.resets:
        raise ParameterError(f"model '{orbit.model.name}' has resets: there is no full form")
    whole = orbit.as_whole()
    domains = whole.signature.segments
    joints: list[FloatArray] = []
    itinerary: list[tuple[str, str]] = []
    at = 0
    for i, (mode, exit_) in enumerate(whole.itinerary):
        place = whole.cycle[i].copy()
        entry = whole.itinerary[i - 1][1]
        while True:
            joints.append(place)
            here, there = domains[at], domains[(at + 1) % len(domains)]
            surface = crossing(whole.model, here, there)
            at += 1
            if surface is None or (surface == exit_ and _last(whole, domains, at, i)):
                itinerary.append((mode, exit_))
                break
            itinerary.append((mode, surface))
            place = _crossing_point(whole, mode, surface, place, entry)
            entry = surface
    system = build_system(whole.model, tuple(itinerary), whole.periods, domains=domains)
    start = clocked(whole.model, np.array(joints), float(joints[0][0]) + whole.period)
    guess = Orbit(system, start, whole.vector.copy(), np.inf, Status.NOT_CONVERGED)
    return refine(guess, damped=False)


def _last(orbit: Orbit, domains: tuple[str, ...], at: int, i: int) -> bool:
    """Tell whether the segment of the reduced itinerary ends with the domain just passed."""
    model = orbit.model
    following = domains[at % len(domains)]
    through = crossing(model, domains[at - 1], following)
    assert through is not None
    same_mode = model.domain_by_name[following].mode == model.whole_mode(orbit.itinerary[i][0])
    return not same_mode or is_section(model, *orbit.itinerary[i])


def _crossing_point(
    orbit: Orbit, mode: str, surface: str, place: FloatArray, entry: str
) -> FloatArray:
    """Return time and state of the first crossing of a surface after a place in a mode."""
    start, observable = float(place[0]), orbit.model.surface_by_name[surface].observable
    level, on = orbit.flow.level(surface), entry == surface
    found = orbit.flow.first(mode, observable, level, start, place[1:], orbit.period, on=on)
    assert found is not None
    return np.array([start + found[0], *found[1]])
