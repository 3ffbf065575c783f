"""Outcomes of events of structures with many contacts, if the return map is continuous.

The states of the contacts compose, so that the itinerary after an event follows from that before it. Where
rest is left without acceleration (:attr:`contfric.models.definition.Model.filippov`) the solution is
continuous, and there are four cases:

=====================================  =================================================================
event, at the location                    edit of the itinerary
=====================================  =================================================================
two contacts change at once            they change in the other order
a surface is touched inside            split it there: the contact changes its state, for no time
such a state has no length any more    drop it: the contact does not change
a stop meets the limit of its load     swap stick and reversal (:func:`contfric.signature.edits.swap_edit`)
=====================================  =================================================================

In the second case the new segment grows with the root of the distance from the event. Let ``e`` be by how
much the surface would be passed, ``w`` the root of ``2 e`` over the curvature there. A load that passes its
limit begins a slide at ``-w``, with an acceleration that is zero at ``w``: its velocity is zero again at
``2 w``. A velocity that falls through zero begins a stick at ``-w``, whose load reaches the limit again at
``0``. A gap is closed from ``-w`` to ``w``.

Of friction contacts that share their loads two change at once: ``first``, at whose surface segment i ends,
and another one. Where that is

* beyond the limit of its load *after* the joint, it lets go with the first: its state there is the other one
  on the two sides of the event. In between it changes a little later, in a segment without length;
* at a surface *before* the joint, it may change first. As loads jump where a contact stops, what follows is
  not the same two changes in the other order: the second contact may stop, or let go, at once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from contfric.base.arrays import FloatArray
from contfric.bvp.system import EventFunction, Itinerary, Margin
from contfric.errors import NotationError
from contfric.events.local.touching import coming_back, second_rate
from contfric.events.local.zero_acceleration import only_comes_back, touch_of
from contfric.models.definition import Model
from contfric.models.deriving.growing_model import ComposedModel
from contfric.orbit.orbit import Orbit
from contfric.signature.edits import Edit, split, swap_edit
from contfric.signature.holds import is_hold
from contfric.signature.walks import entered

if TYPE_CHECKING:
    from contfric.models.structures.shared_loads import Limit

#: A segment shorter than this (nondimensional) has no length: it is as long as the root, or the third root,
#: of the rounding of what is located. One that is longer, taken for none, is refused by Newton's method.
_NO_LENGTH = 1e-3


#: Start joints of the segments that come in or move, and how fast these move away, by their origin.
Joints = dict[tuple[int, int], FloatArray]
Speeds = dict[tuple[int, int], float]


def continuous_edit(orbit: Orbit, location: EventFunction) -> tuple[Edit, Joints, Speeds, str]:
    """Return the edit at a location where nothing jumps, its joints, how they move away, and why.

    Raises
    ------
    NotationError
        If nothing follows from this location: the reason says why.
    """
    itinerary, i = orbit.itinerary, location.segment
    if not orbit.model.composed:
        return crossed(orbit, location)
    if is_hold(itinerary[i][1]):
        raise NotationError(f"segment {i + 1} is a hold: nothing can be held where nothing jumps")
    if location.margin is Margin.JOINT:
        return _two_at_once(orbit, i, location.surface)
    if location.margin is Margin.INTERIOR:
        return _touched(orbit, i, location.surface)
    return vanished(orbit, i)


def _two_at_once(orbit: Orbit, i: int, surface: str) -> tuple[Edit, Joints, Speeds, str]:
    """Return the edit where two surfaces are met at once: of one contact, or of two."""
    model, itinerary = orbit.model, orbit.itinerary
    mode = itinerary[i][0]
    joints: Joints = {(i, 0): orbit.ends[i]}
    if isinstance(model, ComposedModel) and model.composition.structure.coupled:
        return _sharing(orbit, model, i, surface)
    if not any(through == surface for through, _ in model.exits_of(mode)):
        edit = swap_edit(itinerary, {i: surface}, model)
        return edit, joints, {}, f"swap stick and reversal at stop {i + 1}, at {surface}"
    edit, reason = exchanged(orbit, i, surface)
    return edit, joints, {}, reason


def exchanged(orbit: Orbit, i: int, surface: str) -> tuple[Edit, str]:
    """Return the edit where two contacts that do not share loads change in the other order, and why.

    One changes at the end of segment i, the other one at ``surface``, which is met at once.

    Raises
    ------
    NotationError
        If it is no such place.
    """
    model, itinerary = orbit.model, orbit.itinerary
    j = (i + 1) % len(itinerary)
    (mode, first), (_, second), (after, _) = (
        itinerary[k % len(itinerary)] for k in (i, i + 1, i + 2)
    )
    domains = [domain.name for domain in model.domains_of(model.whole_mode(mode))]
    ways = [
        other
        for other in modes_through(model, mode, surface)
        if entered(entered(domains, surface, model, mode, other), first, model, other, after)
    ]
    if second != surface or not ways or _lasts(orbit, j):
        raise NotationError(
            f"{surface} and {first} are met at once, and do not change places there"
        )
    edit = Edit(frozenset({j}), {i: surface}, {i: ((ways[0], first),)})
    return edit, f"{surface} is met before {first} at the end of segment {i + 1}"


def modes_through(model: Model, mode: str, surface: str) -> list[str]:
    """Return the other modes that a mode is left to through a surface, in their order."""
    own = model.whole_mode(mode)
    found = {
        model.domain_by_name[target].mode
        for domain in model.domains_of(own)
        for target in model.targets.get((domain.name, surface), ())
    }
    return sorted(found - {own}, key=model.mode_order)


def _sharing(
    orbit: Orbit, model: ComposedModel, i: int, surface: str
) -> tuple[Edit, Joints, Speeds, str]:
    """Return the edit where two surfaces are met at once, of contacts that share loads or of others."""
    itinerary, joints = orbit.itinerary, {(i, k): orbit.ends[i] for k in range(2)}
    short = [
        not _lasts(orbit, (i + 1 + k) % len(itinerary)) for k in range(min(2, len(itinerary) - 2))
    ]
    limit = limit_after(model, itinerary, i, surface)
    if limit is not None:
        edit, reason = with_other_state(model, itinerary, i, limit, vanishes=any(short[:1]))
    else:
        count = next((k for k, is_short in enumerate(short) if not is_short), len(short))
        edit = in_other_order(model, itinerary, i, surface, count)
        reason = f"{surface} is met before {itinerary[i][1]} at the end of segment {i + 1}"
    if edit.inserted and not edit.dropped and not _lasts(orbit, i):
        raise NotationError(f"segment {i + 1} has no length: nothing comes in after it")
    used = len(edit.inserted.get(i, ()))
    return edit, {key: joint for key, joint in joints.items() if key[1] < used}, {}, reason


def _touched(orbit: Orbit, i: int, surface: str) -> tuple[Edit, Joints, Speeds, str]:
    """Return the edit where a surface is touched inside: the contact changes its state, for no time."""
    model, (mode, exit_) = orbit.model, orbit.itinerary[i]
    touch = touch_of(orbit, i, surface)
    if only_comes_back(orbit, i, surface):
        raise NotationError(
            f"segment {i + 1} leaves {surface} and comes back, and does not touch it between"
        )
    other, back = _there_and_back(model, mode, surface)
    gaps = {i - 1: touch[0] - orbit.begins[i, 0], i + 1: orbit.ends[i, 0] - touch[0]}
    for k, away in ((k % len(orbit.itinerary), away) for k, away in gaps.items()):
        if away < _NO_LENGTH and orbit.itinerary[k] == (other, back) and not _lasts(orbit, k):
            raise NotationError(
                f"the change in segment {k + 1}, of no time, is at this touch of {surface}"
            )
    edit = split(i, surface, (other, back), (mode, exit_))
    joints: Joints = {(i, 0): touch, (i, 1): touch}
    if back == surface:
        lasts = (-1.0, 1.0)  # a gap
    else:
        lasts = (-1.0, 2.0) if model.rests_on(back) else (-1.0, 0.0)
    speeds = {(i, 0): lasts[0], (i, 1): lasts[1]}
    return edit, joints, speeds, f"{surface} is touched in segment {i + 1}: passed, and met again"


def crossed(orbit: Orbit, location: EventFunction) -> tuple[Edit, Joints, Speeds, str]:
    """Return the edit at the touch of a surface that is crossed: the time beyond it begins, or vanishes.

    How fast the joints move apart: :func:`~contfric.events.local.touching.speeds_of_crossing`.
    """
    i, surface = location.segment, location.surface
    if location.margin is Margin.JOINT:
        raise NotationError(f"{surface} is touched at a section: nothing can be held there")
    if location.margin is Margin.EXIT:
        return vanished(orbit, i)
    mode, exit_ = orbit.itinerary[i]
    touch = touch_of(orbit, i, surface)
    beyond = coming_back(orbit, mode, surface, touch)
    if beyond is None:
        raise NotationError(f"what passes {surface} in segment {i + 1} does not come back")
    before, following = (
        second_rate(orbit, m, surface, float(touch[0]), touch[1:]) for m in (mode, beyond.mode)
    )
    edit = split(i, surface, (beyond.mode, surface), (mode, exit_))
    away = {(i, 0): -1.0, (i, 1): 2.0 * before / following - 1.0}
    reason = f"{surface} is touched in segment {i + 1}: crossed, and met again"
    return edit, {(i, 0): touch, (i, 1): touch}, away, reason


def _there_and_back(model: Model, mode: str, surface: str) -> tuple[str, str]:
    """Return the mode after a surface, and the surface that leads back from there."""
    for other in model.targets.get((mode, surface), ()):
        for back, target in model.exits_of(other):
            if target == model.whole_mode(mode):
                return other, back
    raise NotationError(f"{surface} does not bound '{mode}', or nothing leads back")


def vanished(orbit: Orbit, i: int) -> tuple[Edit, Joints, Speeds, str]:
    """Return the edit where a segment between two of one mode has no length any more: it is left out.

    So it is with a state of a contact, and beyond a surface that is crossed there and back.
    """
    itinerary, n, model = orbit.itinerary, len(orbit.itinerary), orbit.model
    for k in (i, (i + 1) % n):
        before, following = (k - 1) % n, (k + 1) % n
        modes = [itinerary[j][0] for j in (before, following)]
        if n < 3 or _lasts(orbit, k) or len(set(map(model.whole_mode, modes))) > 1:
            continue
        edit, joints = Edit(frozenset({k, following}), {before: itinerary[following][1]}), {}
        if modes[0] != modes[1]:  # what ends on a section has the name of that side
            edit = Edit(frozenset({before, k, following}), {}, {before: (itinerary[following],)})
            joints = {(before, 0): orbit.cycle[before]}
        return edit, joints, {}, f"segment {k + 1} vanishes"
    raise NotationError(f"segment {i + 1} ends tangentially, and what follows has some length")


def _lasts(orbit: Orbit, i: int) -> bool:
    return bool(orbit.durations[i] > _NO_LENGTH)


def limit_after(model: ComposedModel, itinerary: Itinerary, i: int, surface: str) -> Limit | None:
    """Return the limit of a shared load that is met after a joint; None if it is no such thing."""
    limit = model.composition.limit(surface)
    return None if limit is None or surface in model.composition.ways(itinerary[i][0]) else limit


def with_other_state(
    model: ComposedModel, itinerary: Itinerary, i: int, limit: Limit, vanishes: bool
) -> tuple[Edit, str]:
    """Return the edit where a contact has the other state after a joint, and why.

    Parameters
    ----------
    vanishes : whether the segment after the joint has no length
    """
    n, name = len(itinerary), limit.contact.name
    (mode, exit_), (here, leaves), after = (
        itinerary[i],
        itinerary[(i + 1) % n],
        itinerary[(i + 2) % n][0],
    )
    states = model.composition.states_in(here)
    lets_go = "p" if limit.sign == "+" else "n"
    other = "".join({**states, name: lets_go if states[name] == "s" else "s"}.values())
    back = limit.name if states[name] != "s" else name
    if not model.follows(mode, exit_, other):
        raise NotationError(f"'{other}' cannot follow '{mode}' at {exit_}")
    if vanishes and other == after and leaves in (limit.name, name):
        return Edit(
            frozenset({(i + 1) % n})
        ), f"'{name}' changes its state at joint {i + 1} already"
    if not model.follows(other, back, here):
        raise NotationError(f"'{here}' cannot follow '{other}' at {back}")
    return Edit(inserted={i: ((other, back),)}), f"'{name}' changes its state after joint {i + 1}"


def in_other_order(
    model: ComposedModel, itinerary: Itinerary, i: int, surface: str, short: int
) -> Edit:
    """Return the edit where a surface is met before that at which a segment ends.

    Parameters
    ----------
    short : number of segments after the joint that have no length
    """
    n, (mode, first) = len(itinerary), itinerary[i]
    for count in range(short, min(short, 1) - 1, -1):
        target = itinerary[(i + 1 + count) % n][0]
        gone = frozenset((i + 1 + k) % n for k in range(count))
        for between in _paths(model, mode, surface, first, target):
            if len(between) <= count or count == 0 < len(between):
                return Edit(gone, {i: surface}, {i: between} if between else {})
    raise NotationError(f"{surface} and {first} are met at once, and do not change places there")


def _paths(
    model: ComposedModel, mode: str, surface: str, first: str, target: str
) -> list[tuple[tuple[str, str], ...]]:
    """Return segments without length between a mode that is left through a surface and another mode."""
    if model.follows(mode, surface, target):
        return [()]
    found: list[tuple[tuple[str, str], ...]] = []
    for after in model.targets.get((mode, surface), ()):
        if first not in model.composition.ways(after):
            continue
        if model.follows(after, first, target):
            found.append(((after, first),))
        for between in model.targets[after, first]:
            for last, end in model.exits_of(between):
                if end == target:
                    found.append(((after, first), (between, last)))
    return sorted(found, key=len)
