"""Slides that meet a second surface, behind which no mode of the model is."""

from __future__ import annotations

from itertools import islice

from contfric.models.check.probe import Probe
from contfric.models.check.reached import report_fault
from contfric.models.check.report import ModelReport, Topic
from contfric.models.definition import Domain

#: States that are drawn, and of these the states on all surfaces that are asked.
_DRAWN, _ASKED = 200, 20
#: A rate this small is one that rounding has made.
_STILL = 1e-9


def check_slides(report: ModelReport, probe: Probe) -> None:
    """Check that slides have a next domain where they meet a second surface.

    A slide that has none goes on beyond the surface, where its mode does not hold.
    """
    model = probe.model
    if model.composed:
        return  # which modes follow is derived
    for domain in model.domains:
        for surface, side in domain.signs.items():
            free = surface in model.settled_sides or model.transitions.get((domain.name, surface))
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
    places = (probe.landed((*own, surface), *place) for place in probe.states(_DRAWN))
    for t, y in islice((place for place in places if place is not None), _ASKED):
        signs = probe.signs(t, y)
        others = {name: side for name, side in domain.signs.items() if side and name != surface}
        if any(signs[name] != side for name, side in others.items()):
            continue
        if domain.signs[surface] * probe.rate(domain.own_mode, surface, t, y) < -_STILL:
            return probe.shown(t, y)
    return ""
