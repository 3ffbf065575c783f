"""How motion leaves a surface that it slides on, at sampled states."""

from __future__ import annotations

import itertools
import random
from collections import Counter
from collections.abc import Mapping, Sequence

from contfric.models.definition import Domain, Surface
from contfric.models.description import Description
from contfric.models.evaluate import Sampler

#: A rate this small, at a place that Newton's method found, is zero.
_STILL = 1e-7
#: Places at which a verdict is asked for: what a single one says may be an accident.
_PLACES, _TRIES = 6, 60
#: States at which motion enters a mode that holds on both sides of where it does: of 40, one of a class of a
#: tenth is missed in one of 70 models. From how many random states these are sought.
_ENTERED, _STARTS = 40, 400


def departing_side(
    sampler: Sampler, beside: Mapping[int, str], surface: str, sides: Mapping[str, int]
) -> int:
    """Return the side that motion on a surface leaves to in a region, 0 if that is not clear.

    If one mode holds on both sides motion goes on in it, whichever side it leaves to: most states tell.

    Parameters
    ----------
    beside : the mode on each side, by +1 and -1
    """
    verdicts = Counter[int]()
    # 12 states: what a single one says may be an accident of the region's edge
    for t, y in sampler.on(surface, sides, 12):
        away = [
            side
            for side, mode in beside.items()
            if side * sampler.rate(mode, surface, side, t, y) > 0.0
        ]
        verdicts[away[0] if len(away) == 1 else 0] += 1
    if len(beside) == 2 and len(set(beside.values())) == 1 and (verdicts[1] or verdicts[-1]):
        return max((1, -1), key=verdicts.__getitem__)
    return next(iter(verdicts)) if len(verdicts) == 1 else 0


def turned_modes(
    sampler: Sampler, surfaces: Sequence[Surface], domains: Sequence[Domain]
) -> tuple[frozenset[tuple[str, str]], frozenset[tuple[str, str]]]:
    """Return pairs (mode, surface): motion that enters the mode at the surface goes back to its own side.

    That can only be where the mode holds on both sides of it: modes overlap there. The second pairs are
    those of which it goes back from some states only, as a ship does that turns when its rudder is held.
    """
    place = {(d.mode, *d.signs.items()) for d in domains}
    at: dict[tuple[tuple[str, int], ...], list[Domain]] = {}
    for domain in domains:
        at.setdefault(tuple(domain.signs.items()), []).append(domain)
    pairs = [pair for same in at.values() for pair in itertools.permutations(same, 2)]
    found: dict[tuple[str, str], set[bool]] = {}
    for surface, (here, there) in itertools.product([s.name for s in surfaces], pairs):
        side, beyond = here.signs[surface], {**here.signs, surface: -here.signs[surface]}
        overlap = there.mode != here.mode and side
        if not overlap or (there.mode, *beyond.items()) not in place:
            continue
        if (here.mode, *beyond.items()) in place:
            continue  # nothing happens there
        verdicts = found.setdefault((there.mode, surface), set())
        others = {name: sign for name, sign in here.signs.items() if name != surface}
        met = (
            point
            for point in sampler.on(surface, others, _STARTS, _STARTS)
            if side * sampler.rate(here.mode, surface, side, *point) < 0.0
        )
        for t, y in itertools.islice(met, 0 if len(verdicts) == 2 else _ENTERED):
            verdicts.add(side * sampler.rate(there.mode, surface, side, t, y) > 0.0)
            if len(verdicts) == 2:
                break
    always, at_times = (
        frozenset(pair for pair, verdicts in found.items() if verdicts == wanted)
        for wanted in ({True}, {True, False})
    )
    return always, at_times


def leaves_at_rest(sampler: Sampler, description: Description, domains: tuple[Domain, ...]) -> bool:
    """Return whether every sliding mode is left without acceleration: the flow then never jumps.

    That is so where the limit under which a mode slides is the very place at which the field next to it
    turns around (static and kinetic limits agree); it must be so for other parameters, too.
    """
    under = {
        domain.mode: [n for n, side in domain.signs.items() if side == 0] for domain in domains
    }
    pairs = {
        (under[mode.name][0], limit)
        for mode in description.modes
        for limit, side in mode.sides.items()
        if side != 0 and len(under.get(mode.name, ())) == 1
    }
    at = {tuple(sorted(d.signs.items())): d for d in domains}
    found = False
    for on, limit in sorted(pairs):
        verdicts = _left_at_rest(sampler, on, limit, at)
        if False in verdicts:  # one place decides
            return False
        found = found or bool(verdicts)
    return found


def _left_at_rest(
    sampler: Sampler, on: str, limit: str, at: Mapping[tuple[tuple[str, int], ...], Domain]
) -> set[bool]:
    """Return whether rest on a surface is left without acceleration, at places where its limit is met."""
    found: set[bool] = set()
    names = [name for name, _ in next(iter(at))]
    for other in (sampler, _moved(sampler)):
        places = 0
        for t, y in other.states(_TRIES):
            place = _on_both(other, on, limit, t, y)
            if place is None:
                continue
            signs = {**other.sides(*place, names), on: 0}
            beside = _beside_limit(at, signs, on, limit)
            if not beside:
                continue
            rates = [other.rate(d.mode, on, d.signs[on], *place) for d in beside]
            found.add(min(abs(rate) for rate in rates) <= _STILL)
            places += 1
            if False in found:
                return found
            if places == _PLACES:
                break
    return found


def _on_both(
    sampler: Sampler, on: str, limit: str, t: float, y: Sequence[float]
) -> tuple[float, Sequence[float]] | None:
    """Return a place on two surfaces, near a state; None if none is found."""
    place: tuple[float, Sequence[float]] | None = sampler.landed(on, t, y)
    for _ in range(20):  # one after the other, until both surfaces are met
        if place is None or sampler.sides(*place, (on, limit)) == {on: 0, limit: 0}:
            return place
        second = sampler.landed(limit, *place)
        place = second and sampler.landed(on, *second)
    return None


def _beside_limit(
    at: Mapping[tuple[tuple[str, int], ...], Domain], signs: Mapping[str, int], on: str, limit: str
) -> list[Domain]:
    """Return the domains next to a rest, beyond its limit; none where there is no rest within the limit."""
    found = []
    for side in (1, -1):  # of the limit, within which there is rest
        rest = at.get(tuple(sorted({**signs, limit: side}.items())))
        slides_on = any(tuple(sorted({**signs, limit: s}.items())) in at for s in (0, -side))
        if rest is not None and rest.signs[on] == 0 and not slides_on:
            beyond = [
                at.get(tuple(sorted({**signs, limit: -side, on: s}.items()))) for s in (1, -1)
            ]
            found += [d for d in beyond if d is not None]
    return found


def _moved(sampler: Sampler) -> Sampler:
    """Return the sampler at other parameters, each moved by its own share."""
    draw = random.Random(sampler.seed)
    params = {name: value * (1.0 + 0.2 * draw.random()) for name, value in sampler.params.items()}
    return Sampler(sampler.evaluator, params, sampler.seed)
