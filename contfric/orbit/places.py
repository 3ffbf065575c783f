"""Where contacts are to rest, as a file and a user say: how a simulation begins, and its orbit is moved."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

from numpy.typing import ArrayLike

from contfric.errors import ConvergenceError, ParameterError
from contfric.models.definition import Model
from contfric.orbit.orbit import Orbit


class Places:
    """Positions at which contacts rest that never slip.

    Parameters
    ----------
    at : what a user gives; it comes before what the model's file says
    """

    def __init__(self, model: Model, params: dict[str, float], at: Mapping[str, float] | None):
        from contfric.orbit.kept_positions import checked_positions, stated_positions

        self.model, self.params = model, params
        self.given = {} if at is None else checked_positions(model, at)
        self.stated = {
            k: v for k, v in stated_positions(model, params).items() if k not in self.given
        }

    def begin(self, state: ArrayLike | None) -> ArrayLike | None:
        """Return the state that a simulation starts from: the contacts at their places, and at rest."""
        if not (self.given or self.stated):
            return state
        from contfric.orbit.kept_positions import stuck_at
        from contfric.orbit.starts import checked_state

        y = checked_state(self.model, self.model.vector(self.params), state)
        return stuck_at(self.model, y, self._all)

    def put(self, orbit: Orbit) -> Orbit:
        """Return an orbit with its contacts at their places; what slips has none, by a file.

        Raises
        ------
        ParameterError
            If a contact for which the user gives a place slips, or cannot be there.
        ConvergenceError
            If one cannot be where the file says.
        """
        if not (self.given or self.stated):
            return orbit
        from contfric.orbit.kept_positions import positions_of
        from contfric.orbit.resting_positions import resting_at

        kept = [p.contact for p in positions_of(orbit)]
        stated = {name: value for name, value in self.stated.items() if name in kept}
        try:
            return resting_at(orbit, {**stated, **self.given})
        except ParameterError as error:
            if self.given:
                raise
            raise ConvergenceError(f"{error} ('at' of the model's file)", orbit) from None

    @cached_property
    def _all(self) -> dict[str, float]:
        return {**self.stated, **self.given}
