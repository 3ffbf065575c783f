r"""Gradient of an event's parameter with respect to the others: the slope of its curve in each plane.

The equations of the orbit, F(z, a, p) = 0, and the condition of the event, g(z, a, p) = 0, fix joints z
and the parameter a for every value of another parameter p. In the plane of a and p the event has a curve,
whose unit tangent :math:`(\delta z, \delta a, \delta p)` solves

.. math:: F_z\delta z + F_a\delta a + F_p\delta p = 0, \qquad g_z\delta z + g_a\delta a + g_p\delta p = 0 ,

and :math:`da/dp = \delta a / \delta p`. It comes from the elimination that solves for a point of the
curve, with exact derivatives: second ones of the flow for SN, BP and PD.
"""

from __future__ import annotations

import math

import numpy as np

from contfric.base.named import Named
from contfric.curves.points import first_curve_point
from contfric.curves.problem import Problem, problem_of
from contfric.curves.ranges import PlaneRanges
from contfric.errors import ConvergenceError, ParameterError
from contfric.events.bifurcation import Bifurcation
from contfric.orbit.gradient import Gradient

#: A share of the tangent below which a parameter stands still along the curve: rounding of solved points.
_STANDS = 1e-10


def event_gradient(bifurcation: Bifurcation, parameter: str | None) -> Gradient:
    """Return the derivatives of an event's parameter; see :meth:`contfric.Bifurcation.gradient`."""
    model = bifurcation.orbit.model
    name = parameter_of(bifurcation) if parameter is None else parameter
    model.index_of(name)
    slopes, notes = Named[float](), []
    for other in model.parameter_names:
        if other == name:
            continue
        slopes[other] = slope_of(bifurcation, name, other)
        if not math.isfinite(slopes[other]):
            notes.append(
                f"'{other}' is stationary along the curve of the event: a cusp, or a fold of it"
            )
    if len(bifurcation.tests) > 1 and not bifurcation.symmetric:
        notes.append(
            f"{len(bifurcation.tests)} margins vanish at once: the derivatives are those of the first; where "
            "they part, the event is another one on each side"
        )
    value = bifurcation.params[name]
    return Gradient(f"{name} of {bifurcation.label}", value, slopes, slopes, tuple(notes))


def parameter_of(bifurcation: Bifurcation) -> str:
    """Return the parameter along which an event was located."""
    if not bifurcation.parameter:
        raise ParameterError(
            f"{bifurcation!r} does not know along which parameter it was located: name it, such as "
            f"gradient('{bifurcation.orbit.model.parameter_names[0]}')"
        )
    return bifurcation.parameter


def plane_of(bifurcation: Bifurcation, one: str, other: str) -> Problem:
    """Return the problem of the curve in the plane of two parameters, scaled by their sizes."""
    here = np.array([bifurcation.params[one], bifurcation.params[other]])
    size = 1.0 + np.abs(here)
    return problem_of(bifurcation, PlaneRanges((one, other), here - size, here + size))


def slope_of(bifurcation: Bifurcation, one: str, other: str) -> float:
    """Return the derivative of a parameter of an event by another one; infinite where that stands still."""
    orbit, problem = bifurcation.orbit, plane_of(bifurcation, one, other)
    here = problem.orbit(problem.joints_of(orbit), orbit.vector[problem.which])
    found = first_curve_point(problem, here)
    if found is None:
        raise ConvergenceError(
            f"{bifurcation!r} has no curve with a unique direction in {problem.box.names}", orbit
        )
    a, p = found[0].direction
    return float(a / p) if abs(p) > _STANDS * abs(a) else math.inf
