"""Modes that end where no mode follows, slides among them; or that never end."""

from __future__ import annotations

from itertools import islice

from contfric.models.check.probe import Probe
from contfric.models.check.reached import report_fault
from contfric.models.check.report import ModelReport, Topic
from contfric.models.definition import Domain, Model
from contfric.models.parts import Mode, Reset

#: States on each surface.
_ON_SURFACE = 200
#: A rate this small is one that rounding has made.
_STILL = 1e-9
#: States that are drawn, and of these the states on all surfaces that are asked.
_DRAWN, _ASKED = 200, 20


def check_passages(report: ModelReport, probe: Probe) -> None:
    """Warn of modes that end at a surface whose reset acts in other modes only, with nothing beyond it."""
    for surface in probe.model.reset_by_surface:
        if mode := _ending(probe, surface):
            acts = " or ".join(probe.model.reset_by_surface[surface].modes)
            report.warn(
                Topic.RESETS,
                f"a solution in '{mode}' meets '{surface}', where its mode ends, and the reset there acts in "
                f"{acts} only: the solution crosses it unchanged, and no mode is on the other side. Add "
                f"one, or leave '{surface}' out of the 'in' of '{mode}', which then ends at another surface",
            )


def _ending(probe: Probe, surface: str) -> str:
    """Return a mode of which some sampled motion comes to a surface so; "" if none does."""
    model = probe.model
    ending = [d for d in model.domains if model.ends_at(d, surface)]
    for t, y in probe.on(surface, _ON_SURFACE) if ending else ():
        signs = probe.signs(t, y)
        for domain in ending:
            inside = all(domain.signs[s] == v for s, v in signs.items() if s != surface)
            rate = probe.rate(domain.own_mode, surface, t, y) if inside else 0.0
            if domain.signs[surface] * rate < -_STILL:
                return domain.own_mode
    return ""


def other_side(model: Model, reset: Reset, before: Domain) -> str:
    """Return how to say that a reset does not act in a mode, where it acts on the other side too."""
    side = before.signs[reset.surface]
    acting = [d for d in model.domains if model.maps_at(d, reset.surface)]
    others = dict.fromkeys(d.own_mode for d in acting if d.signs[reset.surface] == -side)
    if not others or before.own_mode in others:
        return ""
    return (
        f"; or, if solutions cross '{reset.surface}' unchanged in '{before.own_mode}', write "
        f"'from: [{', '.join(others)}]' to the reset"
    )


def crossed_limits(signs: dict[str, int]) -> str:
    """Return the contact whose moving limits are crossed: above the upper one, and below the lower."""
    pairs = ((s[:-1], sign) for s, sign in signs.items() if s.endswith("+"))
    return next((name for name, sign in pairs if sign > 0 and signs.get(f"{name}-", 0) < 0), "")


def check_left(report: ModelReport, model: Model, mode: Mode) -> None:
    """Warn of a sliding mode that nothing ends: motion would stay in it for ever."""
    own = {d.name for d in model.domains if d.own_mode == mode.name}
    if all(source not in own or own.issuperset(to) for (source, _), to in model.targets.items()):
        report.warn(
            Topic.SLIDING,
            f"mode '{mode.name}' is never left: no surface ends it. Add the limits between which it can "
            "stay to its 'in', such as F+: -, F-: +",
        )


def check_slides(report: ModelReport, probe: Probe) -> None:
    """Check that slides have a next domain where they meet a second surface.

    A slide that has none goes on beyond the surface, where its mode does not hold.
    """
    model = probe.model
    if model.composed:
        return  # which modes follow is derived
    for domain in model.domains:
        for surface, side in domain.signs.items():
            free = surface in model.fixed_sides or model.transitions.get((domain.name, surface))
            if 0 not in domain.signs.values() or side == 0 or free:
                continue
            if model.maps_at(domain, surface) or model.ends_at(domain, surface):
                continue  # what its reset does is another matter
            if place := _met(probe, domain, surface):
                report_fault(
                    report,
                    probe,
                    Topic.TRANSITIONS,
                    f"a slide in '{domain.own_mode}' meets '{surface}' at {place}, and no domain follows: it "
                    f"would go on beyond '{surface}', where its mode does not hold. Add a mode with "
                    f"{surface}: 0 there (it stays), or one on the other side",
                )
                return


def _met(probe: Probe, domain: Domain, surface: str) -> str:
    """Return a place at which a slide comes to a surface, in words; "" if none is found."""
    own = tuple(name for name, side in domain.signs.items() if side == 0)
    for t, y in islice(probe.on_all((*own, surface), _DRAWN), _ASKED):
        signs = probe.signs(t, y)
        others = {name: side for name, side in domain.signs.items() if side and name != surface}
        if any(signs[name] != side for name, side in others.items()):
            continue
        if domain.signs[surface] * probe.rate(domain.own_mode, surface, t, y) < -_STILL:
            return probe.shown(t, y)
    return ""
