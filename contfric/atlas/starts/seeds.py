"""Seeds: attractors that simulations converge to, as starts of families that nothing else reaches."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.errors import AperiodicError, ConvergenceError, ParameterError, shown, whole_number
from contfric.models.definition import Model
from contfric.orbit.finding.find import find_orbit
from contfric.orbit.orbit import Orbit
from contfric.simulation.starts import signs_at

#: Periods after which a seed that has not converged is given up: there are many seeds, and attractors that
#: take longer are nearly marginal.
_LONGEST = 2000


@dataclass(frozen=True)
class Seeds:
    """Simulations that are asked for orbits.

    Attributes
    ----------
    values : int
        Values of the parameter, evenly over its range (the middles of as many parts).
    states : int
        Initial conditions at each value: the model's own displaced one, then random ones.
    seed : int
        Of the random numbers; the same seed gives the same starts.

    Raises
    ------
    ParameterError
        If a number is not a whole one >= 1 (seed: >= 0).

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> found = cf.explore(orbit, "Omega", (0.5, 0.55), seeds=cf.Seeds(values=2))
    >>> len(found.branches)
    4
    """

    values: int = 20
    states: int = 3
    seed: int = 0

    def __post_init__(self) -> None:
        whole_number("values", self.values, least=1)
        whole_number("states", self.states, least=1)
        whole_number("seed", self.seed, least=0)

    @staticmethod
    def given(seeds: object) -> Seeds | None:
        """Return what a user gave for seeds: some, or None.

        Raises
        ------
        ParameterError
            If it is something else.
        """
        if seeds is not None and not isinstance(seeds, Seeds):
            raise ParameterError(
                f"seeds are given as Seeds(values=20, states=3), or None; got {shown(seeds)}"
            )
        return seeds

    @property
    def count(self) -> int:
        """Number of simulations."""
        return self.values * self.states


def attractors(
    model: Model,
    vector: FloatArray,
    parameter: str,
    bounds: tuple[float, float],
    seeds: Seeds,
    max_periods: int,
    progress: Callable[[str], None] | None = None,
) -> Iterator[Orbit]:
    """Yield the periodic orbits that simulations converge to, one for each start that converges.

    Parameters
    ----------
    vector : ndarray, shape (parameters,)
        The other parameters.
    bounds : (float, float)
        Range of the parameter, inside the model's limits.
    max_periods : int
        Longest orbit that counts.
    """
    rng = np.random.default_rng(seeds.seed)
    low, high = bounds
    for k in range(seeds.values):
        params = model.mapping(vector)
        params[parameter] = low + (k + 0.5) * (high - low) / seeds.values
        if progress is not None:
            progress(f"seeds at {parameter} = {params[parameter]:.6g}")
        spread = model.spread(params)
        period = model.view(model.vector(params)).period
        for j in range(seeds.states):
            state = None if j == 0 else rng.uniform(-1.0, 1.0, spread.shape) * spread
            time = 0.0 if j == 0 else float(rng.uniform(0.0, period or 1.0))
            if state is not None and _behind_wall(model, params, time, state):
                continue
            try:
                orbit = find_orbit(model, params, state=state, time=time, longest=_LONGEST)
            except (AperiodicError, ConvergenceError):
                continue
            if orbit.converged and orbit.periods <= max_periods:
                yield orbit


def _behind_wall(model: Model, params: dict[str, float], time: float, state: FloatArray) -> bool:
    """Tell whether a drawn state lies where a model with impacts has no motion."""
    signs = signs_at(model, time, state, model.vector(params))
    return bool(model.resets) and model.domain_at(signs) is None
