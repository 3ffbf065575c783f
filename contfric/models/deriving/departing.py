"""How motion leaves a surface that it slides on, at sampled states."""

from __future__ import annotations

import itertools
import random
from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from contfric.models.definition import Domain, Surface
from contfric.models.described.description import Description
from contfric.models.described.evaluate import Sampler
from contfric.models.described.regions import is_possible
from contfric.models.parts import Departure

#: A rate this small, at a place that Newton's method found, is zero.
_STILL = 1e-7
#: Places at which a verdict is asked for: what a single one says may be an accident.
_PLACES, _TRIES = 6, 60
#: States at which motion enters a mode that holds on both sides of where it does: of 40, one of a class of a
#: tenth is missed in one of 70 models. From how many random states these are sought.
_ENTERED, _STARTS = 40, 400
#: Steps of Newton's method for a place on two surfaces: as many as double digits take from one to all.
_STEPS = 10


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


def other_departures(
    sampler: Sampler,
    domains: Sequence[Domain],
    modes_at: Mapping[tuple[int, ...], str],
    found: Sequence[Departure],
) -> tuple[Departure, ...]:
    """Return how a surface is passed between modes that do not slide there, though others do.

    Sliding between one mode above a surface and one below it has limits; between two other modes, behind a
    surface that divides a side, on which side of these limits a state is does not matter. There the fields
    tell, where departures that are found say something else.

    Parameters
    ----------
    modes_at : the mode at each combination of sides
    found : departures beyond the limits of sliding
    """
    slides = [(on, d) for d in domains for on, side in d.signs.items() if side == 0]

    def pair_at(on: str, signs: Mapping[str, int]) -> dict[int, str]:
        keys = {side: tuple({**signs, on: side}.values()) for side in (1, -1)}
        return {side: modes_at[key] for side, key in keys.items() if key in modes_at}

    sliding = [(on, pair_at(on, domain.signs)) for on, domain in slides]
    more: dict[tuple[int, ...], Departure] = {}
    for on, domain in itertools.product(dict.fromkeys(on for on, _ in slides), domains):
        signs = {**domain.signs, on: 0}
        key, pair = tuple(signs.values()), pair_at(on, signs)
        if key in modes_at or key in more or len({*pair.values()}) < 2 or (on, pair) in sliding:
            continue
        side = departing_side(sampler, pair, on, signs)
        first = next((d for d in found if _holds(d, signs)), None)
        if side and (first is None or first.leaves != {on: side}):
            more[key] = Departure(signs, {on: side})
    return tuple(more.values())


def limit_departures(
    sampler: Sampler,
    surfaces: list[Surface],
    domains: Sequence[Domain],
    found: Sequence[Departure],
) -> tuple[Departure, ...]:
    """Return how sliding is left at its own limits, where departures that are found say something else.

    Each of several sliding modes on one surface has limits of its own, and on which side of the limits of
    another one a state is does not matter to it. So what was found beyond a surface between them (a wall that
    a slider touches) does not tell where a limit is passed; and beyond a limit no random state may lie. At
    the limit itself it is seen where motion goes (:func:`_limit_side`).
    """
    modes = {tuple(sorted(d.signs.items())): d.mode for d in domains}
    own: dict[str, list[Domain]] = {}
    for domain in domains:
        own.setdefault(domain.mode, []).append(domain)
    limits = []
    for parts in own.values():
        known = {n: v for n, v in parts[0].signs.items() if all(d.signs[n] == v for d in parts)}
        on = [name for name, side in known.items() if side == 0]
        for limit in [name for name, side in known.items() if side and len(on) == 1]:
            through = {on[0]: 0, limit: -known[limit]}
            regions = [{**d.signs, **through} for d in parts]
            regions = [signs for signs in regions if is_possible(surfaces, signs)]
            if any(tuple(sorted(signs.items())) in modes for signs in regions):
                continue  # another mode slides on
            first = [next((d for d in found if _holds(d, signs)), None) for signs in regions]
            if all(d is not None and d.where == through for d in first):
                continue  # they were asked of this limit
            apart = [_mode_at(modes, regions, on[0], side) for side in (1, -1)]
            # where other surfaces divide the modes at its sides, each region is asked
            for asked in [known] if all(apart) else regions:
                beyond = {**asked, **through}
                inside = {**beyond, limit: known[limit]}
                pair = (
                    apart if all(apart) else [_mode_at(modes, [beyond], on[0], s) for s in (1, -1)]
                )
                left = _limit_side(sampler, inside, (on[0], limit), pair)
                if left and any(d is None or d.leaves != {on[0]: left} for d in first):
                    limits.append(Departure(beyond, {on[0]: left}))
    return tuple(limits)


def _holds(departure: Departure, signs: Mapping[str, int]) -> bool:
    return all(signs[name] == side for name, side in departure.where.items())


def _mode_at(
    modes: Mapping[tuple[tuple[str, int], ...], str],
    regions: Sequence[Mapping[str, int]],
    on: str,
    side: int,
) -> str:
    """Return the mode on one side of a surface in some regions; nothing if it is not one."""
    found = {modes.get(tuple(sorted({**signs, on: side}.items())), "") for signs in regions}
    return found.pop() if len(found) == 1 else ""


def _limit_side(
    sampler: Sampler, known: Mapping[str, int], pair: tuple[str, str], apart: Sequence[str]
) -> int:
    """Return the side that sliding on a surface is left to at one of its limits; 0 if that is not clear.

    Sliding ends where the field of one side leads to the surface no more, while that of the other still does:
    its rate is zero at the limit, or has another sign (a static limit above the kinetic one). Places where
    the mode holds tell. Where no random state comes to one (at the defaults a contact never slips), the limit
    may be that rate itself. Else all places at the limit tell, if they agree: elsewhere a formula with kinks
    is not the field of the mode.

    Parameters
    ----------
    known : the sides of surfaces on which the sliding mode holds
    pair : the surface, and the limit
    apart : the modes above and below the surface, beyond the limit
    """
    if not all(apart):
        return 0
    verdicts: dict[bool, set[int]] = {True: set(), False: set()}
    others = {name: side for name, side in known.items() if name not in pair}
    for other in (sampler, _moved(sampler)):
        places = (_both_met(other, pair, t, y) for t, y in other.states(_TRIES))
        for place in itertools.islice(filter(None, places), _PLACES):
            modes = zip((1, -1), apart, strict=True)
            outward = [(s * other.rate(mode, pair[0], s, *place), s) for s, mode in modes]
            inward = [side for rate, side in outward if rate < -_STILL]
            if len(inward) != 1 or not all(np.isfinite(outward).flat):
                continue
            verdicts[other.sides(*place, others) == others].add(-inward[0])
    told = verdicts[True]
    if not told and (side := _vanishing_side(sampler, known, pair, apart)):
        return side
    told = told or verdicts[False]
    return told.pop() if len(told) == 1 else 0


def _vanishing_side(
    sampler: Sampler, known: Mapping[str, int], pair: tuple[str, str], apart: Sequence[str]
) -> int:
    """Return the side of a surface whose rate is the height of a limit of sliding on it; 0 if neither is.

    So are the limits of Filippov's sliding: the field of that side is tangent to the surface there, and leads
    to it where sliding goes on.
    """
    on, limit = pair
    found = {1, -1}
    others = {name: side for name, side in known.items() if name not in pair}
    places = list(sampler.on(on, others, _PLACES)) or sampler.on(on, {}, _PLACES)
    for t, y in places:
        height = known[limit] * sampler.evaluator.height(limit, sampler.params, t, y)
        rates = {side: side * sampler.rate(apart[side < 0], on, side, t, y) for side in found}
        found = {s for s, rate in rates.items() if abs(rate + height) <= _STILL * (1.0 + abs(rate))}
    return found.pop() if len(found) == 1 else 0


def _both_met(
    sampler: Sampler, pair: tuple[str, str], t: float, y: Sequence[float]
) -> tuple[float, list[float]] | None:
    """Return a place on two surfaces, near a time and state: Newton's method; None if none is found."""
    place = np.array([t, *y])
    for _ in range(_STEPS):
        time, state = float(place[0]), place[1:].tolist()
        if not any(sampler.sides(time, state, pair).values()):
            return time, state
        above = [sampler.evaluator.height(name, sampler.params, time, state) for name in pair]
        slopes = np.array([sampler.gradient(name, time, state) for name in pair])
        if not (np.all(np.isfinite(above)) and np.all(np.isfinite(slopes))):
            return None
        place -= np.linalg.lstsq(slopes, np.array(above), rcond=None)[0]
    return None


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
    turns around (static and kinetic limits agree); it must be so for other parameters, too. A surface that
    slides itself is no such limit: what goes on from both has limits of its own.
    """
    under = {
        domain.mode: [n for n, side in domain.signs.items() if side == 0] for domain in domains
    }
    slid = {on for surfaces in under.values() for on in surfaces}
    pairs = {
        (under[mode.name][0], limit)
        for mode in description.modes
        for limit, side in mode.sides.items()
        if side != 0 and limit not in slid and len(under.get(mode.name, ())) == 1
    }
    at = {tuple(sorted(d.signs.items())): d for d in domains}
    found = False
    for on, limit in sorted(pairs):
        verdicts = _left_at_rest(sampler, on, limit, at) or _left_by_tangency(
            sampler, on, limit, at
        )
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
            place = _both_met(other, (on, limit), t, y)
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


def _left_by_tangency(
    sampler: Sampler, on: str, limit: str, at: Mapping[tuple[tuple[str, int], ...], Domain]
) -> set[bool]:
    """Return true where a limit that is met nowhere is the rate of a side: nothing if it is not."""
    for rest in (d for d in at.values() if d.signs[on] == 0 and d.signs[limit] != 0):
        beyond = {**rest.signs, limit: -rest.signs[limit]}
        sides = [at.get(tuple(sorted({**beyond, on: side}.items()))) for side in (1, -1)]
        apart = [d.mode for d in sides if d is not None]
        if len(apart) == 2 and _vanishing_side(sampler, rest.signs, (on, limit), apart):
            return {True}
    return set()


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
