"""Conserved positions of an orbit: in words, with gradients, and set to given values."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache, cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from contfric.base.arrays import FloatArray
from contfric.bvp.conserved import conserved
from contfric.errors import ConvergenceError, ParameterError, did_you_mean, real_number
from contfric.models.definition import Model
from contfric.models.described.evaluate import Evaluator, floats
from contfric.orbit.orbit import Orbit

if TYPE_CHECKING:
    from contfric.models.structures.contact_laws import ContactLaws
    from contfric.orbit.orbit import Orbit

#: Directions that differ by less are the same: a combination of rates whose zeros are known to 1e-9.
_SAME = 1e-7


class Position(NamedTuple):
    """A linear function of the states that an orbit keeps.

    Attributes
    ----------
    contact : the contact that it belongs to; empty in a model without contacts
    text : the function, in the states' names
    weights : its gradient, shape (n,)
    """

    contact: str
    text: str
    weights: FloatArray

    def value(self, orbit: Orbit) -> float:
        """Return the value along an orbit."""
        return float(self.weights @ orbit.joints[0, 1:])

    def said(self, orbit: Orbit) -> str:
        """Return in words where it is along an orbit."""
        return at_rest(self.contact or self.text, self.text, self.value(orbit))


def at_rest(contact: str, text: str, value: float) -> str:
    """Return in words what is kept at a value, and whose it is.

    Examples
    --------
    >>> at_rest("brake", "q1", 0.12)
    "contact 'brake' rests at q1 = 0.12"
    """
    whose = f"contact '{contact}' rests at " if contact != text else ""
    return f"{whose}{text} = {value:.6g}"


def positions_of(orbit: Orbit) -> tuple[Position, ...]:
    """Return what an orbit keeps: contacts that never slip along it; elsewhere functions of states."""
    still = conserved(orbit.model, orbit.itinerary)
    if not len(still):
        return ()
    named = places_of(orbit.model)
    if named:
        return tuple(p for p in named if _is_kept(p.weights, still))
    return tuple(
        Position(text := _text_of(row, orbit.model.states), text, row) for row in _reduced(still)
    )


def checked_positions(model: Model, at: Mapping[str, float]) -> dict[str, float]:
    """Return positions that a user gave.

    Raises
    ------
    ParameterError
        If one is no number, or of what has no position.
    """
    known = [p.contact for p in places_of(model)]
    given: object = at  # whatever the user gave
    if not isinstance(given, Mapping):
        name = known[0] if known else "x"
        raise ParameterError(f"'at' is a mapping such as {{{name!r}: 0.1}}, got {given!r}")
    for name in at:
        if known and name not in known:
            raise ParameterError(
                f"model '{model.name}' has no contact '{name}' with a position of rest"
                f"{did_you_mean(name, known)}"
            )
    return {name: real_number(f"at {name}", value) for name, value in at.items()}


def stated_positions(model: Model, params: Mapping[str, float]) -> dict[str, float]:
    """Return where the model's file says that contacts rest (``at``)."""
    laws = [law for law in _laws(model) if law.at]
    return {law.name: float(_evaluator(model).value(law.at, params)) for law in laws}


def stuck_at(model: Model, y: FloatArray, at: Mapping[str, float]) -> FloatArray:
    """Return a state whose contacts are at some positions, friction among them at rest: the nearest one."""
    n = len(model.states)
    rows, values = [], []
    for position in places_of(model):
        if position.contact in at:
            row = np.where(
                [name == position.contact for name in model.states], 0.0, position.weights
            )
            own = position.weights - row  # the stretch of a Jenkins element stays
            rows.append(row)
            values.append(at[position.contact] - float(own @ y))
            if not np.any(own):
                count = (n - len([p for p in places_of(model) if p.contact in model.states])) // 2
                rows.append(np.roll(row, count))
                values.append(0.0)
    if not rows:
        return y
    matrix = np.array(rows)
    moved: FloatArray = y + np.linalg.lstsq(matrix, np.array(values) - matrix @ y, rcond=None)[0]
    return moved


def _is_kept(weights: FloatArray, still: FloatArray) -> bool:
    apart = weights - still.T @ (still @ weights)
    return bool(np.linalg.norm(apart) < _SAME * np.linalg.norm(weights))


def _reduced(still: FloatArray) -> FloatArray:
    """Return a basis of some rows that is reduced: each has a 1 where all others have 0.

    Examples
    --------
    >>> _reduced(np.array([[0.6, -0.8, 0.0]])).round(3)
    array([[ 1.   , -1.333,  0.   ]])
    """
    rows = still.copy()
    pivots: list[int] = []
    for k in range(len(rows)):
        free = np.abs(rows[k:]).max(axis=0)
        free[pivots] = 0.0
        pivot = int(np.flatnonzero(free > 0.5 * free.max())[0])
        top = k + int(np.argmax(np.abs(rows[k:, pivot])))
        rows[[k, top]] = rows[[top, k]]
        rows[k] /= rows[k, pivot]
        others = np.arange(len(rows)) != k
        rows[others] -= np.outer(rows[others, pivot], rows[k])
        pivots.append(pivot)
    rows[np.abs(rows) < _SAME] = 0.0
    return rows[np.argsort(pivots)]


def _text_of(row: FloatArray, states: tuple[str, ...]) -> str:
    """Return a linear function as text.

    Examples
    --------
    >>> _text_of(np.array([1.0, 0.0, -0.5]), ("x", "v", "z"))
    'x - 0.5*z'
    """
    terms = [
        ("-" if w < 0.0 else "+", name if abs(abs(w) - 1.0) < _SAME else f"{abs(w):.6g}*{name}")
        for w, name in zip(row.tolist(), states, strict=True)
        if w != 0.0
    ]
    return " ".join(f"{sign} {term}" for sign, term in terms).removeprefix("+ ")


@cache
def places_of(model: Model) -> tuple[Position, ...]:
    """Return the positions that the contacts of a model may keep."""
    value, params = _evaluator(model).value if _laws(model) else None, model.defaults
    found, n, units = [], len(model.states), dict(model.units)
    for law in _laws(model):
        if value is None or not law.rest:
            continue
        rest, zero = law.rest, float(value(law.rest, params, 0.0, [0.0] * n))
        weights = [float(value(rest, params, 0.0, row)) - zero for row in np.eye(n).tolist()]
        text = _text_of(
            np.array(weights) / np.array([units.get(s, 1.0) for s in model.states]), model.states
        )
        found.append(Position(law.name, text, np.array(weights)))
    return tuple(found)


def _laws(model: Model) -> tuple[ContactLaws, ...]:
    if not model.definition:  # which imports nothing
        return ()
    from contfric.quantities.inside import laws_of

    return laws_of(model)


@cache
def _evaluator(model: Model) -> Evaluator[float]:

    return floats(model.description)


class Places:
    """Positions at which contacts rest that never slip.

    Parameters
    ----------
    at : what a user gives; it comes before what the model's file says
    """

    def __init__(self, model: Model, params: dict[str, float], at: Mapping[str, float] | None):
        self.model, self.params = model, params
        self.given = {} if at is None else checked_positions(model, at)
        self.stated = {
            k: v for k, v in stated_positions(model, params).items() if k not in self.given
        }

    def begin(self, state: ArrayLike | None) -> ArrayLike | None:
        """Return the state that a simulation starts from: the contacts at their places, and at rest."""
        if not (self.given or self.stated):
            return state
        from contfric.simulation.starts import checked_state

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
        from contfric.orbit.positions.resting import resting_at

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
