"""Derives where a reset leads: the surfaces that its images lie on, and the sides they leave them to.

``theta -> -theta`` at ``theta = alpha`` lands on ``theta = -alpha``; ``omega -> r omega`` at ``theta = 0``
stays there and lets motion pass, ``omega -> -r omega`` sends it back. Found at sampled states that motion
arrives at: it is so for all of them, or it is not so.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Sequence
from dataclasses import replace

from contfric.models.definition import Domain, Surface
from contfric.models.deriving.sections import joined_modes
from contfric.models.described.description import wraps_of
from contfric.models.described.evaluate import Sampler
from contfric.models.entries import EntryError
from contfric.models.language.grammar import parse
from contfric.models.parts import EITHER, Lead, Reset, led

#: States on a surface that are asked: what a single one says may be an accident.
_PLACES = 24
#: What to declare where a kick may pass its surface or turn back.
_ADVICE = (
    ". If it may pass '{}' or turn back, declare a surface where the rate of its observable vanishes, "
    "such as stop: {{observable: v}}: its sides tell"
)
#: How much farther than where motion is sought the speeds are that a kick does not turn back.
_FAR = 16.0
#: Rounding of an image on a surface, relative to 1 + its values.
_ON = 1e-9


def acting_modes(sampler: Sampler, domains: Sequence[Domain], surface: str) -> set[str]:
    """Return the modes in which a reset acts: of those that it names, those on one side of its surface."""
    named = sampler.evaluator.description.acts.get(surface, ())
    sides: dict[str, set[int]] = {}
    for domain in domains:
        sides.setdefault(domain.mode, set()).add(domain.signs[surface])
    return {
        mode
        for mode, signs in sides.items()
        if signs in ({1}, {-1}) and (not named or mode in named)
    }


class Landing:
    """The images of a reset, at sampled states on its surface."""

    def __init__(
        self,
        sampler: Sampler,
        surface: str,
        surfaces: Sequence[Surface],
        domains: Sequence[Domain],
        leads: Sequence[Lead],
    ) -> None:
        self.sampler, self.surface, self.leads = sampler, surface, leads
        self.known, self.surfaces = surfaces, [s.name for s in surfaces]
        self.domains = domains
        self.arrivals = list(self._arrivals())

    def _arrivals(self) -> list[tuple[Domain, float, list[float]]]:
        """Return (domain, time, state) of motion that meets the surface."""
        found, acting = [], acting_modes(self.sampler, self.domains, self.surface)
        for t, y in self.sampler.on(self.surface, {}, _PLACES):
            sides = self.sampler.sides(t, y, self.surfaces)
            others = [s for s in self.surfaces if s != self.surface]
            for domain in self.domains:
                side = domain.signs[self.surface]
                beside = all(sides[s] == domain.signs[s] for s in others)
                if not (domain.mode in acting and beside):
                    continue
                if side * self.sampler.rate(domain.mode, self.surface, side, t, y) < 0.0:
                    found.append((domain, t, y))
        return found

    def lands(self) -> dict[str, int]:
        """Return the surfaces that all images lie on, and the side to which each is left.

        For the reset's own surface that side is +1 where motion goes back, -1 where it passes. It is 0 where
        all modes that the reset leads to move on the surface.
        """
        images = [(d, t, self._image(t, y)) for d, t, y in self.arrivals]
        met = [
            s for s in self.surfaces if images and all(self._is_on(s, t, y) for _, t, y in images)
        ]
        return {surface: self._left_to(surface, met, images) for surface in met}

    def _image(self, t: float, y: Sequence[float]) -> list[float]:
        evaluator, params = self.sampler.evaluator, self.sampler.params
        description = evaluator.description
        texts = description.resets[self.surface]
        return [
            evaluator.value(texts[state], params, t, y) if state in texts else value
            for state, value in zip(description.states, y, strict=True)
        ]

    def _is_on(self, surface: str, t: float, y: Sequence[float]) -> bool:
        above = self.sampler.evaluator.height(surface, self.sampler.params, t, y)
        return abs(above) <= _ON * (1.0 + max(map(abs, y)))

    def _left_to(
        self,
        surface: str,
        met: Sequence[str],
        images: Sequence[tuple[Domain, float, list[float]]],
    ) -> int:
        own = surface == self.surface
        named = {lead.mode for lead in self.leads if lead.mode not in lead.after}
        if named and {d.signs[surface] for d in self.domains if d.own_mode in named} == {0}:
            return 0  # it leads into motion on that surface
        verdicts, asked, passed = Counter[int](), Counter[int](), True
        for before, t, y in images:
            landed = self._behind(before, met, t, y)
            turn = before.signs[surface] if own else 1
            verdicts[turn * self._side(landed, surface, met, t, y)] += 1
            others = named if own else named - {before.own_mode}
            wanted = [d for d in landed if d.own_mode in others]
            asked[turn * self._side(wanted, surface, met, t, y)] += 1
            passed = passed and self._is_label(surface, landed)
        decided = {side for side in verdicts if side}
        if len(decided) > 1 and len(asked.keys() - {0}) == 1:  # elsewhere the mode before goes on
            decided = asked.keys() - {0}
        if own and len(decided) == 1 and self._may_be_slower(surface):
            decided |= {turn for turn in self._far(met) if turn}
        if len(decided) == 1 and (self.leads or not verdicts[0]):
            return (
                decided.pop()
            )  # the mode that is asked for may not hold at states that no solution brings
        if own and len(decided) > 1 and self.ways():
            return EITHER
        one_sided = len({d.signs[surface] for d in self.domains} - {0}) == 1
        if own and one_sided:
            return 1  # a wall that some states still run into: `contfric check` says where
        if passed and any(verdicts[side] for side in (1, -1)):
            return max(
                (1, -1), key=verdicts.__getitem__
            )  # the mode after the reset passes it: a label
        if any(self.surface in wraps_of(a) for a in self.sampler.evaluator.description.angles):
            raise EntryError(
                ("angles",),
                f"a turn ends at '{self.surface}', and no mode holds after it, so that nothing turns round: "
                "leave 'angles' out, and write a wall that is met in each turn as sin((theta - wall)/2) = 0",
            )
        if mode := self._staying(surface, met, named, images):
            joined = joined_modes(self.sampler.evaluator.description)
            raise EntryError(
                ("modes", mode),
                f"the reset at '{self.surface}' leads to '{joined[mode]}', which stays on the surface "
                f"'{surface}': write '{surface}: 0' to its 'in'",
            )
        raise EntryError(
            ("resets", self.surface),
            f"the reset at '{self.surface}' takes states to the surface '{surface}', and some of them to one "
            "side of it, some to the other, or to none: the rates after a reset must tell the side, or the "
            "mode to which it leads ('to: mode', which lies on one side of that surface)"
            f"{_ADVICE.format(surface) if own and len(decided) > 1 else ''}",
        )

    def _staying(
        self,
        surface: str,
        met: Sequence[str],
        named: Container[str],
        images: Sequence[tuple[Domain, float, list[float]]],
    ) -> str | None:
        """Return a mode that a reset leads to and in which the surface's observable keeps its level."""
        stays: dict[str, bool] = {}
        for before, t, y in images:
            for domain in self._behind(before, met, t, y):
                side = domain.signs[surface]
                rate = self.sampler.rate(domain.mode, surface, side, t, y)
                still = side != 0 and abs(rate) <= _ON * (1.0 + max(map(abs, y)))
                stays[domain.own_mode] = stays.get(domain.own_mode, True) and still
        return next((mode for mode, still in stays.items() if still and mode in named), None)

    def _may_be_slower(self, surface: str) -> bool:
        """Tell whether sides of other surfaces say on which side of its own what is kicked goes on.

        Where a reset names its modes only, these tell.
        """
        free = not self.leads or any(lead.where for lead in self.leads)
        ways = self.ways() if free else frozenset()
        return len({d.signs[surface] for d in self.domains if d.name in ways}) > 1

    def _far(self, met: Sequence[str]) -> set[int]:
        """Return the sides to which states far away are sent, +1 back: a kick is weak for what is fast."""
        far = Landing(
            replace(self.sampler, scale=_FAR),
            self.surface,
            self.known,
            self.domains,
            self.leads,
        )
        images = [(d, t, far._image(t, y)) for d, t, y in far.arrivals]
        return {
            d.signs[self.surface] * self._side(self._behind(d, met, t, y), self.surface, met, t, y)
            for d, t, y in images
            if far._is_on(self.surface, t, y)
        }

    def ways(self) -> frozenset[str]:
        """Return the domains in which motion leaves the surface; none if in one of them it may come back.

        So the sides of all other surfaces tell whether what a kick sends against its motion passes still.
        """
        found = set()
        for domain in self.domains:
            side, others = domain.signs[self.surface], dict(domain.signs)
            others.pop(self.surface)
            rates = [
                side * self.sampler.rate(domain.mode, self.surface, side, t, y)
                for t, y in self.sampler.on(self.surface, others, _PLACES)
            ]
            if rates and min(rates) > 0.0:
                found.add(domain.name)
            elif rates and max(rates) > 0.0:
                return frozenset()
        return frozenset(found)

    def _is_label(self, surface: str, landed: Sequence[Domain]) -> bool:
        """Tell whether one mode follows, on both sides of a surface: solutions pass it there unchanged."""
        modes = {d.mode for d in landed}
        sides = {d.signs[surface] for d in self.domains if d.mode in modes}
        return len(modes) == 1 and sides >= {1, -1}

    def _behind(
        self, before: Domain, met: Sequence[str], t: float, y: Sequence[float]
    ) -> list[Domain]:
        """Return the domains that an image may be in, but for the sides of the surfaces that it is on."""
        sides = self.sampler.sides(t, y, [s for s in self.surfaces if s not in met])
        landed = [d for d in self.domains if all(d.signs[s] == v for s, v in sides.items())]
        return led(landed, self.leads, before.own_mode)

    def _side(
        self,
        landed: Sequence[Domain],
        surface: str,
        met: Sequence[str],
        t: float,
        y: Sequence[float],
    ) -> int:
        """Return the side of a surface to which one image leaves; 0 without one, or with two."""
        away = set()
        for domain in landed:
            sides = {s: domain.signs[s] for s in met if domain.signs[s]}
            rates = {s: v * self.sampler.rate(domain.mode, s, v, t, y) for s, v in sides.items()}
            if rates.get(surface, 0.0) > 0.0 and min(rates.values()) >= 0.0:
                away.add(sides[surface])
        return away.pop() if len(away) == 1 else 0


def reset_of(
    sampler: Sampler, surface: str, surfaces: Sequence[Surface], domains: Sequence[Domain]
) -> Reset:
    """Return the reset at a surface; observables without the states that it maps are not changed by it."""
    description = sampler.evaluator.description
    texts, leads = description.resets[surface], description.leads.get(surface, ())
    changed = {state for state, value in texts.items() if value != state}
    own = next(s.observable for s in description.surfaces if s.name == surface)
    seen = {
        o.name
        for o in description.observables
        if description.names.leaves(parse(o.formula), ()) & changed
    }
    if not acting_modes(sampler, domains, surface):
        raise EntryError(
            ("resets", surface),
            f"the reset at '{surface}' acts in no mode: it does in those that lie on one side of it. Write "
            f"that side to the 'in' of a mode ({surface}: + or {surface}: -), or 'from: [modes]' to "
            "the reset if solutions cross the surface in them",
        )
    landing = Landing(sampler, surface, surfaces, domains, leads)
    if landing.arrivals:
        lands = landing.lands()
    else:  # none of the states that were sampled: the formula tells
        one_sided = len({d.signs[surface] for d in domains} - {0}) == 1
        lands = {} if own in seen else {surface: 1 if one_sided else -1}
    changes = tuple(
        o.name
        for o in description.observables
        if o.name in seen and not (o.name == own and surface in lands)
    )
    formula = ", ".join(f"{state} -> {value}" for state, value in texts.items())
    wraps = any(surface in wraps_of(angle) for angle in description.angles)
    modes = description.acts.get(surface, ())
    ways = landing.ways() if EITHER in lands.values() else frozenset()
    return Reset(surface, formula, changes, lands, leads, modes, wraps, ways)
