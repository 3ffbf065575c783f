"""The points of one solution on a section, and its return map."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contfric.chaos.running import Progress
from contfric.errors import (
    function_of,
    real_number,
)
from contfric.models import ModelSource, Parameters
from contfric.models.definition import Model
from contfric.models.tied import tied
from contfric.response.collecting import collect, repeats_of
from contfric.response.cuts import Following, SectionPoints
from contfric.response.outcome import Outcome
from contfric.response.returns import Returns
from contfric.response.sections import SectionLike, section_of, usual_section
from contfric.response.sweeping import positive
from contfric.simulation.starts import checked_state
from contfric.simulation.time_scale import clock_period

#: Points without a limit, as the kernel takes them.
_ALL = np.iinfo(np.int64).max


def poincare(
    model: ModelSource,
    params: Parameters | None = None,
    state: ArrayLike | None = None,
    *,
    section: SectionLike | None = None,
    sense: str = "either",
    time: float = 0.0,
    periods: float = 1000.0,
    transient: float = 100.0,
    progress: Progress | None = None,
) -> Returns:
    """Collect the points of one solution on a section: a Poincare section and its return map.

    Parameters
    ----------
    model, params : the model (or its name) and its parameters; defaults fill in
    section : "stops", "releases", a surface of the model by its name, or a phase of the excitation as a share
        of its period; by default the stops, or phase 0 where an excited model has none, such as a structure
    sense : of a surface: "either", "rising" or "falling"
    state, time : initial condition; by default displaced from rest at time 0
    periods, transient : periods of the excitation or of the clock (units of time without) of which
        points are collected, and before that
    progress : called with one line of text now and then

    Returns
    -------
    contfric.Returns
        With k points: ``times``, shape (k,), and ``states``, shape (k, n).

    Raises
    ------
    ParameterError
        If an argument is not valid.

    Examples
    --------
    >>> import contfric as cf
    >>> found = cf.poincare("coulomb", {"Omega": 0.35, "S": 0.05}, section="v", periods=50)
    >>> bool(abs(found.coordinate("v")).max() < 1e-12)
    True
    """
    model, params = tied(model, params)
    section = usual_section(model) if section is None else section
    cut = section_of(model, section, sense)
    vector = model.vector(params)
    y, begins = checked_state(model, vector, state), real_number("time", time)
    function_of("progress", progress)
    skipped = real_number("transient", transient, least=0.0)
    span, clock = skipped + positive("periods", periods), clock_period(model, vector)
    how = Following(skipped * clock, span * clock, 0.0, _ALL, 0)
    at, one = np.array([begins]), np.array([-1], dtype=np.int64)
    points, ends = collect(
        model, cut, how, vector[None], (at, y[None], one, 0 * one), None, progress
    )
    outcome = list(Outcome)[int(ends.outcomes[0])]
    if outcome is Outcome.APERIODIC and _repeated(model, model.view(vector).period, points):
        outcome = Outcome.PERIODIC
    return Returns(
        model, vector, section, outcome, points.cycles, points.modes, points.times, points.states
    )


def _repeated(model: Model, period: float, points: SectionPoints) -> bool:
    """Tell whether the last points are those of a cycle before, to within rounding; the phase counts, too."""
    within, count = repeats_of(model), len(points.times)

    def same(some: slice, others: slice) -> NDArray[np.bool_]:
        y, z = points.states[some], points.states[others]
        equal = np.all(np.abs(y - z) <= within * (1.0 + np.abs(z)), axis=1)
        if period > 0.0:
            apart = points.times[some] - points.times[others]
            equal &= np.abs(apart - period * np.round(apart / period)) <= within * (1.0 + period)
        return np.asarray(equal & (points.modes[some] == points.modes[others]))

    if count < 2:
        return False
    before = np.flatnonzero(same(slice(0, count - 1), slice(count - 1, count)))
    cycle = count - 1 - int(before[-1]) if len(before) else count
    ends = slice(count - 2 * cycle, count - cycle), slice(count - cycle, count)
    return 2 * cycle <= count and bool(np.all(same(*ends)))
