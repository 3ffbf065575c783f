"""Margins with a double zero where a segment has no length: without it, and never the place of an event.

Random bridges behind touches of the limit. The reference for the sign is the second derivative of the load at
the touch, from the forced motion of the mass at rest.
"""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.completeness.verification import STEP
from contfric.bvp.system import Margin

#: Scenes with a bridge after a touch of the limit inside of a stick: what varies, where, its parameters.
SCENES = [
    ("Omega", (0.17, 0.2), {"Omega": 0.1802, "S": 0.0146, "S0": 0.0384, "h": 0.2, "zeta": 0.01}),
    ("h", (0.3, 0.5), {"Omega": 0.0736, "S": 0.04554, "S0": 0.06393, "h": 0.367, "zeta": 5e-8}),
    ("S0", (0.03, 0.09), {"Omega": 0.12, "S": 0.03, "S0": 0.06, "h": 0.35, "zeta": 0.02}),
    ("h", (0.2, 0.5), {"Omega": 0.1, "S": 0.05, "S0": 0.12, "h": 0.4, "zeta": 0.01}),
]


def _bridges(scene: int) -> list[cf.Branch]:
    vary, bounds, params = SCENES[scene]
    diagram = cf.explore(cf.find_orbit("coulomb", params), vary, bounds, max_branches=30)
    return [b for b in diagram.branches if len(b.system.layout.doubles) and not b.mirrored]


def test_what_is_left_of_a_double_zero_is_a_curvature() -> None:
    """At the end of a hold after a touch: the mean curvature of the load's distance to its limit."""
    asked = 0
    for scene in range(len(SCENES)):
        for branch in _bridges(scene):
            for orbit in branch[1:-1]:
                whole = orbit.as_whole()
                for k, segment in whole.system.layout.doubles:
                    test = whole.system.tests[k]
                    lasts = whole.ends[segment, 0] - whole.cycle[segment, 0]
                    if test.margin is not Margin.JOINT or not 1e-3 < lasts < 0.5:
                        continue
                    if test.segment != segment:  # the stop before the touch: from the other side
                        continue
                    surface = orbit.model.surface_by_name[test.surface]
                    load = [
                        _load(
                            orbit.model,
                            surface.observable,
                            whole.cycle[segment],
                            orbit,
                            share * lasts,
                        )
                        for share in (0.0, 1.0)
                    ]
                    left = abs(load[1] - load[0]) / lasts**2
                    assert whole.margins[k] == pytest.approx(left, rel=1e-6)
                    asked += 1
    assert asked > 5


def _load(
    model: cf.Model, observable: str, start: np.ndarray, orbit: cf.Orbit, later: float
) -> float:
    c = [o.name for o in model.observables].index(observable)
    state = np.ascontiguousarray(start[1:])  # at rest nothing moves
    none, empty = np.empty(0, dtype=np.int64), np.empty(0)
    return float(model.flow.observe(c, float(start[0]) + later, state, orbit.vector, none, empty))


def test_the_place_of_an_event_does_not_depend_on_the_step() -> None:
    compared = 0
    for scene, (vary, bounds, _) in enumerate(SCENES):
        for branch in _bridges(scene)[:6]:
            # by the parameter: points may crowd at an end that is known to its accuracy only
            halfway = 0.5 * (branch.values[0] + branch.values[-1])
            middle = branch[int(np.argmin(np.abs(branch.values - halfway)))]
            step = 0.01 * STEP
            again = cf.continue_orbit(middle, vary, bounds, max_step=step, stability=False)
            found = [e.bifurcation for e in again.ends if e.bifurcation and e.reason.name == "AS"]
            for one in (e.bifurcation for e in branch.ends if e.reason.name == "AS"):
                if not one or not found:
                    continue
                places = [abs(one.params[vary] - two.params[vary]) for two in found]
                known = max(1e-10, 2.0 * one.accuracy) * (bounds[1] - bounds[0])
                assert min(places) < known, (scene, branch.name, one)
                compared += 1
    assert compared > 5
