"""The Lyapunov exponents of one solution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.base.shown import Shown
from contfric.chaos.rows import FollowingLimits, follow
from contfric.chaos.starts import StateLike, default_states, given_states
from contfric.chaos.status import Motion
from contfric.errors import ParameterError, real_number, whole_number
from contfric.models import ModelSource, Parameters
from contfric.models.definition import Model
from contfric.models.tied import tied
from contfric.simulation.excitation import check_excitation


@dataclass(frozen=True, eq=False)
class LyapunovExponents(Shown):
    """The Lyapunov exponents of one solution, per unit of time.

    Attributes
    ----------
    model : Model
    params : dict
    exponents : ndarray, shape (n,)
        Largest first; ``-inf`` where sticks leave nothing of a direction. The exponent 0 along the flow
        is left out (:attr:`spectrum` has it). In an autonomous model that leaves n - 1, and the last one
        is ``-inf``; at rest there is no such direction, and all n are given.
    errors : ndarray, shape (n,)
        Standard errors of averages; for a periodic orbit the error of its solution.
    motion : Motion
        What the solution turned out to be, and what the exponents mean.
    periods : int
        Period of a periodic solution, in periods of the excitation or of the clock; 0 for others. Without
        either 1, and all other periods here are units of time.
    followed : int
        Periods that the solution was followed.
    tolerance : float
        Relative error that was asked for.

    Examples
    --------
    >>> import contfric as cf
    >>> found = cf.lyapunov_exponent("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> found.motion.name, round(found.largest, 6)  # per unit of time
    ('PERIODIC', -0.026609)
    """

    model: Model
    params: dict[str, float]
    exponents: FloatArray
    errors: FloatArray
    motion: Motion
    periods: int
    followed: int
    tolerance: float

    @property
    def largest(self) -> float:
        """The largest exponent."""
        return float(self.exponents[0])

    @property
    def error(self) -> float:
        """The standard error of the largest exponent."""
        return float(self.errors[0])

    @property
    def converged(self) -> bool:
        """Whether the largest exponent is exact, or an average within the tolerance."""
        return self.motion.exact or self.error <= self.tolerance * abs(self.largest)

    @property
    def spectrum(self) -> FloatArray:
        """All exponents of the flow, that of a shift along it (0) among them, largest first.

        They are n of an autonomous model, and 1 + n with excitation, where time is a state more. A stable
        periodic orbit has 0 as its largest one; ``exponents`` tell how fast it attracts.
        """
        if self.model.autonomous and self.motion is Motion.HELD:
            return self.exponents
        across = self.exponents[: len(self.exponents) - int(self.model.autonomous)]
        missing = np.nan if np.isnan(self.largest) else 0.0
        return np.sort(np.append(across, missing))[::-1]

    @property
    def dimension(self) -> float:
        """Lyapunov dimension in the stroboscopic section (Kaplan and Yorke): 0 for a periodic orbit."""
        return float(lyapunov_dimension(self.exponents))

    def __repr__(self) -> str:
        values = ", ".join(f"{value:.6g}" for value in self.exponents)
        return (
            f"<LyapunovExponents ({values}), error {self.error:.2g}: {self.motion.name.lower()}, "
            f"followed for {self.followed} periods>"
        )


def lyapunov_dimension(exponents: FloatArray) -> NDArray[np.float64]:
    """Return the Lyapunov dimension of exponents in descending order, shape (...,) from (..., n).

    ``D = j + (l_1 + .. + l_j) / |l_{j+1}|`` with j the largest number for which the sum is not
    negative; n if that is all of them (J. L. Kaplan and J. A. Yorke, Lecture Notes in Mathematics 730
    (1979) 204-227). In the stroboscopic section; one more with time.

    Examples
    --------
    >>> float(lyapunov_dimension(np.array([0.1, -0.4])))
    1.25
    >>> float(lyapunov_dimension(np.array([0.1, -np.inf])))
    1.0
    """
    exponents = np.asarray(exponents, dtype=np.float64)
    sums = np.cumsum(exponents, axis=-1)
    count = np.sum(sums >= 0.0, axis=-1)  # sums of descending numbers: once negative, always
    n = exponents.shape[-1]
    inside = (count > 0) & (count < n)
    last = np.take_along_axis(sums, np.maximum(count - 1, 0)[..., None], -1)[..., 0]
    following = np.take_along_axis(exponents, np.minimum(count, n - 1)[..., None], -1)[..., 0]
    share = np.zeros(count.shape)
    np.divide(last, -following, out=share, where=inside)
    dimension = np.where(np.isnan(exponents[..., 0]), np.nan, count + share)
    return np.asarray(dimension, dtype=np.float64)


def limits_of(transient: int, periods: int, tolerance: float, confirm: int) -> FollowingLimits:
    """Return how long solutions are followed, checked.

    Raises
    ------
    ParameterError
        If a number is out of its range.
    """
    transient = whole_number("transient", transient, least=0)
    periods = whole_number("periods", periods, least=1)
    confirm = whole_number("confirm", confirm, least=0)
    wanted = "is a number >= 0"
    tolerance = real_number("tolerance", tolerance, wanted=wanted)
    if tolerance < 0.0:
        raise ParameterError(f"tolerance {wanted}, got {tolerance!r}")
    return FollowingLimits(transient, periods, tolerance, confirm)


def lyapunov_exponent(
    model: ModelSource,
    params: Parameters | None = None,
    *,
    state: StateLike | None = None,
    time: float = 0.0,
    periods: int = 100_000,
    transient: int = 200,
    tolerance: float = 0.01,
    confirm: int = 0,
) -> LyapunovExponents:
    """Compute the Lyapunov exponents of the solution from an initial state.

    They come from the exact tangent map of the event-driven flow. A solution that becomes periodic ends
    at once, with the exponents of its orbit, ``ln|multiplier| / period``; any other is averaged until
    the largest exponent is known to the tolerance.

    Parameters
    ----------
    model, params : the model (or its name) and its parameters; defaults fill in
    state : initial state, shape (n,), or a function of the parameters; by default displaced from rest
    time : initial time, nondimensional
    periods : most periods (of the excitation or of a clock; else units of time) to average over
    transient : periods before averaging begins
    tolerance : relative error of the largest exponent at which averaging ends
    confirm : periods to follow a motion further, after averaging, to see whether it converges after all

    Returns
    -------
    LyapunovExponents
        ``exponents``, shape (n,), per unit of time, largest first; ``error``, that of the largest one;
        ``motion``, what the solution turned out to be.

    Raises
    ------
    ParameterError
        If an argument is not valid.

    Examples
    --------
    >>> import contfric as cf
    >>> found = cf.lyapunov_exponent("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> found.motion.name, round(found.largest, 6)
    ('PERIODIC', -0.026609)
    """
    model, params = tied(model, params)
    limits = limits_of(transient, periods, tolerance, confirm)
    vector = model.vector(params)
    check_excitation(model, vector)
    named = model.mapping(vector)
    if state is None:
        states = default_states(model, named, 1)
    else:
        states = given_states(model, state, named)
    if len(states) != 1:
        raise ParameterError(f"one state is followed, got {len(states)}: call once for each")
    rows = follow(model, vector[None], states, real_number("time", time), limits)
    return LyapunovExponents(
        model,
        named,
        rows.exponents[0],
        rows.errors[0],
        list(Motion)[rows.motions[0]],
        int(rows.turns[0]),
        int(rows.followed[0]),
        limits.tolerance,
    )
