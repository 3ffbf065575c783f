"""Points of codimension two on a curve, and why curves end."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from contfric.base.shown import Shown
from contfric.bvp.system import EventFunction
from contfric.events.bifurcation import Bifurcation, Kind
from contfric.orbit.orbit import Orbit


class CodimTwo(str, Enum):
    """Kinds of points of codimension two; the text says what happens there.

    Examples
    --------
    >>> import contfric as cf
    >>> cf.CodimTwo.R1.value
    'strong resonance 1:1, two multipliers 1'
    """

    CUSP = "cusp: two folds meet, the parameters turn back"
    GPD = "degenerate period doubling: a fold curve of doubled orbits begins"
    DBP = "degenerate symmetry breaking: a fold curve of asymmetric orbits begins (SN-BP)"
    R1 = "strong resonance 1:1, two multipliers 1"
    R2 = "strong resonance 1:2, two multipliers -1"
    R3 = "strong resonance 1:3, two multipliers exp(+-2 pi i / 3)"
    R4 = "strong resonance 1:4, two multipliers i and -i"
    SN_PD = "fold and period doubling at once"
    SN_BP = "fold and symmetry breaking at once"
    TURNOVER = "the load at the stop stands still: CS and SS change places, an AS begins"
    MEETS = "two events at once"


class CurveEndReason(str, Enum):
    """Why a curve ends; the text says it to the user."""

    RANGE = "end of the range asked for"
    LIMIT = "physical limit of the parameters"
    CLOSED = "the curve is closed"
    MEETS = "another event: beyond it the orbits are not admissible"
    START = "the curve starts here, at a point of codimension two of another one"
    BIRTH = "the fold merges with the branch point or doubling that it comes from"
    STEP = "the step became too small: Newton does not converge"
    LOST = "what the curve follows does not exist beyond this point"
    POINTS = "the largest number of points was reached (max_points)"
    UNBOUNDED = "the amplitude grows without bound: resonance"
    PERIOD = "the period grows without bound: the orbit comes to an equilibrium (homoclinic), or slows down"
    BROKEN = "the orbit is not finite beyond this point"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True, eq=False)
class SpecialPoint(Shown):
    """A point of codimension two on a curve.

    Attributes
    ----------
    kind : CodimTwo
        What it is.
    name : str
        ``"CUSP"``, ``"GPD"``, or the kinds that meet, such as ``"SN-CS"``.
    params : dict
        Parameters at which it is.
    orbit : Orbit
        The orbit there, of the curve's signature.
    meets : Kind or None
        The other event, where two meet.
    tests : tuple of Test
        The margins that vanish with it, for a sliding event.
    position : float
        Arclength on the curve.
    located : bool
        False where conditions degenerate: another bracket of the change of sign closes somewhere else,
        Newton's method fails there, or it is a physical limit.
    """

    kind: CodimTwo
    name: str
    params: dict[str, float]
    orbit: Orbit
    meets: Kind | None = None
    tests: tuple[EventFunction, ...] = ()
    position: float = 0.0
    located: bool = True

    def bifurcation(self) -> Bifurcation | None:
        """Return the other event as a start of its own curve; None if no other one meets here."""
        if self.meets is None:
            return None
        return Bifurcation(self.meets, self.params, self.orbit, self.tests)

    def __repr__(self) -> str:
        values = ", ".join(f"{k}={v:.12g}" for k, v in self.params.items())
        return f"<{self.name} of {self.orbit.name}: {values}{'' if self.located else ' (not located)'}>"


@dataclass(frozen=True, eq=False)
class CurveEnd:
    """Why a curve ends, with the point of codimension two if there is one."""

    reason: CurveEndReason
    message: str = ""
    special: SpecialPoint | None = None

    def __str__(self) -> str:
        return self.message or self.reason.value
