"""How motion leaves a surface that it slides on, at sampled states."""

from __future__ import annotations

import itertools
import random
from collections.abc import Mapping, Sequence

from contfric.models.definition import Domain, Surface
from contfric.models.description import Description
from contfric.models.evaluate import Sampler

#: A time and a state.
Place = tuple[float, list[float]]

#: A rate this small, at a place that Newton's method found, is zero.
_STILL = 1e-7
#: Places at which a verdict is asked for: what a single one says may be an accident.
_PLACES, _TRIES = 6, 60


def departing_side(
    sampler: Sampler, beside: Mapping[int, str], surface: str, sides: Mapping[str, int]
) -> int:
    """Return the side that motion on a surface leaves to in a region, 0 if that is not clear.

    Parameters
    ----------
    beside : the mode on each side, by +1 and -1
    """
    verdicts = set()
    # 12 states: what a single one says may be an accident of the region's edge
    for t, y in sampler.on(surface, sides, 12):
        away = [
            side
            for side, mode in beside.items()
            if side * sampler.rate(mode, surface, side, t, y) > 0.0
        ]
        verdicts.add(away[0] if len(away) == 1 else 0)
    return verdicts.pop() if len(verdicts) == 1 else 0


def turned_modes(
    sampler: Sampler, surfaces: Sequence[Surface], domains: Sequence[Domain]
) -> frozenset[tuple[str, str]]:
    """Return pairs (mode, surface): motion that enters the mode at the surface goes back to its own side.

    That can only be where the mode holds on both sides of it: modes overlap there.
    """
    if len({tuple(d.signs.items()) for d in domains}) == len(domains):
        return frozenset()  # no modes overlap
    place = {(d.mode, *d.signs.items()) for d in domains}
    found: dict[tuple[str, str], set[bool]] = {}
    for surface, here, there in itertools.product([s.name for s in surfaces], domains, domains):
        side, beyond = here.signs[surface], {**here.signs, surface: -here.signs[surface]}
        overlap = there.signs == here.signs and there.mode != here.mode and side
        if not overlap or (there.mode, *beyond.items()) not in place:
            continue
        if (here.mode, *beyond.items()) in place:
            continue  # nothing happens there
        others = {name: sign for name, sign in here.signs.items() if name != surface}
        for t, y in sampler.on(surface, others, _PLACES):
            if side * sampler.rate(here.mode, surface, side, t, y) < 0.0:
                back = side * sampler.rate(there.mode, surface, side, t, y) > 0.0
                found.setdefault((there.mode, surface), set()).add(back)
    return frozenset(pair for pair, verdicts in found.items() if verdicts == {True})


def leaves_at_rest(sampler: Sampler, description: Description, domains: tuple[Domain, ...]) -> bool:
    """Return whether every sliding mode is left without acceleration: the flow then never jumps.

    That is so where the limit under which a mode slides is the very place at which the field beside it
    turns around (static and kinetic limits agree); it must be so for other parameters, too.
    """
    found, places = False, _Places((sampler, _moved(sampler)))
    for domain in domains:
        on = [name for name, side in domain.signs.items() if side == 0]
        limits = {
            name
            for mode in description.modes
            if mode.name == domain.mode
            for name, side in mode.sides.items()
            if side != 0
        }
        for limit in limits if len(on) == 1 else ():
            beyond = [{**domain.signs, limit: side} for side in (0, -domain.signs[limit])]
            if any(d.signs in beyond for d in domains):
                continue  # it goes on sliding there
            verdicts = _left_at_rest(places, domain, on[0], limit, domains)
            if False in verdicts:  # one place decides: of many contacts there are many domains
                return False
            found = found or bool(verdicts)
    return found


class _Places:
    """Places where two surfaces meet, near sampled states, with the sides of others, for all domains."""

    def __init__(self, samplers: Sequence[Sampler]) -> None:
        self.samplers = samplers
        self._known: dict[tuple[int, str, str], list[tuple[Place, dict[str, int]]]] = {}

    def at(self, k: int, on: str, limit: str) -> list[tuple[Place, dict[str, int]]]:
        """Return those of one sampler."""
        if (k, on, limit) not in self._known:
            sampler, found = self.samplers[k], []
            names = [s.name for s in sampler.evaluator.description.surfaces]
            for t, y in sampler.states(_TRIES):
                place = sampler.landed(on, t, y)
                for _ in range(20):  # one after the other, until both surfaces are met
                    second = place and sampler.landed(limit, *place)
                    place = second and sampler.landed(on, *second)
                    if place is None or place == second:  # at right angles: met at once
                        break
                sides = {} if place is None else sampler.sides(*place, names)
                if place is not None and sides[on] == sides[limit] == 0:
                    found.append((place, sides))
            self._known[k, on, limit] = found
        return self._known[k, on, limit]


def _left_at_rest(
    places: _Places, domain: Domain, on: str, limit: str, domains: tuple[Domain, ...]
) -> set[bool]:
    beyond = {**domain.signs, limit: -domain.signs[limit]}
    beside = [d for d in domains if d.signs[on] != 0 and {**d.signs, on: 0} == beyond]
    found: set[bool] = set()
    rest = {k: v for k, v in domain.signs.items() if k not in (on, limit)}
    for k, sampler in enumerate(places.samplers if beside else ()):
        fits = [at for at, sides in places.at(k, on, limit) if rest.items() <= sides.items()]
        for place in fits[:_PLACES]:
            rates = [sampler.rate(d.mode, on, d.signs[on], *place) for d in beside]
            found.add(min(abs(rate) for rate in rates) <= _STILL)
            if False in found:
                return found
    return found


def _moved(sampler: Sampler) -> Sampler:
    """Return the sampler at other parameters, each moved by its own share."""
    draw = random.Random(sampler.seed)
    params = {name: value * (1.0 + 0.2 * draw.random()) for name, value in sampler.params.items()}
    return Sampler(sampler.evaluator, params, sampler.seed)
