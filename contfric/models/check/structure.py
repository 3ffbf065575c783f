"""Surfaces, transitions, sliding modes, symmetry and period of a model, at sampled states."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Set

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.models.check.passages import check_left, crossed_limits, other_side
from contfric.models.check.period import changed_after_a_period, not_periodic, repeats_sooner
from contfric.models.check.probe import Probe
from contfric.models.check.reached import report_fault
from contfric.models.check.report import ModelReport, Topic
from contfric.models.definition import Domain, Model, Surface
from contfric.models.parts import Reset

#: States on each surface, and in the whole region.
_ON_SURFACE, _EVERYWHERE = 200, 400
#: With a gradient this small a place on the surface is known to 1e-6 only (12 digits of the observable).
_FLAT = 1e-6
#: At a double root a place is known to 1e-6, and so is the gradient: this far from it is a thousand times
#: larger. That of a surface which is crossed is not a hundred times larger there.
_BESIDE, _VANISHES = 1e-3, 1e-2
#: A rate this small is one that rounding has made.
_STILL = 1e-9
#: Rounding of values that should be the same, relative to 1 + their size.
_SAME = 1e-8


def check_surfaces(report: ModelReport, probe: Probe) -> None:
    """Check that each surface is reached, and that its observable changes across it."""
    for surface in probe.model.surfaces:
        if surface.name in probe.model.fixed_sides:
            continue  # derived, and met at rest on a wall only
        reached = 0
        for t, y in probe.on(surface.name, _ON_SURFACE // 4):
            reached += 1
            report.count(Topic.SURFACES)
            if _is_flat(probe, surface.name, t, y):
                report.error(
                    Topic.SURFACES,
                    f"the gradient of '{surface.observable}' vanishes on surface '{surface.name}' at "
                    f"{probe.shown(t, y)}: crossings of it cannot be located. Use an observable "
                    "that changes its sign there with a slope, such as x in place of x**2",
                )
                break
        if not reached and not _ends_derived(probe.model, surface):
            report.warn(
                Topic.SURFACES,
                f"no state was found on surface '{surface.name}' ({surface.observable} = "
                f"{surface.level}): if solutions reach it, enlarge 'spread'; else leave it out",
            )


def _is_flat(probe: Probe, surface: str, t: float, y: FloatArray) -> bool:
    """Tell whether the gradient vanishes on a surface near a place, which is on it to 12 digits only."""
    slope = probe.slope(surface, t, y)
    size = float(np.abs(slope).max())
    if not size > _FLAT:
        return True
    step = _BESIDE * slope / np.linalg.norm(slope)
    around = [probe.slope(surface, t + s * step[0], y + s * step[1:]) for s in (1.0, -1.0)]
    return size < _VANISHES * float(np.abs(around).max())


def _ends_derived(model: Model, surface: Surface) -> bool:
    """Tell whether a surface ends a derived sliding mode: nobody wrote it, and one end may be all."""
    mode = model.mode_by_name.get(surface.name[:-1])
    return mode is not None and mode.derived


def check_transitions(report: ModelReport, probe: Probe) -> None:
    """Check that every crossing that motion makes has a next domain."""
    model = probe.model
    for surface in model.surfaces:
        if surface.name not in model.fixed_sides:
            _check_crossings(report, probe, surface)


def entered_domains(model: Model, made: Set[tuple[str, str, str]] | None = None) -> set[str]:
    """Return the domains that motion comes to from others, again and again: all that cycles may visit.

    Parameters
    ----------
    made : (domain, surface, next domain) of the crossings and resets that count; all that the graph has if
        left out
    """
    found = {domain.name for domain in model.domains}
    while True:
        entered = {
            target
            for (source, surface), targets in model.targets.items()
            for target in targets
            if source in found
            and source != target
            and (made is None or (source, surface, target) in made)
        }
        if not found - entered:
            return found
        found &= entered


def _made(probe: Probe) -> set[tuple[str, str, str]]:
    """Return the crossings and resets that some sampled motion makes, or that none was sampled for.

    The graph has more: a state that is held is on one side of a surface for ever, and a reset to 0 leads
    to the side of 0 only.
    """
    model = probe.model
    seen: set[tuple[str, str]] = set()
    found: set[tuple[str, str, str]] = set()
    for surface in model.surfaces:
        for t, y in probe.on(surface.name, _ON_SURFACE):
            on = {**probe.signs(t, y), surface.name: 0}
            for domain in model.domains:
                side = domain.signs.get(surface.name, 0)
                if not side or not {**domain.signs, surface.name: 0}.items() <= on.items():
                    continue
                key = domain.name, surface.name
                seen.add(key)
                if not side * probe.rate(domain.own_mode, surface.name, t, y) < -_STILL:
                    continue
                targets = model.targets.get(key, ())
                if model.maps_at(domain, surface.name):
                    behind = probe.signs(t, probe.reset(surface.name, t, y))
                    free = {*behind} - model.reset_by_surface[surface.name].lands.keys()
                    targets = tuple(
                        d
                        for d in targets
                        if all(model.domain_by_name[d].signs[s] == behind[s] for s in free)
                    )
                found |= {(*key, target) for target in targets}
    return found | {
        (*key, d) for key, targets in model.targets.items() if key not in seen for d in targets
    }


def _behind_wall(probe: Probe, signs: dict[str, int]) -> bool:
    """Return whether a region lies on the side of a wall that motion never comes to."""
    for reset in probe.model.reset_by_surface:
        sides = {d.signs[reset] for d in probe.model.domains}
        if signs[reset] not in sides:
            return True
    return False


def _check_crossings(report: ModelReport, probe: Probe, surface: Surface) -> None:
    model, entered = probe.model, entered_domains(probe.model)
    for t, y in probe.on(surface.name, _ON_SURFACE):
        signs = {**probe.signs(t, y), surface.name: 0}
        if list(signs.values()).count(0) != 1 or _behind_wall(probe, {**signs}):
            continue
        for domain in model.domains:
            side, name = domain.signs.get(surface.name, 0), domain.name
            if not side or not {**domain.signs, surface.name: 0}.items() <= signs.items():
                continue
            if model.maps_at(domain, surface.name) or model.ends_at(domain, surface.name):
                continue  # what its reset does is another matter, and so is that nothing follows it
            rate = probe.rate(domain.own_mode, surface.name, t, y)
            if not side * rate < -_STILL:
                continue
            report.count(Topic.TRANSITIONS)
            following = model.transitions.get((name, surface.name))
            if following is None and (limit := crossed_limits(signs)):
                report.warn(
                    Topic.TRANSITIONS,
                    f"the limit '{limit}+' lies below '{limit}-' at some states: a friction limit that is "
                    "negative. Where solutions come there (a normal force vanishes) the model does not hold",
                )
                continue
            if following is None and name in entered:
                entered = entered_domains(model, _made(probe))
            if following is None and entered and name not in entered:
                report.note(
                    Topic.TRANSITIONS,
                    f"a solution that starts in '{name}' meets '{surface.name}' and no domain follows: "
                    f"{_sides(model, signs)}. Nothing else leads there",
                )
                return
            if following is None:
                report_fault(
                    report,
                    probe,
                    Topic.TRANSITIONS,
                    f"a solution in '{name}' meets '{surface.name}' at {probe.shown(t, y)}, and no "
                    f"domain follows: {_sides(model, signs)}. Add a mode with {surface.name}: 0 there (it "
                    "stays), or one on the other side",
                )
                return
            if not _goes_on(report, probe, surface, name, following, t, y):
                return


def _goes_on(
    report: ModelReport,
    probe: Probe,
    surface: Surface,
    name: str,
    following: str,
    t: float,
    y: FloatArray,
) -> bool:
    """Return whether motion can enter what follows; else it is sent back at once, for ever."""
    domain = probe.model.domain_by_name[following]
    side = domain.signs.get(surface.name, 0)
    back = probe.model.transitions.get((following, surface.name))
    if probe.model.maps_at(domain, surface.name):
        return True  # it is mapped at once
    if side == 0 or (back and probe.model.domain_by_name[back].own_mode == domain.own_mode):
        return True  # it stays, or the surface ends the other mode only
    rate = probe.rate(domain.own_mode, surface.name, t, y)
    if side * rate >= -_STILL:
        return True
    report_fault(
        report,
        probe,
        Topic.TRANSITIONS,
        f"a solution in '{name}' meets '{surface.name}' at {probe.shown(t, y)} and should go on in "
        f"'{following}', whose field leads back to the surface: the solution is caught there. Add a mode "
        f"with {surface.name}: 0 (it slides on the surface), with the condition under which it stays",
    )
    return False


def check_resets(report: ModelReport, probe: Probe) -> None:
    """Check that a reset leads into a domain, and away from the surfaces that it is on there.

    Where that is so for some states only, motion may never arrive in others: a note.
    """
    for reset in probe.model.resets:
        faults, fine = [], 0
        for domain, t, y in arrivals(probe, reset):
            report.count(Topic.RESETS)
            fault = _reset_fault(probe, reset, domain, t, y)
            fine += not fault
            faults += [fault] if fault else []
        if faults and fine:
            share = f"{len(faults)} of {fine + len(faults)} states that were tried"
            report.note(Topic.RESETS, f"{faults[0]}; so it is for {share}, the others go on")
        elif faults:
            report.error(Topic.RESETS, faults[0])


def arrivals(probe: Probe, reset: Reset) -> Iterator[tuple[Domain, float, FloatArray]]:
    """Yield (domain, time, state) of motion that meets the surface of a reset."""
    for t, y in probe.on(reset.surface, _ON_SURFACE // 2):
        signs = probe.signs(t, y)
        for domain in probe.model.domains:
            side = domain.signs[reset.surface]
            beside = all(signs[s] == v for s, v in domain.signs.items() if s != reset.surface)
            meets = beside and probe.model.maps_at(domain, reset.surface)
            if meets and side * probe.rate(domain.own_mode, reset.surface, t, y) < -_STILL:
                yield domain, t, y


def _reset_fault(probe: Probe, reset: Reset, before: Domain, t: float, y: FloatArray) -> str:
    """Return what is wrong with the image of a state; nothing if motion goes on from there."""
    model, name = probe.model, reset.surface
    behind = probe.reset(name, t, y)
    signs = probe.signs(t, behind)
    where = f"after the reset at '{name}' the solution from {probe.shown(t, y)}"
    possible = [model.domain_by_name[d] for d in model.targets.get((before.name, name), ())]
    passes = other_side(model, reset, before)
    fits = [d for d in possible if _holds(model, d, signs, reset)]
    if not fits:
        return (
            f"{where} is in no domain: {_sides(model, signs)}. Add a mode that holds there{passes}"
        )
    for surface in (s for s, side in reset.lands.items() if side != 0):
        rate, mode = probe.rate(fits[0].own_mode, surface, t, behind), fits[0].own_mode
        away = max(d.signs[surface] * rate for d in fits if d.own_mode == mode)
        still = abs(rate) <= _STILL * (1.0 + abs(probe.rate(before.own_mode, name, t, y)))
        if still and any(d.signs[surface] == 0 for d in model.domains):
            continue  # a plastic impact: forces say for how long it rests on the surface
        if not away > 0.0:
            observable = model.surface_by_name[surface].observable
            return (
                f"{where} still runs into the surface '{surface}': a reset must turn the rate of "
                f"'{observable}' around, such as v: -e*v, or lead off the surface{passes}"
            )
    return ""


def _holds(model: Model, domain: Domain, signs: Mapping[str, int], reset: Reset) -> bool:
    """Tell whether a domain holds where a reset leads. On the surface of another reset that acts."""
    return all(
        domain.signs[s] == v or (v == 0 and model.maps_at(domain, s))
        for s, v in signs.items()
        if s not in reset.lands
    )


def check_sliding(report: ModelReport, probe: Probe) -> None:
    """Check that a sliding mode does not change the observables of its surfaces."""
    model = probe.model
    for mode in model.modes:
        if not mode.sliding or mode.name in model.chatter_by_mode:  # that is derived
            continue
        if not model.composed:  # else limits of the load end every stick
            check_left(report, model, mode)
        domain = next(d for d in model.domains if d.own_mode == mode.name)
        surfaces = tuple(name for name, side in domain.signs.items() if side == 0)
        for place in probe.places(mode.name, _ON_SURFACE):
            report.count(Topic.SLIDING)
            for name in surfaces:
                rate = probe.rate(mode.name, name, *place)
                if not abs(rate) <= _SAME * (1.0 + np.abs(place[1]).max()):
                    report.error(
                        Topic.SLIDING,
                        f"mode '{mode.name}' leaves its surface '{name}': at {probe.shown(*place)} the rate "
                        f"of '{model.surface_by_name[name].observable}' is {rate:.6g}, it must be 0",
                    )
                    return


def check_symmetry(report: ModelReport, probe: Probe) -> None:
    """Check that the map takes solutions to solutions: fields, surfaces, and domains."""
    model, symmetry = probe.model, probe.model.symmetry
    if symmetry is None:
        return
    matrix, shift = symmetry.array(), symmetry.fraction * probe.period
    try:
        images = model.mirror_domain
    except Exception as error:  # the model says itself which domain is without an image
        report.error(Topic.SYMMETRY, f"{error}: leave 'symmetry' out, or add the missing domain")
        return
    for domain in model.domains:
        for place in probe.places(domain.own_mode, _EVERYWHERE, 1):
            moved, mirrored = place[0] + shift, matrix @ place[1]
            report.count(Topic.SYMMETRY)
            mode = model.domain_by_name[images[domain.name]].own_mode
            here = matrix @ probe.field(domain.own_mode, *place)
            there = probe.field(mode, moved, mirrored)
            if not np.allclose(here, there, rtol=_SAME, atol=_SAME):
                report.error(
                    Topic.SYMMETRY,
                    f"the field of mode '{mode}' is no image of that of '{domain.own_mode}': at "
                    f"{probe.shown(*place)} the image of the rates is {here.tolist()}, the rates at "
                    f"the image are {there.tolist()}. Leave 'symmetry' out, or correct a field",
                )
                return
            for name, image in symmetry.surfaces.items():
                a = probe.height(name, moved, mirrored)
                b = -symmetry.sense(name) * probe.height(image, *place)
                if not abs(a + b) <= _SAME * (1.0 + abs(a) + abs(b)):
                    report.error(
                        Topic.SYMMETRY,
                        f"surface '{image}' is no image of '{name}' at {probe.shown(*place)}",
                    )
                    return


def check_period(report: ModelReport, probe: Probe) -> None:
    """Check that what depends on time has the model's period, and that nothing does without one."""
    for mode in probe.model.modes:
        for place in probe.places(mode.name, _EVERYWHERE, 4):
            report.count(Topic.PERIOD)
            if what := changed_after_a_period(probe, [mode.name], *place):
                report.error(Topic.PERIOD, not_periodic(what, probe.period, "the defaults"))
                return
    if text := repeats_sooner(probe):
        report.warn(Topic.PERIOD, text)


def _sides(model: Model, signs: dict[str, int]) -> str:
    words, own = {1: "above", -1: "below", 0: "on"}, signs.keys() - model.section_surfaces
    return ", ".join(f"{words[side]} {name}" for name, side in signs.items() if name in own)
