"""Events on a branch of equilibria: folds, branch points, Hopf points, boundary equilibria."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

from contfric.base.shown import Shown
from contfric.equilibria.boundary import Unfolding
from contfric.equilibria.hopf import Centre
from contfric.equilibria.result import Equilibrium

if TYPE_CHECKING:
    from contfric.orbit.orbit import Orbit


class EquilibriumKind(str, Enum):
    """Kinds of events of equilibria."""

    SN = "SN"
    BP = "BP"
    H = "H"
    BE = "BE"


@dataclass(frozen=True, eq=False)
class EquilibriumEvent(Shown):
    """An event of a branch of equilibria.

    Attributes
    ----------
    kind : EquilibriumKind
    parameter : name of the parameter along the branch
    equilibrium : Equilibrium
        Where it happens.
    stable_before, stable_after : bool or None
        Stability on the branch before and after it, in the order of the points.

    Examples
    --------
    >>> import contfric as cf
    >>> rest = cf.find_equilibria("popp", {"F": 0.0})[0]
    >>> hopf = cf.continue_equilibrium(rest, "a2", (0.3, 0.8)).events[0]
    >>> hopf.kind.value, hopf.parameter
    ('H', 'a2')
    """

    kind: EquilibriumKind
    parameter: str
    equilibrium: Equilibrium
    stable_before: bool | None
    stable_after: bool | None

    @property
    def params(self) -> dict[str, float]:
        """All parameters by name."""
        return self.equilibrium.params

    @property
    def value(self) -> float:
        """The parameter at which it happens."""
        return self.params[self.parameter]

    @property
    def label(self) -> str:
        """The kind, with what tells it from others of its kind."""
        return self.kind.value

    @property
    def meaning(self) -> str:
        """One line for a legend or a table."""
        return _MEANINGS[self.kind]

    def cycle(self) -> Orbit:
        """Return a periodic orbit that is born here, solved for.

        Raises
        ------
        ConvergenceError
            If none is, or none is found.
        """
        from contfric.errors import ConvergenceError

        raise ConvergenceError(f"no cycle is born at a {self.meaning}")

    def __repr__(self) -> str:
        return f"<{self.label} at {self.parameter} = {self.value:.10g}: {self.meaning}>"


_MEANINGS = {
    EquilibriumKind.SN: "fold of equilibria (saddle-node)",
    EquilibriumKind.BP: "branch point of equilibria (pitchfork by symmetry, or transcritical)",
    EquilibriumKind.H: "Hopf point",
    EquilibriumKind.BE: "boundary equilibrium",
}


@dataclass(frozen=True, eq=False, repr=False)
class HopfPoint(EquilibriumEvent):
    """A Hopf point.

    Attributes
    ----------
    centre : Centre
        Its normal form: ``frequency``, first Lyapunov coefficient ``lyapunov``, ``rate`` of the real part.

    Examples
    --------
    >>> import contfric as cf
    >>> rest = cf.find_equilibria("popp", {"F": 0.0})[0]
    >>> hopf = cf.continue_equilibrium(rest, "a2", (0.3, 0.8)).events[0]
    >>> type(hopf).__name__, hopf.centre.lyapunov < 0
    ('HopfPoint', True)
    """

    centre: Centre

    @property
    def frequency(self) -> float:
        """Angular frequency of the cycle that is born."""
        return self.centre.frequency

    @property
    def lyapunov(self) -> float:
        """First Lyapunov coefficient: negative where cycles are stable within the centre manifold."""
        return self.centre.lyapunov

    @property
    def label(self) -> str:
        """The kind, with + where cycles are unstable and - where they are stable."""
        sign = {-1: "-", 0: "0", 1: "+"}[(self.lyapunov > 0) - (self.lyapunov < 0)]
        return f"H{sign}"

    @property
    def meaning(self) -> str:
        """One line for a legend or a table."""
        kind = {-1: "supercritical", 0: "degenerate", 1: "subcritical"}
        return f"Hopf point, {kind[(self.lyapunov > 0) - (self.lyapunov < 0)]}"

    def cycle(self, amplitude: float | None = None) -> Orbit:
        """Return a small cycle that is born here, stable or not, solved for at a parameter near the event.

        Parameters
        ----------
        amplitude : float, optional
            Of the cycle along the unit vector of the centre subspace; by default a tenth of what the surfaces
            around allow.

        Raises
        ------
        ConvergenceError
            If it is degenerate, if no section of the model cuts the cycle, or if no amplitude leads to one.
        """
        from contfric.equilibria.cycles import cycle_of_hopf

        return cycle_of_hopf(self, amplitude)


@dataclass(frozen=True, eq=False, repr=False)
class BoundaryPoint(EquilibriumEvent):
    """A boundary equilibrium: an equilibrium on a surface that bounds the region of its mode.

    Attributes
    ----------
    surface : str
        The surface or kink that it reaches.
    unfolding : Unfolding
        Persistence, non-smooth fold, or alone.
    partner : str
        Mode of the equilibrium that meets it; empty without one.
    product : float
        The number whose sign tells persistence (positive) from a non-smooth fold; nan where it has no
        meaning.
    """

    surface: str
    unfolding: Unfolding
    partner: str = ""
    product: float = float("nan")

    @property
    def label(self) -> str:
        """The kind and the surface."""
        return f"BE_{self.surface}"

    @property
    def meaning(self) -> str:
        """One line for a legend or a table."""
        return f"boundary equilibrium, {self.unfolding.value}"

    def cycle(self, distance: float | None = None) -> Orbit:
        """Return a small cycle that is born here, found by simulations on both sides of the event.

        Parameters
        ----------
        distance : float, optional
            Of the parameter from the event; by default a hundredth of its value there, 0.01 at 0.

        Raises
        ------
        ConvergenceError
            If no attracting cycle shrinks to the equilibrium as the parameter comes to the event.
        """
        from contfric.equilibria.cycles import cycle_of_boundary

        return cycle_of_boundary(self, distance)
