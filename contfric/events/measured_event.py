"""The contacts at which an event happens, and derivatives of its location by the other parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

from contfric.base.shown import Shown

if TYPE_CHECKING:
    from contfric.events.bifurcation import Bifurcation
    from contfric.orbit.gradient import Gradient


class MeasuredEvent(Shown):
    """Contacts and derivatives of an event: a part of :class:`contfric.events.bifurcation.Bifurcation`."""

    @property
    def contacts(self) -> tuple[str, ...]:
        """Contacts of a structure at which the event happens; none at smooth events and in other models.

        Examples
        --------
        >>> import contfric as cf
        >>> orbit = cf.find_orbit("blade-damper")
        >>> branch = cf.continue_orbit(orbit, "W", (0.4, 1.0))
        >>> {event.contacts for event in branch.bifurcations if event.tests}
        {('damper',)}
        """
        from contfric.bvp.system import Margin
        from contfric.models.mode_domains import is_section
        from contfric.quantities.inside import laws_of

        event = cast("Bifurcation", self)
        model, itinerary = event.orbit.model, event.orbit.system.itinerary
        met = {test.surface for test in event.tests}
        for test in event.tests:  # what ends a segment where another surface is met belongs to it
            mode, exit_ = itinerary[test.segment]
            if test.margin is Margin.JOINT and not is_section(model, mode, exit_):
                met.add(exit_)
        surfaces = met | {
            s.name for s in model.surfaces if s.observable in met
        }  # a tangency has one
        names = [law.name for law in laws_of(model)]
        ends = [
            (name, (f"{name}+", f"{name}-")) for name in names
        ]  # limits have more after the sign
        return tuple(
            name
            for name, own in ends
            if name in surfaces or any(s.startswith(own) for s in surfaces)
        )

    def gradient(self, parameter: str | None = None) -> Gradient:
        """Return the derivatives of the parameter at which the event happens by every other parameter.

        Exact: the implicit function theorem on the equations of the orbit and the condition of the event,
        as its curves in two parameters solve them.

        Parameters
        ----------
        parameter : str, optional
            The parameter whose value is differentiated; that of the branch by default. An event that was read
            from a file does not know it.

        Returns
        -------
        Gradient
            A mapping of the other parameters to derivatives.

        Raises
        ------
        ParameterError
            If the event has no curve of its own, such as NS, or one on a bridge.
        ConvergenceError
            If its curve has no unique direction there.

        Examples
        --------
        >>> import contfric as cf
        >>> orbit = cf.solve_orbit("coulomb", "1a", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
        >>> fold = cf.continue_orbit(orbit, "Omega", (0.4, 0.6)).bifurcations[-2]
        >>> sorted(fold.gradient())
        ['S', 'S0', 'h', 'zeta']
        """
        from contfric.curves.sensitivity.gradient import event_gradient

        return event_gradient(cast("Bifurcation", self), parameter)
