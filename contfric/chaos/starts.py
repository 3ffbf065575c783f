"""Initial states of solutions: a given state, one that depends on the parameters, or several."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from contfric.base.arrays import FloatArray
from contfric.errors import ParameterError, shown, whole_number
from contfric.models.definition import Model
from contfric.simulation.starts import displaced, with_clocks, within_a_turn
from contfric.simulation.time_scale import has_clock

#: A state, shape (n,), several, shape (k, n), or a function of the parameters that returns either.
StateLike: TypeAlias = ArrayLike | Callable[[Mapping[str, float]], ArrayLike]


def spread_points(count: int, n: int) -> FloatArray:
    """Return points that fill the cube from -1 to 1 evenly, however many, shape (count, n).

    The additive recurrence of the generalised golden ratio: the root of ``g^(n+1) = g + 1`` and its
    powers (M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018).

    Examples
    --------
    >>> spread_points(2, 1).round(3).tolist()
    [[-0.764], [0.472]]
    """
    root = 2.0
    for _ in range(60):  # a contraction by less than a half
        root = (1.0 + root) ** (1.0 / (n + 1))
    steps = root ** -np.arange(1.0, n + 1.0)
    return 2.0 * np.mod(0.5 + np.outer(np.arange(1, count + 1), steps), 1.0) - 1.0


def default_states(model: Model, params: Mapping[str, float], count: int) -> FloatArray:
    """Return initial states, shape (count, n): displaced from rest, then evenly in the model's region."""
    width: FloatArray = np.asarray(model.spread(params), dtype=np.float64)
    states = np.zeros((count, len(width)))
    states[0, 0] = width[0]  # as simulations start
    low, high = model.region(model.vector(params))
    if model.resets or model.ranges is not None:
        states[0] = displaced(model, model.vector(params))
    states[1:] = 0.5 * (low + high) + width * spread_points(count - 1, len(width))
    return states


def number_of_starts(model: Model, state: StateLike | None, starts: int, example: object) -> int:
    """Return how many solutions start at each set of parameters.

    Raises
    ------
    ParameterError
        If both or neither are valid.
    """
    whole_number("starts", starts, least=1)
    if state is None:
        return starts
    if starts != 1:
        raise ParameterError(
            f"starts = {starts} draws initial states by itself: leave out state=, or give several "
            "states, shape (starts, n)"
        )
    assert isinstance(example, Mapping)
    return len(given_states(model, state, example))


def given_states(model: Model, state: StateLike, params: Mapping[str, float]) -> FloatArray:
    """Return the states that a user gave, shape (k, n).

    Raises
    ------
    ParameterError
        If they are no states of the model.
    """
    try:
        given = state(params) if callable(state) else state
    except TypeError as error:
        raise ParameterError(
            f"state is a function of the parameters, a mapping by their names: {error}"
        ) from error
    try:
        states = np.array(given, dtype=np.float64, ndmin=2)
    except (TypeError, ValueError, OverflowError):
        states = np.empty((0, 0))
    n = len(model.states)
    if states.ndim == 2 and states.shape[1] < n and has_clock(model):
        vector = model.vector(params)
        states = np.array([with_clocks(model, vector, row) for row in states])
    if states.ndim != 2 or states.shape[1] != n or not len(states) or not np.isfinite(states).all():
        raise ParameterError(
            f"a state of '{model.name}' is {n} finite numbers ({', '.join(model.states)}), several "
            f"states are rows of them; got {shown(given)}"
        )
    return within_a_turn(model, model.vector(params), states) if model.wraps else states
