"""An event at other parameters: its equations solved again, with the parameter along which it lies free.

The event is followed on the straight line from its own parameters to the others. Each step is predicted by
the derivatives of its place (:mod:`contfric.curves.sensitivity.gradient`), solved by Newton's method, and
halved where that fails.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.curves.points import solve_point
from contfric.curves.problem import border_of
from contfric.curves.sensitivity.gradient import parameter_of, plane_of, slope_of
from contfric.errors import ConvergenceError
from contfric.events.bifurcation import Bifurcation
from contfric.orbit.orbit import Orbit

#: Shortest share of the way that is tried: an event that is lost on less has met another one.
_SHORTEST = 1.0 / 256.0
#: Joints that move further within one step (nondimensional): the step may have gone to another orbit.
_FAR = 0.3
#: Other margins of the event's orbit below this: it is not admissible. Located events are good to 1e-10.
_ADMISSIBLE = -1e-9


def moved_event(bifurcation: Bifurcation, params: dict[str, float]) -> Bifurcation:
    """Return an event at other parameters; its own one among them is of no matter.

    Raises
    ------
    ConvergenceError
        If it is lost on the way, or its orbit is not admissible there.
    """
    name = parameter_of(bifurcation)
    model = bifurcation.orbit.model
    active = model.index_of(name)
    end = model.vector({**params, name: bifurcation.params[name]})
    here, done, share = bifurcation, 0.0, 1.0
    while done < 1.0:
        share = min(share, 1.0 - done)
        start = here.orbit.vector
        target = start + (end - start) * (share / (1.0 - done))
        target[active] = start[active] + _change(here, name, target - start)
        found = _solved(here, name, target)
        if found is not None:
            here, done, share = found, done + share, 2.0 * share
        elif share > _SHORTEST:
            share *= 0.5
        else:
            raise ConvergenceError(
                f"{bifurcation!r} is lost on the way to {params}: {here!r} is the last", here.orbit
            )
    if np.min(_others(here), initial=0.0) < _ADMISSIBLE:
        raise ConvergenceError(f"the orbit of {here!r} is not admissible", here.orbit)
    return here


def _change(event: Bifurcation, name: str, step: FloatArray) -> float:
    """Return how much the event's own parameter changes to first order."""
    names = event.orbit.model.parameter_names
    moving = [k for k in np.flatnonzero(step) if names[k] != name]
    return float(sum(slope_of(event, name, names[k]) * step[k] for k in moving))


def _solved(event: Bifurcation, name: str, target: FloatArray) -> Bifurcation | None:
    """Return the event at other parameters; None if Newton's method fails or goes to another orbit."""
    model = event.orbit.model
    other = next(n for n in model.parameter_names if n != name)
    known = plane_of(event, name, other)
    problem = replace(known, vector=target)
    at = target[problem.which]
    problem = replace(
        problem, box=replace(known.box, low=at - known.box.widths, high=at + known.box.widths)
    )
    joints = problem.joints_of(event.orbit)
    border = border_of(problem, joints, target)
    fixed = problem.box.widths * np.array([0.0, 1.0])
    point = solve_point(problem, joints, at, np.zeros_like(joints), fixed, border)
    if point is None or not np.max(np.abs(point.joints - joints)) < _FAR:
        return None
    orbit: Orbit = problem.orbit(point.joints, point.w)
    return replace(event, params=orbit.params, orbit=orbit)


def _others(event: Bifurcation) -> FloatArray:
    """Return the margins of the event's orbit but for those that vanish there."""
    orbit = event.orbit
    own = set(event.tests)
    return np.array(
        [m for test, m in zip(orbit.system.tests, orbit.margins, strict=True) if test not in own]
    )
