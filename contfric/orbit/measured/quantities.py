"""Quantities of an orbit by name, and their derivatives with respect to the parameters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, cast

from contfric.base.shown import Shown

if not TYPE_CHECKING:
    from contfric.base.attributes import cached_property
if TYPE_CHECKING:
    from functools import cached_property

    from contfric.base.arrays import FloatArray
    from contfric.orbit.canonical.slides import Outline
    from contfric.orbit.functionals.integrals import Integrals
    from contfric.orbit.gradient import Gradient
    from contfric.orbit.orbit import Orbit
    from contfric.orbit.positions.resting import RestingPosition
    from contfric.quantities.motion import Directions
    from contfric.quantities.registry import QuantityLike
    from contfric.quantities.tape import Tape


class MeasuredOrbit(Shown):
    """The quantities of an orbit: a part of :class:`contfric.orbit.orbit.Orbit`."""

    @cached_property
    def outline(self) -> Outline:
        """The slides of the solution, whatever itinerary it is solved with."""
        from contfric.orbit.canonical.slides import outline_of

        return outline_of(cast("Orbit", self))

    @cached_property
    def resting(self) -> tuple[RestingPosition, ...]:
        """Where the contacts rest that never slip along the orbit, and where else they may.

        Each is a :class:`contfric.RestingPosition`; ``resting_at`` returns the orbit at another one.
        """
        from contfric.orbit.positions.resting import resting_of

        return resting_of(cast("Orbit", self))

    def resting_at(self, at: Mapping[str, float]) -> Orbit:
        """Return the orbit at the same parameters whose contacts rest elsewhere.

        Parameters
        ----------
        at : position by contact, such as ``{"brake": 0.12}``; all others keep theirs

        Raises
        ------
        ParameterError
            If a contact slips along the orbit, or cannot rest there.
        """
        from contfric.orbit.positions.resting import resting_at

        return resting_at(cast("Orbit", self), at)

    def extreme(
        self, observable: int, inside: int, sign: float
    ) -> tuple[float, FloatArray, FloatArray] | None:
        """Return the extremum of an observable with its derivatives by the joints and by the parameters.

        None where several values are the extremum.

        Parameters
        ----------
        observable : int
            Which; -1 for the first state where its extrema are at joints.
        inside : int
            Whether it may be extreme inside of segments.
        sign : float
            1 for the largest value, -1 for the least.
        """
        from contfric.orbit.functionals.peak import extreme_with_derivatives

        return extreme_with_derivatives(cast("Orbit", self), observable, inside, sign)

    def integrals(self, tape: Tape, rate: float, directions: Directions | None) -> Integrals | None:
        """Return integrals of expressions over the orbit, with their derivatives in some directions.

        None where an expression has a kink inside of a segment, or nothing resolves it: it is then measured
        by :mod:`contfric.quantities.panels`.

        Parameters
        ----------
        tape : the expressions
        rate : of the waves in them, so many in the period of the orbit; 0 without waves
        directions : how the orbit moves; None where no derivatives are wanted
        """
        from contfric.orbit.functionals.integrals import integrals_of

        return integrals_of(cast("Orbit", self), tape, rate, directions)

    def quantity(self, name: QuantityLike) -> Any:
        """Return a quantity: by its name, as an expression, or as a function of an orbit.

        Integrals are exact to the rounding of the flow, extrema are those of stationary points; nothing is
        sampled. The names are those of :func:`contfric.quantity_names`.

        Parameters
        ----------
        name : str or callable
            Such as ``"x_max"``, ``"energy"`` (where the model declares it), ``"rms(v)"``,
            ``"amplitude(x, 3)/amplitude(x, 1)"``, or a function that takes an orbit and returns a number.

        Raises
        ------
        ParameterError
            If there is no such quantity.

        Examples
        --------
        >>> import contfric as cf
        >>> orbit = cf.solve_orbit("coulomb", "1a", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
        >>> round(orbit.quantity("rms(v)"), 6), round(orbit.quantity("sticking"), 6)
        (0.523284, 0.091149)
        """
        from contfric.quantities.measure import of_orbit
        from contfric.quantities.registry import quantity_of

        orbit = cast("Orbit", self)
        return of_orbit(quantity_of(name, orbit.model), orbit)

    def gradient(self, name: QuantityLike) -> Gradient:
        """Return the derivatives of a quantity by every parameter, along orbits of this signature.

        Exact: by the implicit function theorem on the solved equations, and the flow's own derivatives.

        Parameters
        ----------
        name : str or callable
            A quantity by its name or as an expression. Of a function of an orbit the derivatives are
            differences, along the exact derivatives of the orbit.

        Returns
        -------
        Gradient
            A mapping of parameters to derivatives. At a kink of the quantity, or at an event of the orbit,
            they are those of one side, and ``notes`` says so.

        Raises
        ------
        ParameterError
            If there is no such quantity, or it has no derivatives.
        ConvergenceError
            If the orbit is not solved, or is at a fold.

        Examples
        --------
        >>> import contfric as cf
        >>> orbit = cf.solve_orbit("coulomb", "1a", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
        >>> round(orbit.gradient("energy")["S"], 6)
        5.328667
        """
        from contfric.orbit.gradient import gradient_of

        return gradient_of(cast("Orbit", self), name)

    def gradients(self, names: Iterable[QuantityLike]) -> dict[str, Gradient]:
        """Return the derivatives of several quantities, each as :meth:`gradient` returns it, at less cost.

        Integrals are computed in one pass: they agree with those of each quantity alone to rounding.

        Parameters
        ----------
        names : quantities by their names or as expressions

        Raises
        ------
        ParameterError
            If there is no such quantity, or one has no derivatives.
        ConvergenceError
            If the orbit is not solved, or is at a fold.

        Examples
        --------
        >>> import contfric as cf
        >>> orbit = cf.solve_orbit("coulomb", "1a", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
        >>> found = orbit.gradients(["energy", "rms(v)"])
        >>> round(found["energy"]["S"], 6)
        5.328667
        """
        from contfric.orbit.gradient import gradients_of

        return gradients_of(cast("Orbit", self), names)
