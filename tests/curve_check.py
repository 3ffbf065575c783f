"""An independent run in one parameter near a point of a curve."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import contfric as cf
from contfric.continuation.singular_points.switching import null_vector
from contfric.orbit.solve import refine

#: How far next to a point the run starts, and how far it goes.
OFFSETS = (1e-4, -1e-4, 1e-3, -1e-3, 1e-5, -1e-5)
WIDTH = 5e-3


def beside(orbit, parameter):
    """Orbits near one that may be singular, solved at other values of the parameter."""
    away = null_vector(orbit)
    for offset in OFFSETS:
        for push in (0.0, 1e-2, -1e-2, 3e-3, -3e-3):
            vector = orbit.vector.copy()
            vector[orbit.model.index_of(parameter)] += offset
            moved = replace(orbit, joints=orbit.joints + push * away, vector=vector)
            solved = refine(moved, damped=False)
            near = np.max(np.abs(solved.joints - orbit.joints)) < 0.1
            if solved.converged and near and solved.admissible:
                yield solved


def miss(orbit, kind, parameter="Omega"):
    """Distance of the parameter to the same bifurcation as a fine run in one parameter finds it."""
    value = orbit.params[parameter]
    best = np.inf
    for start in beside(orbit, parameter):
        try:
            branch = cf.continue_orbit(
                start, parameter, (value - WIDTH, value + WIDTH), max_step=2e-3
            )
        except (cf.ConvergenceError, cf.ParameterError):
            continue
        found = [b.params[parameter] for b in branch.bifurcations if b.kind is kind and b.located]
        best = min([best, *(abs(x - value) for x in found)])
        if best < 1e-10:
            break
    return best
