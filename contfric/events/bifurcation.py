"""Bifurcations of a branch: their kinds, and the reasons for which a branch ends.

Which sliding event a margin that reaches zero is: :mod:`contfric.events.sliding_kinds`.
"""

from __future__ import annotations

from collections.abc import Callable, Set
from dataclasses import dataclass, field, fields
from enum import Enum
from typing import TYPE_CHECKING

from contfric.base.attributes import altered
from contfric.base.extras import need_flint
from contfric.bvp.system import EventFunction
from contfric.errors import ParameterError, did_you_mean
from contfric.events.local.touching import chosen_at, entered_at, thrown_at
from contfric.events.measured_event import MeasuredEvent
from contfric.models.definition import Model
from contfric.orbit.canonical.slides import Outline
from contfric.orbit.orbit import Orbit
from contfric.remember.stored import made_of

if not TYPE_CHECKING:
    from contfric.base.attributes import cached_property
if TYPE_CHECKING:
    from functools import cached_property

    from contfric.certify.events import EventCertificate


class Kind(str, Enum):
    """Kinds of bifurcation.

    Examples
    --------
    >>> import contfric as cf
    >>> cf.Kind.SS.meaning, cf.Kind("SN") is cf.Kind.SN
    ('switching-sliding', True)
    """

    SN = "SN"
    BP = "BP"
    PD = "PD"
    NS = "NS"
    CS = "CS"
    SS = "SS"
    AS = "AS"
    GS = "GS"
    T = "T"

    @property
    def meaning(self) -> str:
        """One line for a legend or a table."""
        return _MEANINGS[self]

    @classmethod
    def named(cls, name: object) -> Kind:
        """Return a kind by its name, or as it is.

        Raises
        ------
        ParameterError
            If there is no such kind.
        """
        for kind in cls:
            if name is kind or (isinstance(name, str) and name == kind.value):
                return kind
        meant = _ELSEWHERE.get(str(name).upper(), name)
        hint = did_you_mean(str(meant), [kind.value for kind in cls])
        raise ParameterError(f"there is no kind of bifurcation {name!r}{hint}")


_MEANINGS = {
    Kind.SN: "fold (saddle-node)",
    Kind.BP: "branch point (symmetry breaking)",
    Kind.PD: "period doubling",
    Kind.NS: "torus (Neimark-Sacker)",
    Kind.CS: "crossing-sliding",
    Kind.SS: "switching-sliding",
    Kind.AS: "adding-sliding",
    Kind.GS: "grazing-sliding",
    Kind.T: "tangency: segments relabelled",
}

#: What COCO, AUTO and MatCont call some kinds.
_ELSEWHERE = {"LP": "SN", "LPC": "SN", "FP": "SN", "BPC": "BP", "TR": "NS"}

#: Kinds at which a branch of one reduced itinerary cannot go on.
TERMINAL = frozenset({Kind.CS, Kind.SS, Kind.AS, Kind.GS})


#: The solution at a located event is good to about 1e-10; asymmetry this small is not seen in a diagram.
_SYMMETRIC = 1e-7
#: Most that a solution may be off where its event is known roughly, and that is the root of how well (so far
#: from symmetric are the two branches of a pitchfork, that far from it in the parameter): ``SAME_SOLUTION``
#: of :mod:`contfric.atlas.matching`.
_NEARLY_SYMMETRIC = 1e-4
#: A solution this far from its mirror image is another one, however badly its parameter is known: events that
#: are as far apart are two (``_APART`` of :mod:`contfric.atlas.matching`).
_ASYMMETRIC = 0.05


class EndReason(str, Enum):
    """Why a branch ends; the text says it to the user.

    Examples
    --------
    >>> import contfric as cf
    >>> cf.EndReason.RANGE.value
    'end of the range asked for'
    """

    RANGE = "end of the range asked for"
    LIMIT = "physical limit of the parameter"
    CS = "crossing-sliding: the signature changes, the solution is continuous"
    SS = "switching-sliding: the Poincare map is discontinuous"
    AS = "adding-sliding: the Poincare map is discontinuous"
    GS = "grazing-sliding: the Poincare map is discontinuous"
    REST = "the mass stays at rest for ever beyond this point"
    CONTINUUM = "its orbits go on as a continuum, at this one value of the parameter"
    SHAKEDOWN = (
        "the position of a stuck contact is at its limit: beyond this point it slips to one side until it "
        "sticks at another position; start there from a simulation"
    )
    PERIOD = "the period grows without bound: the orbit comes to an equilibrium (homoclinic), or slows down"
    POINT = "the orbit shrinks to a point: an equilibrium that begins to oscillate (Hopf)"
    BP = "the orbit has become symmetric: its mirror branch goes on from here"
    PD = "the doubled orbit meets the orbit of half its period"
    CLOSED = "the branch is a closed curve"
    STOP = "a quantity has the value to stop at (stop_at)"
    START = "the branch starts here"
    POINTS = "the largest number of points was reached (max_points)"
    WORK = (
        "most steps are refused: the work for max_points points is done, and more would get nowhere"
    )
    STEP = "the step became too small: Newton does not converge"
    SINGULAR = "several conditions fail at once: the equations are singular beyond this point"
    UNBOUNDED = "the amplitude grows without bound: resonance"
    BROKEN = "the orbit is not finite beyond this point"
    INTERRUPTED = "interrupted"


#: An event that is located better than this, relative to the range, is well conditioned: far above what
#: most are located to (1e-12), far below what a diagram resolves.
ACCURACY = 1e-8


class Decision(str, Enum):
    """What became of a candidate."""

    ACCEPTED = "accepted"
    KNOWN = "known"
    REFUSED = "refused"


@dataclass(frozen=True)
class Proposal:
    """A candidate for what follows an event, and what became of it.

    Attributes
    ----------
    reason : what would happen, in words
    verdict : whether a branch was accepted, was known already, or was refused
    branch : index of the branch in its diagram; None if it was refused
    why : why it was refused
    """

    reason: str
    verdict: Decision
    branch: int | None = None
    why: str = ""

    def __str__(self) -> str:
        which = "" if self.branch is None else f" (branch {self.branch + 1})"
        return f"{self.verdict.value}{which}: {self.reason}{f': {self.why}' if self.why else ''}"


@dataclass(frozen=True, eq=False)
class Bifurcation(MeasuredEvent):
    """A located event on a branch.

    Attributes
    ----------
    kind : Kind
        What it is.
    params : dict
        Parameters at which it happens.
    orbit : Orbit
        The orbit there, of the branch's signature.
    tests : tuple of Test
        For sliding events the margins that vanish; several if events coincide (a group).
    position : float
        Arclength on the branch.
    stable_before, stable_after : bool or None
        Stability of the branch at smaller and at larger values of the parameter, whichever way it was traced;
        None if not computed or if the branch has no such side. At a fold (SN) both sides lie at the same
        values: there it is the order of the branch.
    located : bool
        False if a test changed sign but Newton failed on the way to the location: the parameters are
        those of the last solved point before it.
    bound : float or callable
        The accuracy, or what returns it when it is asked for.
    proposals : tuple of Proposal
        What an exploration proposed to follow it, in order, and what became of it.
    parameter : str
        The parameter along which it was located; empty on a curve in two.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> fold = cf.continue_orbit(orbit, "Omega", (0.5, 0.6)).bifurcations[0]
    >>> fold.label, fold.kind.name, round(fold.params["Omega"], 9)
    ('SN_1a', 'SN', 0.541912817)
    """

    kind: Kind
    params: dict[str, float]
    orbit: Orbit
    tests: tuple[EventFunction, ...] = ()
    position: float = 0.0
    stable_before: bool | None = None
    stable_after: bool | None = None
    located: bool = True
    bound: float | Callable[[], float] = ACCURACY
    proposals: tuple[Proposal, ...] = ()
    parameter: str = ""

    @cached_property
    def accuracy(self) -> float:
        """How well the parameter is located, relative to the range.

        A bound of what rounding does to the equations of the event
        (:mod:`contfric.continuation.accuracy.rounding`).
        """
        return self.bound() if callable(self.bound) else self.bound

    @property
    def group(self) -> int:
        """Number of places of the whole orbit at which the event happens at once."""
        return max(1, len(self.tests)) * (2 if self.orbit.system.half and self.tests else 1)

    @cached_property
    def symmetric(self) -> bool:
        """Whether the solution at the event is its own mirror image, whatever the itineraries that meet."""
        if self.orbit.symmetric:
            return True
        if self.orbit.model.symmetry is None:
            return False
        apart = self.outline.apart_from_image
        # accuracies cost: they are asked for last
        if not _SYMMETRIC <= apart < _ASYMMETRIC:
            return apart < _SYMMETRIC
        return bool(apart < max(self.accuracy, min(_NEARLY_SYMMETRIC, self.accuracy**0.5)))

    @property
    def outline(self) -> Outline:
        """The slides of the solution at the event, whatever itinerary it was reached with."""
        return self.orbit.outline

    @property
    def label(self) -> str:
        """Name in the manner of the reference: ``CS_s``, ``SN_1a``."""
        if self.tests and self.kind is not Kind.T:
            return f"{self.kind.value}_{'s' if self.symmetric else 'a'}"
        return self.kind.value if self.kind is Kind.T else f"{self.kind.value}_{self.orbit.name}"

    @property
    def meaning(self) -> str:
        """What happens, in words: that of its kind, but only where something slides it is a sliding."""
        model, itinerary = self.orbit.model, self.orbit.system.itinerary
        if model.wraps & {s for t in self.tests for s in (t.surface, itinerary[t.segment][1])}:
            return "a joint where an angle begins a new turn"
        chosen = filter(None, (chosen_at(self.orbit.system, test) for test in self.tests))
        if reset := next(chosen, ""):
            return f"another mode is chosen at the reset '{reset}'"
        entered = filter(None, (entered_at(self.orbit.system, test) for test in self.tests))
        if mode := next(entered, ""):
            return f"grazing: a solution that crosses stays in '{mode}', and the map jumps"
        thrown = filter(None, (thrown_at(self.orbit, test) for test in self.tests))
        if surface := next(thrown, ""):
            return f"grazing: the reset at '{surface}' leads to another place, and the map jumps"
        return meaning_of(self.kind, model, {test.surface for test in self.tests})

    def certify(self, parameter: str = "") -> EventCertificate:
        """Prove the event to 30 digits in its parameter; which one must be said of a saved event.

        Raises
        ------
        ParameterError
            If proofs are not offered for the model, or the parameter is not known.
        """
        need_flint()
        from contfric.certify.events import certify_event

        return certify_event(self, parameter)

    def mirror(self) -> Bifurcation:
        """Return the mirror image, at the same parameters."""
        symmetry = self.orbit.model.symmetry
        assert symmetry is not None
        tests = tuple(
            altered(t, surface=symmetry.surfaces.get(t.surface, t.surface)) for t in self.tests
        )
        return altered(self, orbit=self.orbit.mirror(), tests=tests)

    def __repr__(self) -> str:
        values = ", ".join(f"{k}={v:.12g}" for k, v in self.params.items())
        return f"<{self.label}: {values}{'' if self.located else ' (not located)'}>"


def _parts(bifurcation: Bifurcation) -> tuple[object, ...]:
    """Return what an event is stored as: with its accuracy, and not with what computes that."""
    plain = altered(bifurcation, bound=bifurcation.accuracy)
    return tuple(getattr(plain, f.name) for f in fields(plain))


made_of(Bifurcation, _parts, Bifurcation)


def meaning_of(kind: Kind, model: Model, surfaces: Set[str]) -> str:
    """Return what happens at an event on surfaces of a model: a sliding only where something slides."""
    if surfaces & model.fixed_sides.keys():
        return "incomplete chatter"
    if kind is Kind.CS and not any(mode.sliding for mode in model.modes):
        return "corner: two surfaces are met at once"
    if kind is not Kind.GS:
        return kind.meaning
    resets = [model.reset_by_surface[s] for s in surfaces if s in model.reset_by_surface]
    if any(reset.stays for reset in resets):
        return "grazing impact"
    return kind.meaning if any(model.rests_on(s) for s in surfaces) else "grazing"


class LateText:
    """A text of a data class, given as it is or as what returns it, which is called when it is asked for."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: object, owner: type) -> str:
        """Return the text; the default of the class is empty."""
        if instance is None:
            return ""
        own = vars(instance)
        if callable(own[self._name]):
            own[self._name] = own[self._name]()
        return str(own[self._name])

    def __set__(self, instance: object, text: str | Callable[[], str]) -> None:
        vars(instance)[self._name] = text


@dataclass(frozen=True, eq=False)
class End:
    """Why a branch ends, with the event if there is one."""

    reason: EndReason
    message: LateText = LateText()
    bifurcation: Bifurcation | None = field(default=None, repr=False)

    def __str__(self) -> str:
        return self.message or self.reason.value
