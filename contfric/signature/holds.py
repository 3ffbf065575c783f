"""Holds: rest that ends at a free time, and the condition at its start that makes up for it.

Where static friction exceeds the kinetic one, a mass at rest that bears a load between the two may leave
at any instant (equation (2) of the reference, read as a differential inclusion). The rule "it is held
until the load reaches the static limit" selects one of these solutions, the stick. A **hold** is another
one: it leaves at a free time, and is pinned at its start, so that orbits with a hold form a curve in one
parameter. See ``docs/bridges.md``.

``hold@F+``
    follows a slide that stops on the surface F+, with the load falling (SS);
``hold@touch``
    follows a segment that ends tangentially: a slide that touches rest (GS), or a stick that touches its
    limit (AS).

Where another contact changes its state meanwhile, a hold goes through several modes. It is written as one
hold for each: ``hold@low+`` after another hold begins where the other contact meets its surface ``low+``, and
is left as the first one would be.

In a reduced itinerary a hold is the pair (sliding mode, ``hold@...``).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache

from contfric.errors import NotationError
from contfric.models import Model

_HOLD = "hold@"
#: A hold that follows a segment which ends tangentially.
TOUCH = f"{_HOLD}touch"

Pair = tuple[str, str]


def hold_at(surface: str) -> str:
    """Return the name of a hold that starts on a surface.

    Examples
    --------
    >>> hold_at("F+")
    'hold@F+'
    """
    return f"{_HOLD}{surface}"


@cache
def is_hold(name: str) -> bool:
    """Return whether a name (of a segment, or of an exit in an itinerary) is that of a hold."""
    return name.startswith(_HOLD)


def pinned_surface(hold: str) -> str | None:
    """Return the surface that a hold starts on; None if it follows a touch."""
    return None if hold == TOUCH else hold.removeprefix(_HOLD)


def mirror_exit(name: str, surfaces: Mapping[str, str]) -> str:
    """Return the mirror image of the exit of a segment, a surface or a hold."""
    if not is_hold(name):
        return surfaces[name]
    surface = pinned_surface(name)
    return TOUCH if surface is None else hold_at(surfaces[surface])


def known_hold(name: str, model: Model, follows: bool = False) -> bool:
    """Return whether a hold is one of a model: pinned to a surface that bounds its rest, or a touch.

    Parameters
    ----------
    follows : whether it goes on with one in another mode; it then begins on a surface of another contact
    """
    surface = pinned_surface(name)
    if follows:
        return surface is not None and surface in model.surface_by_name
    if model.composed:
        return surface is None or (surface in model.surface_by_name and not model.rests_on(surface))
    return surface is None or any(
        (domain.name, surface) in model.transitions
        for domain in model.domains
        if model.mode_by_name[domain.mode].sliding
    )


def release_mode(model: Model, mode: str, surface: str) -> str | None:
    """Return the mode that a regular release through a surface leads to, or None."""
    for domain in model.domains_of(mode):
        target = model.transitions.get((domain.name, surface))
        if target is not None:
            return model.domain_by_name[target].mode
    return None


@cache
def comes_to_rest(model: Model, mode: str, surface: str) -> bool:
    """Tell whether a mode may be left through a surface to rest on it, and on all that it rests on already.

    Where one contact sticks, another one may come to rest meanwhile: no rest comes to an end.
    """
    own, resting = model.domains_of(model.whole_mode(mode)), _rested_on(model, mode)
    after = (t for d in own for t in model.targets.get((d.name, surface), ()))
    return any(
        all(model.domain_by_name[t].signs.get(s) == 0 for s in (*resting, surface)) for t in after
    )


def ends_rest(model: Model, mode: str, exit_: str) -> bool:
    """Tell whether a segment is a rest that its exit ends."""
    return bool(model.mode_by_name[mode].sliding) and not comes_to_rest(model, mode, exit_)


@cache
def left_surface(model: Model, mode: str, departs: str) -> str:
    """Return the surface of a rest that a departing mode leaves: that of the contact that lets go."""
    resting, still = _rested_on(model, mode), _rested_on(model, departs)
    return next((s for s in resting if s not in still), resting[0])


def _rested_on(model: Model, mode: str) -> list[str]:
    """Return the surfaces that a mode moves on, in their order."""
    first = next(iter(model.domains_of(model.whole_mode(mode))))
    return [s for s, sign in first.signs.items() if sign == 0 and model.lies_on(mode, s)]


def of_another(model: Model, mode: str, surface: str, leaves: str) -> bool:
    """Tell whether a surface that a rest meets is another contact's: what would leave its own rests on."""
    released = release_mode(model, mode, surface)
    return released is None or model.lies_on(released, leaves)


def departing_mode(model: Model, before: Pair, hold: Pair) -> str:
    """Return the mode in which a hold is left, from the segment before it.

    On a surface as from a regular release there; after a touch of rest as the slide went on; after a
    touch of the limit as released there.

    Raises
    ------
    NotationError
        If no such hold can follow the segment.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> departing_mode(load_model("coulomb"), ("slide+", "v"), ("stick", "hold@F+"))
    'slide-'
    """
    surface = pinned_surface(hold[1])
    found: str | None
    if surface is not None:
        found = release_mode(model, hold[0], surface)
    elif ends_rest(model, *before):
        found = release_mode(model, hold[0], before[1])
    else:
        found = model.whole_mode(before[0])  # a part of it that ends on a section, otherwise
    if found is None:
        raise NotationError(f"no '{hold[1]}' of model '{model.name}' can follow {before}")
    return found


@cache
def departing_on(model: Model, departs: str, leaves: str, mode: str) -> str:
    """Return the mode in which a hold is left that goes on in a mode of rest after another contact changed.

    It leaves the same surface, to the side on which the mode ``departs`` of the hold so far lies.

    Raises
    ------
    NotationError
        If it cannot be left there: the contact rests no more, or in a way that leads elsewhere.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> departing_on(load_model("braced-chain"), "spn", "middle", "psn")
    'ppn'
    """
    side = next(iter(model.domains_of(departs))).signs.get(leaves)
    others = [s for s in _rested_on(model, mode) if s != leaves]
    for domain in model.domains_of(mode) if model.lies_on(mode, leaves) else ():
        for _, target in model.exits_of(domain.name):
            after = model.domain_by_name[target]
            if after.signs.get(leaves) == side and _rested_on(model, after.mode) == others:
                return after.mode
    raise NotationError(
        f"'{mode}' of model '{model.name}' is not left as '{departs}' leaves {leaves}"
    )


def following_rests(model: Model, mode: str, surface: str, leaves: str) -> list[str]:
    """Return the modes through a surface of another contact in which a contact at rest rests on."""
    targets = [t for d in model.domains_of(mode) for t in model.targets.get((d.name, surface), ())]
    modes = dict.fromkeys(model.domain_by_name[t].mode for t in targets)
    return [m for m in modes if m != mode and model.lies_on(m, leaves)]


@cache
def _long_hold(model: Model, segments: tuple[str, ...]) -> tuple[str, tuple[str, ...]] | None:
    """Return the mode that a hold in several modes would be left to at first, and those that it goes through.

    Parameters
    ----------
    segments : the domain before it, its holds, and the domain after it

    Returns
    -------
    None if no such hold leads from the one to the other.
    """
    before, first, *further = segments[:-1]
    source = model.domain_by_name[before].mode
    wanted = model.domain_by_name[segments[-1]].mode
    held = len(_rested_on(model, source))
    domains = [before, *(d.name for d in model.domains_of(source))]
    exits = [pair for domain in domains for pair in model.exits_of(domain)]
    rests = [
        m for _, t in exits if len(_rested_on(model, m := model.domain_by_name[t].mode)) > held
    ]
    ways: list[tuple[str, str | None]] = [
        (source, release_mode(model, source, s)) for s, _ in exits
    ]
    if first != TOUCH:
        ways = [(rest, release_mode(model, rest, str(pinned_surface(first)))) for rest in rests]
    else:
        ways = [(rest, source) for rest in rests] + ways
    for rest, departs in dict.fromkeys(ways):
        if departs is None or not model.mode_by_name[rest].sliding:
            continue
        leaves = left_surface(model, rest, departs)
        chains: list[tuple[tuple[str, ...], str]] = [((rest,), departs)]
        if model.lies_on(departs, leaves):
            continue
        for hold in further:
            chains = [
                ((*modes, on), departing_on(model, left, leaves, on))
                for modes, left in chains
                for on in following_rests(model, modes[-1], str(pinned_surface(hold)), leaves)
            ]
        for modes, left in chains:
            if left == wanted:
                return departs, modes
    return None


def _around(segments: Sequence[str], index: int) -> tuple[tuple[str, ...], int]:
    """Return the holds that follow one another about one, with the segments around, and its place there."""
    first, last = index, index
    while is_hold(segments[first - 1]) and last - first < len(segments):
        first -= 1
    while is_hold(segments[(last + 1) % len(segments)]) and last - first < len(segments):
        last += 1
    found = tuple(segments[k % len(segments)] for k in range(first - 1, last + 2))
    return found, index - first


def mode_of(model: Model, segments: Sequence[str], index: int) -> str:
    """Return the mode of a segment of a walk; that of a hold is the rest that it starts from."""
    if not is_hold(segments[index]):
        return model.domain_by_name[segments[index]].mode
    around, place = _around(segments, index)
    if len(around) > 3:
        found = _long_hold(model, around)
        if found is None:
            raise NotationError(f"no hold leads from {around[0]} to {around[-1]} by {around[1:-1]}")
        return found[1][place]
    before = model.domain_by_name[segments[index - 1]].mode
    after = model.domain_by_name.get(segments[(index + 1) % len(segments)])
    released = segments[index] == TOUCH and (after is None or after.mode != before)
    if released and model.mode_by_name[before].sliding:
        return before
    held = len(_rested_on(model, before))
    rests = [
        mode
        # of several contacts that may come to rest first the one that can from this very domain
        for domain in (segments[index - 1], *(d.name for d in model.domains_of(before)))
        for _, target in model.exits_of(domain)
        if model.mode_by_name[mode := model.domain_by_name[target].mode].sliding
        and len(_rested_on(model, mode)) > held
    ]
    surface = pinned_surface(segments[index])
    bounded = [m for m in rests if surface is not None and release_mode(model, m, surface)]
    if after is not None:  # first the one that is left into what follows
        bounded.sort(key=lambda m: release_mode(model, m, str(surface)) != after.mode)
    return next(iter([*bounded, *rests]), before)


def surface_into(model: Model, segments: Sequence[str], index: int) -> str | None:
    """Return the surface through which a segment of a walk ends where a hold begins, None if none.

    A slide that touches rest would come to it there; one that stops on a surface comes from beyond it,
    where it would reverse; a stick touches the surface that releases it the way the hold goes.
    """
    source, hold = segments[index], (index + 1) % len(segments)
    around, _ = _around(segments, hold)
    rest = mode_of(model, segments, hold)
    found = _long_hold(model, around) if len(around) > 3 else None
    beyond = found[0] if found is not None else model.domain_by_name[around[-1]].mode
    touches = segments[hold] == TOUCH and rest != model.domain_by_name[source].mode
    wanted = rest if touches else beyond
    for surface, target in model.exits_of(source):
        if model.domain_by_name[target].mode == wanted:
            return surface
    return None


def domains_after(model: Model, mode: str, departs: str) -> tuple[str, ...]:
    """Return the domains that a hold is left into: next to a rest, in the departing mode.

    Where other contacts have regions of their own there are several.
    """
    rests = model.domains_of(mode)
    if model.composed:
        return (departs,)
    return tuple(
        domain.name
        for domain in model.domains_of(departs)
        if any(
            all(domain.signs[name] == sign for name, sign in rest.signs.items() if sign)
            for rest in rests
        )
    )


def hold_fault(model: Model, segments: Sequence[str], index: int) -> str | None:
    """Return what is wrong with the hold at a place of a walk; None if nothing is.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> hold_fault(load_model("coulomb"), ("x+v+", "hold@F+", "x+v-"), 1)
    "'hold@F+' leads to x0v-, not to x+v-"
    """
    hold, before = segments[index], segments[index - 1]
    around, place = _around(segments, index)
    after = around[-1]
    if not known_hold(hold, model, follows=place > 0):
        valid = ", ".join([TOUCH, *(hold_at(s) for s in model.surface_by_name)])
        return f"model '{model.name}' has no '{hold}'; a hold is one of {valid}"
    if not {around[0], after} <= model.domain_by_name.keys():
        return f"'{hold}' must stand between two domains"
    if len(around) > 3:
        if _long_hold(model, around) is None:
            return f"'{hold}' must stand between two domains, or go on with a hold as another contact changes"
        return None
    surface = surface_into(model, segments, (index - 1) % len(segments))
    if surface is None:
        return f"no '{hold}' can follow {before}"
    mode = mode_of(model, segments, index)
    source = model.domain_by_name[before].mode
    try:
        departs = departing_mode(model, (source, surface), (mode, hold))
    except NotationError as error:
        return str(error)
    expected = domains_after(model, mode, departs)
    if after in expected:
        return None
    return f"'{hold}' leads to {' or '.join(expected) or 'no domain'}, not to {after}"


def without_holds(itinerary: tuple[Pair, ...], model: Model) -> tuple[Pair, ...]:
    """Return the itinerary with a stick in the place of each hold that leads the same way.

    It is a closed walk of the transition graph exactly if the itinerary with its holds can be walked.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> walk = (("slide+", "v"), ("stick", "hold@F+"), ("slide-", "v"), ("stick", "F-"))
    >>> without_holds(walk, load_model("coulomb"))
    (('slide+', 'v'), ('stick', 'F+'), ('slide-', 'v'), ('stick', 'F-'))
    """
    found: list[Pair] = []
    departs = leaves = ""  # of the hold before
    first = next((k for k, (_, exit_) in enumerate(itinerary) if not is_hold(exit_)), 0)
    itinerary = itinerary[first:] + itinerary[:first]
    for index, pair in enumerate(itinerary):
        before = itinerary[index - 1]
        if not is_hold(pair[1]):
            found.append(pair)
        elif is_hold(before[1]):  # up to where it begins what is held is a stick
            departs = departing_on(model, departs, leaves, pair[0])
            found[-1] = found[-1][0], str(pinned_surface(pair[1]))
            found.append((pair[0], _surface_towards(model, pair[0], departs)))
        else:
            departs = departing_mode(model, before, pair)
            leaves = left_surface(model, pair[0], departs)
            if not ends_rest(model, *before):
                found.append((pair[0], _surface_towards(model, pair[0], departs)))
    return tuple(found)


def _surface_towards(model: Model, mode: str, wanted: str) -> str:
    """Return the surface through which a stick is released into a mode."""
    for surface in model.surface_by_name:
        if release_mode(model, mode, surface) == wanted:
            return surface
    raise NotationError(f"rest '{mode}' of model '{model.name}' is never left into '{wanted}'")
