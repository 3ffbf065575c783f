"""Structures with many contacts: modes that come into being when a solution visits them.

The mode of a structure is the tuple of the states of its contacts, and its name has a letter for each
(``sspn``: two stick, one slides up, one down). k contacts of three states have 3^k modes. None of them is
listed: what an engine asks of a mode follows from its letters, and is worked out when it is first asked for.

========================  =================================================================================
sides, rates              those of the contacts (:mod:`contfric.models.structures.contact_modes`)
bounds                    the surfaces through which a contact changes its state; no others matter to a mode,
                          so that a sliding contact is not divided by the limits of its load
ways through a surface    (what else holds where it is met, mode that follows): friction that stops sticks
                          where its load is within the limits, and reverses where it is beyond; all Jenkins
                          elements along one direction stop at once. One way only for everything else
========================  =================================================================================

The engine's numbers of modes (:class:`contfric.models.deriving.growing_model.ComposedModel`) are given in
the order of the first visit; itineraries and signatures have the names.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

from contfric.base.attributes import kept
from contfric.models.deriving.phases import PART, PhaseParts
from contfric.models.described.description import ModeText
from contfric.models.described.reading_back import from_text
from contfric.models.entries import SIDES
from contfric.models.generated.formula_tables import Forms
from contfric.models.lazy_mapping import Made
from contfric.models.parts import Domain, Mode, Surface
from contfric.models.structures.contact_laws import ContactLaws, law_of, rest_of
from contfric.models.structures.contact_modes import Combinations
from contfric.models.structures.contacts import Contact, ContactKind
from contfric.models.structures.shared_loads import Limit, Setting, load_name, suffix
from contfric.models.structures.shared_ways import Place, SharedWays
from contfric.models.structures.structure import Structure

if TYPE_CHECKING:
    from contfric.models.described.description import Description


@dataclass(frozen=True)
class Way:
    """What follows where a surface is met: the mode, and the sides of other surfaces for which it does."""

    mode: str
    where: Mapping[str, int]


class Composition:
    """The modes of a structure, each made when it is asked for.

    Parameters
    ----------
    description : of the structure, with the mode in which no contact acts

    Attributes
    ----------
    phase : the surface of the phase; empty if no mode is divided
    parts : which modes it divides
    """

    def __init__(self, description: Description) -> None:
        structure = Structure.read(description.structure)
        self.structure, self.states = structure, description.states
        self._description = description
        self._parts = Combinations(structure)
        self.acting = [c for c in structure.contacts if c.states]
        self._places: dict[str, int] = {}
        self._ways: dict[str, dict[str, tuple[Way, ...]]] = {}
        self.declared = frozenset(s.name for s in description.surfaces)
        self.parts = PhaseParts(self.acting, len(self.structure.coordinates), description.phase)
        self.phase = description.phase
        self.shared = SharedWays(structure, description)

    def is_mode(self, name: object) -> bool:
        """Tell whether a name is that of a mode."""
        if name in self._places:
            return True
        if not isinstance(name, str):
            return False
        whole = self.parts.whole(name)
        fits = len(whole) == len(self.acting)
        fits = fits and all(a in c.states for a, c in zip(whole, self.acting, strict=True))
        return fits and (whole == name or self.parts.is_divided(whole))

    def order(self, name: str) -> int:
        """Return the place of a mode among all, if they were listed: second parts come last."""
        if name not in self._places:
            place = 0
            for letter, contact in zip(self.parts.whole(name), self.acting, strict=True):
                place = place * len(contact.states) + contact.states.index(letter)
            count = math.prod(len(c.states) for c in self.acting)
            self._places[name] = place + count * name.endswith(PART)
        return self._places[name]

    def states_in(self, name: str) -> dict[str, str]:
        """Return the state of each contact."""
        return {
            c.name: letter for c, letter in zip(self.acting, self.parts.whole(name), strict=True)
        }

    @kept
    def sides(self, name: str) -> dict[str, int]:
        """Return the sides of the surfaces that matter to a mode."""
        found = self._parts.sides(self.states_in(name))
        return {surface: SIDES[side] for surface, side in found.items()}

    def mode(self, name: str) -> Mode:
        """Return a mode; it forgets a direction for each surface that it moves on."""
        held = sum(side == 0 for side in self.sides(name).values())
        return Mode(name, len(self.states) - held, held > 0)

    def domain(self, name: str) -> Domain:
        """Return the only domain of a mode, with the sides of the surfaces that matter to it."""
        if not self.parts.is_divided(name):
            return Domain(name, name, self.sides(name), name)
        sides = {**self.sides(name), self.phase: self.parts.side(name)}
        return Domain(name, self.parts.whole(name), sides, name, declared=name)

    def text(self, name: str) -> ModeText:
        """Return the rates in a mode, and its sides; shared loads have names (:meth:`loads_in`)."""

        def load(c: Contact, setting: Setting) -> str:
            return load_name(c, setting) if self.shares(c) else self.structure.load(c, setting)

        field = self._parts.field(self.states_in(name), load)
        return ModeText(name, tuple(field[state] for state in self.states), self.sides(name))

    def loads_in(self, name: str) -> dict[str, str]:
        """Return the shared loads of the contacts that stick in a mode, by their names."""
        states, found = self.states_in(name), {}
        for c in self.structure.loads.rubbing:
            if states[c.name] == "s" and self.shares(c):
                setting = self.structure.loads.setting(c, states)
                found[load_name(c, setting)] = self.structure.load(c, setting)
        return found

    def shares(self, contact: Contact) -> bool:
        """Tell whether a contact shares its load with others."""
        return self.structure.loads.couples(contact)

    @kept
    def limit(self, surface: str) -> Limit | None:
        """Return the limit of a shared load that a surface is; None if it is not one."""
        return self.structure.loads.limit(surface)

    def surface(self, name: str) -> tuple[Surface, str]:
        """Return a surface that is the limit of a shared load, and the formula of its observable."""
        limit = self.limit(name)
        if limit is None:
            raise KeyError(name)
        fixed = self._parts.surfaces.is_fixed(limit.contact)
        texts = self._parts.surfaces.load_texts(limit.contact, limit.setting, fixed)
        observable, formula, level = texts[limit.sign]
        return Surface(name, observable, level), formula

    @cached_property
    def laws(self) -> tuple[ContactLaws, ...]:
        """What the contacts carry and dissipate: a law for each state, and for the springs that load it."""
        return tuple(map(self._laws_of, self.structure.contacts))

    def _laws_of(self, contact: Contact) -> ContactLaws:
        known: dict[str, Mapping[str, str]] = {}  # states of contacts by what a law depends on

        def key_of(name: str) -> str:
            states = self.states_in(name)
            key = states[contact.name]
            if contact.kind is ContactKind.FRICTION and key == "s":
                key += suffix(self.structure.loads.setting(contact, states))
            known.setdefault(key, states)
            return key

        def text_of(asked: str) -> str:
            what, key = asked.split(" ")
            return law_of(self.structure, contact, known[key])[what == "power"]

        texts = Made(text_of, lambda asked: asked.partition(" ")[2] in known)
        for letter in contact.states:  # what slides dissipates: that is asked of all laws at once
            if contact.kind is not ContactKind.FRICTION or letter != "s":
                known[letter] = {contact.name: letter}
                texts.get(f"power {letter}")
        kept = Made(key_of, self.is_mode)
        return ContactLaws(contact.name, kept, texts, **rest_of(self.structure, contact))

    def samples(self) -> tuple[str, ...]:
        """Return modes in which each contact is in each of its states; in the first none acts."""
        count = max(len(c.states) for c in self.acting)
        return tuple(
            "".join(c.states[min(k, len(c.states) - 1)] for c in self.acting) for k in range(count)
        )

    def check(self) -> None:
        """Read the rates of all contacts in each of their states; what cannot be read is reported.

        Raises
        ------
        NotAffineError
            With the reason, where a force is not affine.
        """
        forms = Forms(self._description)
        for name in self.samples():
            forms.add(self.text(name), self.loads_in(name))

    # --------------------------------------------------------------------------- what follows

    def ways(self, name: str) -> dict[str, tuple[Way, ...]]:
        """Return what follows a mode at each surface that bounds it."""
        if name not in self._ways:
            states = self.states_in(name)
            found: dict[str, tuple[Way, ...]] = {}
            for contact in self.acting:
                found |= self._ways_of(contact, states)
            self._ways[name] = found
        return self._ways[name]

    def _ways_of(self, contact: Contact, states: Mapping[str, str]) -> dict[str, tuple[Way, ...]]:
        state, name = states[contact.name], contact.name

        def way(letter: str, where: Mapping[str, int] | None = None) -> Way:
            return Way("".join({**states, name: letter}.values()), where or {})

        if contact.kind is ContactKind.SPRING:
            return {name: (way("c" if state == "o" else "o"),)}
        if contact.kind is ContactKind.JENKINS:
            if state == "s":
                return {f"{name}+": (way("p"),), f"{name}-": (way("n"),)}
            return self._stop(contact, states)
        limit = Limit(contact, "+", self.structure.loads.setting(contact, states))
        upper, lower = limit.name, limit.other.name
        if self.shares(contact):
            found = [
                (
                    after,
                    Way("".join(after.values()), self.shared.conditions(contact, states, after)),
                )
                for after in self.shared.listed(contact, states)
            ]
            if state != "s":
                return {name: tuple(w for _, w in found)}
            up, down = ([w for after, w in found if after[name] == a] for a in "pn")
            return {upper: tuple(up), lower: tuple(down)}
        if state == "s":
            return {upper: (way("p"),), lower: (way("n"),)}
        beyond = way("n", {lower: -1}) if state == "p" else way("p", {upper: 1})
        return {name: (way("s", {upper: -1, lower: 1}), beyond)}

    def changing(self, name: str, surface: str) -> Contact | None:
        """Return the contact with a shared load that changes its state where a mode meets a surface."""
        limit = self.limit(surface)
        of = limit.contact.name if limit else surface
        states = self.states_in(name)
        return next(
            (c for c in self.acting if c.name == of and self.shares(c) and of in states), None
        )

    def way(self, name: str, surface: str, after: str) -> Way | None:
        """Return the way from a mode through a surface into another one, listed or not; else None."""
        ways = self.ways(name).get(surface, ())
        found = next((w for w in ways if w.mode == after), None)
        contact = self.changing(name, surface)
        if found is not None or contact is None or not ways or not self.is_mode(after):
            return found
        states, others = self.states_in(name), self.states_in(after)
        own = {self.states_in(w.mode)[contact.name] for w in ways}
        if others[contact.name] not in own or not self.shared.may_follow(contact, states, others):
            return None
        found = Way(after, self.shared.conditions(contact, states, others))
        self._ways[name][surface] = (*ways, found)  # known from now on
        return found

    def is_solved(self, name: str, surface: str) -> bool:
        """Tell whether what follows a mode at a surface is solved for, from the state there."""
        ways = self.ways(name).get(surface, ())
        return len(ways) > 1 and self.changing(name, surface) is not None

    def after(self, name: str, surface: str, place: Place) -> str:
        """Return the mode that follows where a mode meets a surface, by the forces there."""
        contact, states = self.changing(name, surface), self.states_in(name)
        assert contact is not None
        given = {}
        if states[contact.name] == "s":
            limit = self.limit(surface)
            assert limit is not None
            given = {contact.name: "p" if limit.sign == "+" else "n"}
        resting = self.structure.loads.cluster(contact, states)
        found = self.shared.solved(resting, states, place, given)
        mode = "".join({**states, **found}.values())
        self.way(name, surface, mode)
        return mode

    def _stop(self, contact: Contact, states: Mapping[str, str]) -> dict[str, tuple[Way, ...]]:
        """Return what follows where a sliding element stops: all that slide along its direction do."""
        stop, _ = self._parts.surfaces.stop_of(contact)
        along = {
            c.name
            for c in self.acting
            if c.kind is ContactKind.JENKINS and self._parts.surfaces.stop_of(c)[0] == stop
        }
        after = {c: "s" if c in along else letter for c, letter in states.items()}
        return {stop: (Way("".join(after.values()), {}),)}

    # ------------------------------------------------------------------------------- surfaces

    @property
    def rested_on(self) -> frozenset[str]:
        """The surfaces that some mode moves on."""
        rubs = {c.name for c in self.acting if c.kind is ContactKind.FRICTION}
        elastic = [c.name for c in self.acting if c.kind is ContactKind.JENKINS]
        return frozenset({*rubs, *(f"{name}{sign}" for name in elastic for sign in "+-")})

    @property
    def switching(self) -> frozenset[str]:
        """The surfaces at which motion is cut: those that are rested on, and the ends of gaps."""
        return self.rested_on | {c.name for c in self.acting if c.kind is ContactKind.SPRING}

    @property
    def leaves_at_rest(self) -> bool:
        """Whether all that stops is left without acceleration: static and kinetic friction agree."""
        slides = [c for c in self.acting if c.kind is not ContactKind.SPRING]
        texts = [c.texts for c in slides if c.kind is ContactKind.FRICTION]
        return bool(slides) and all(t.get("static", t["kinetic"]) == t["kinetic"] for t in texts)

    def mode_at(self, signs: Mapping[str, int], place: Place | None = None) -> str:
        """Return the mode of a state from the sides of all surfaces; on one, where it leaves to.

        Parameters
        ----------
        place : parameters, time and state, for contacts at rest that share loads
        """
        whole = self._mode_at(signs, place)
        return self.parts.part(whole, signs.get(self.phase, 1))

    def _mode_at(self, signs: Mapping[str, int], place: Place | None) -> str:
        states: dict[str, str] = {}
        for c in self.acting:
            if c.kind is ContactKind.SPRING:
                states[c.name] = "c" if signs[c.name] < 0 else "o"
        for c in self.acting:
            if c.kind is ContactKind.JENKINS:
                stop, ways = self._parts.surfaces.stop_of(c)
                out = {"p": signs[f"{c.name}+"] >= 0, "n": signs[f"{c.name}-"] <= 0}
                going = [a for a in "pn" if out[a] and signs[stop] == SIDES[ways[a]]]
                states[c.name] = going[0] if going else "s"
            elif c.kind is ContactKind.FRICTION:
                states[c.name] = {1: "p", -1: "n", 0: "s"}[signs[c.name]]
        resting = [c for c in self.structure.loads.rubbing if signs[c.name] == 0]
        sharing = [c for c in resting if self.shares(c)]
        for c in resting:
            if c not in sharing:
                limit = Limit(c, "+", self.structure.loads.setting(c, states))
                pushed = signs[limit.name] > 0, signs[limit.other.name] < 0
                states[c.name] = "p" if pushed[0] else "n" if pushed[1] else "s"
        if sharing and place is not None:
            states |= self.shared.solved(sharing, states, place, {})
        return "".join(states[c.name] for c in self.acting)

    def image(self, name: str, images: Mapping[str, str]) -> str:
        """Return the image of a mode under a symmetry: of a part the first one.

        Parameters
        ----------
        images : of the surfaces; the signs of (observable - level) are reversed
        """
        sides = {images[surface]: -side for surface, side in self.sides(name).items()}
        letters = []
        for c in self.acting:
            if c.kind is ContactKind.FRICTION:
                letters.append({0: "s", 1: "p", -1: "n"}[sides[c.name]])
            elif c.kind is ContactKind.JENKINS:
                at = [a for a, s in (("p", "+"), ("n", "-")) if sides.get(f"{c.name}{s}") == 0]
                letters.append(at[0] if at else "s")
            else:
                letters.append("o" if sides[c.name] > 0 else "c")
        return "".join(letters)

    def image_of(self, limit: Limit, images: Mapping[str, str]) -> Limit:
        """Return the image under a symmetry of the limit of a shared load."""
        by_name = {c.name: c for c in self.acting}
        turned = {"p": "n", "n": "p", "+": "-", "-": "+"}
        states = {images[c.name]: turned.get(letter, letter) for c, letter in limit.setting}
        setting = tuple((c, states[c.name]) for c in self.acting if c.name in states)
        return Limit(by_name[images[limit.contact.name]], turned[limit.sign], setting)


@lru_cache(maxsize=16)
def composition_of(definition: str) -> Composition:
    """Return the composition of a definition that has a structure."""
    return Composition(from_text(definition))
