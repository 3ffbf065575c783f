"""A value that is not finite inside the engine ends the branch there, with a reason and all its points."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import contfric as cf
from contfric.bvp.system import build_system
from contfric.compiled import allocating_helper, flow_signature, kernel
from contfric.flow.oscillator import flow as forced_oscillator
from contfric.models.definition import Model
from contfric.orbit.orbit import Status
from contfric.orbit.solve import refine

PARAMS = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
#: The flow of the test model is not a number above this frequency.
HIGHEST = 0.53
whole_flow = allocating_helper(forced_oscillator.flow.__wrapped__)


@kernel(flow_signature)
def flow_that_breaks(mode, t0, y0, dt, p, which, y1, jac):  # type: ignore[no-untyped-def]
    whole_flow(mode, t0, y0, dt, p, which, y1, jac)
    if p[0] > HIGHEST:
        y1[0] = math.nan


@pytest.fixture(scope="module")
def model() -> Model:
    coulomb = cf.load_model("coulomb")
    broken = replace(coulomb.flow, flow=flow_that_breaks)
    return replace(coulomb, name="breaking", flow_factory=lambda: broken)


def test_a_branch_ends_at_its_last_good_point(model: Model) -> None:
    branch = cf.continue_orbit(cf.find_orbit(model, PARAMS), "Omega", (0.4, 0.6))
    reasons = [end.reason for end in branch.ends]
    assert reasons == [cf.EndReason.SS, cf.EndReason.BROKEN]
    assert branch.values[-1] == pytest.approx(HIGHEST, abs=1e-6)
    assert branch.values[-1] <= HIGHEST
    assert np.all(np.isfinite(branch.joints)) and branch[-1].admissible


def test_an_exploration_goes_on_elsewhere(model: Model) -> None:
    whole = cf.explore(cf.find_orbit("coulomb", PARAMS), "Omega", (0.4, 0.52))
    found = cf.explore(cf.find_orbit(model, PARAMS), "Omega", (0.4, 0.6))
    assert any(end.reason is cf.EndReason.BROKEN for b in found.branches for end in b.ends)
    # what is connected to the start below the limit only
    assert {b.name for b in found.branches} <= {b.name for b in whole.branches}


def test_a_solve_returns_its_status(model: Model) -> None:
    orbit = cf.find_orbit("coulomb", {**PARAMS, "Omega": 0.535})
    system = build_system(model, orbit.system.itinerary, orbit.system.periods)
    solved = refine(replace(orbit, system=system))
    assert not solved.converged
    assert solved.status is Status.NOT_FINITE
