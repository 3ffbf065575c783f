"""The signature of an orbit, from its solved segments: domains, holds and impacts in order."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

from contfric.base.arrays import FloatArray
from contfric.bvp.crossed_surfaces import crossed_by
from contfric.bvp.holds import holds_of
from contfric.models.definition import Domain, Model
from contfric.models.mode_domains import mode_domains
from contfric.orbit.itinerary.itineraries import decode, end_domain, passed_domains
from contfric.signature import Signature
from contfric.signature.holds import domains_after, is_hold
from contfric.signature.impacts import impact_at, mirror_name
from contfric.simulation.starts import signs_at

if TYPE_CHECKING:
    from contfric.base.arrays import IntArray
    from contfric.orbit.orbit import Orbit

#: Share of a segment that is looked ahead.
_AHEAD = 1e-3


def read_signature(orbit: Orbit, labels: IntArray) -> Signature:
    """Return the signature of an orbit.

    Parameters
    ----------
    labels : the transparent surfaces that its segments cross, as the engine codes them
    """
    model, system = orbit.model, orbit.system
    names = system.domains or _domains(orbit, labels)  # in full form each segment is one of them
    return _called(model, tuple(names), orbit.periods, orbit.symmetric)


@lru_cache(maxsize=1024)
def _called(model: Model, names: tuple[str, ...], periods: int, symmetric: bool) -> Signature:
    """Return a signature with its name: orbits of one diagram, or of many, share few of them."""
    plain = Signature(model, names, periods, symmetric=symmetric)
    return replace(plain, name=plain.auto_name(symmetric))


def segment_domains(orbit: Orbit, labels: IntArray) -> list[list[str]]:
    """Return the domains that each segment of the whole orbit passes, in order.

    Those of a hold are the domain that it rests in.
    """
    model, system = orbit.model, orbit.system
    if system.domains:  # in full form each segment is one of them
        found = [[name] for name in system.domains]
    else:
        found = _paths(orbit, labels)
    if system.half:
        found += [[model.mirror_domain[d] for d in own] for own in found]
    return [[model.shown(d) for d in own] for own in found]


def _paths(orbit: Orbit, labels: IntArray) -> list[list[str]]:
    """Domains of each segment of one turn."""
    model, system = orbit.model, orbit.system
    surfaces = [s.name for s in model.surfaces]
    ends, itinerary = _end_domains(orbit), orbit.itinerary
    crossed: list[list[str]] = [[] for _ in system.itinerary]
    for row, code in zip(system.layout.labels, labels, strict=True):
        crossed[row[0]] += decode(int(code), surfaces) if code >= 0 else crossed_by(orbit, *row[:2])
    return [
        [ends[i]]
        if is_hold(itinerary[i][1])
        else passed_domains(model, _start_domain(orbit, i, ends), ends[i], passed)
        for i, passed in enumerate(crossed)
    ]


def _domains(orbit: Orbit, labels: IntArray) -> list[str]:
    """Domains of the whole orbit, with its holds and impacts between them."""
    model, system = orbit.model, orbit.system
    domains: list[str] = []
    for path, (mode, exit_) in zip(_paths(orbit, labels), system.itinerary, strict=True):
        domains += [exit_] if is_hold(exit_) else path
        if model.reset_at(mode, exit_) is not None:
            domains.append(impact_at(model, exit_))
    if system.half:
        assert model.symmetry is not None
        image = ChainMap(model.mirror_domain, dict(model.symmetry.surfaces))
        domains += [mirror_name(d, image) for d in domains]
    return model.without_phase(domains)


def _start_domain(orbit: Orbit, i: int, ends: list[str]) -> str:
    """Domain in which a segment of the whole orbit begins."""
    model, itinerary = orbit.model, orbit.itinerary
    mode, entry = itinerary[i - 1]  # of the whole itinerary: its last exit leads into the first
    if model.composed:
        return itinerary[i][0]
    if (
        mode in model.chatter_by_mode
    ):  # at rest on a wall no side of a section is told: look a little ahead
        own = [model.domain_by_name[d] for d in mode_domains(model, itinerary[i][0])]
        return _nearest(own, _signs_ahead(orbit, i, model.surface_by_name))
    reset = model.reset_at(mode, entry)
    if reset is None and not is_hold(entry):
        return model.transitions[ends[i - 1], entry]
    begin = orbit.begins[i]
    signs = _signs_at(orbit, float(begin[0]), begin[1:].copy())
    if reset is not None:
        before = model.domain_by_name[ends[i - 1]].signs
        slid = [s for s, v in before.items() if v == 0 and not model.changed_by(reset, s)]
        signs |= _signs_ahead(orbit, i, slid)
    if is_hold(entry):
        after = [model.domain_by_name[d] for d in domains_after(model, mode, itinerary[i][0])]
        return _nearest(after, signs)
    for surface in () if reset is None else reset.lands:
        del signs[surface]  # the joint lies on it to rounding; the transition says the side
    own = [model.domain_by_name[d] for d in mode_domains(model, itinerary[i][0])]
    led = model.targets.get(
        (ends[i - 1], entry), ()
    )  # a surface met at the impact is on either side
    own = [d for d in own if d.name in led] or own
    return _nearest(own, signs)


def _signs_ahead(orbit: Orbit, i: int, surfaces: Collection[str]) -> dict[str, int]:
    """Return the sides of surfaces soon after segment i begins on them."""
    if not surfaces:
        return {}
    begin = orbit.begins[i]
    ahead = _AHEAD * float(orbit.ends[i][0] - begin[0])
    mode, view = orbit.itinerary[i][0], orbit.model.view(orbit.vector)
    state = view.state(mode, float(begin[0]), begin[1:].copy(), ahead)
    signs = _signs_at(orbit, float(begin[0] + ahead), state)
    return {surface: signs[surface] for surface in surfaces}


def _signs_at(orbit: Orbit, time: float, state: FloatArray) -> dict[str, int]:
    """Return the sides of a joint that is on no section; the first side of the phase stands for it."""
    signs = signs_at(orbit.model, time, state, orbit.vector)
    return {**signs, orbit.model.phase: 1} if orbit.model.phase else signs


def _nearest(domains: Sequence[Domain], signs: Mapping[str, int]) -> str:
    """Return the domain that fits the sides of a state best; on a surface to rounding none fits for sure."""
    return min(domains, key=lambda d: sum(d.signs[s] * sign < 0 for s, sign in signs.items())).name


def _end_domains(orbit: Orbit) -> list[str]:
    """Domain in which each segment of the whole orbit ends."""
    found, itinerary, model = [], orbit.itinerary, orbit.model
    held = {hold.segment: hold for hold in holds_of(model, itinerary)}
    for i, (mode, exit_) in enumerate(itinerary):
        end = orbit.ends[i]
        signs = _signs_at(orbit, float(end[0]), end[1:].copy())
        after = itinerary[(i + 1) % len(itinerary)][0]
        if is_hold(exit_):
            found.append(mode_domains(model, mode)[0])
            continue
        hold = held.get(i + 1)
        if hold is not None and (mode == after or hold.pin is not None):  # it leads beyond the hold
            after = hold.departs
        found.append(end_domain(model, mode, exit_, after, signs))
    return found
