"""Cycles of models without a clock that come to an equilibrium on a surface, or that are run through twice.

Where an equilibrium reaches a surface that a cycle crosses, the cycle comes to it and its period grows
without bound. The parameter of that is known in closed form, and every restart finds the same ends.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typed import typed

import contfric as cf
from contfric.atlas import matching
from contfric.atlas.completeness.verification import differences
from contfric.bvp.system import build_system
from contfric.orbit.canonical.repetition import shortest
from tests.property.test_fast_cycles import welander

MCKEAN = """
name: mckean
states: [v, w]
parameters: {{a: {a}, I: {I}, eps: {eps}, g: {g}}}
autonomous: true
surfaces: {{low: {{observable: v, level: a/2}}, high: {{observable: v, level: (1 + a)/2}}}}
modes:
  rest: {{in: {{low: -}}, field: {{v: -v - w + I, w: eps*(v - g*w)}}}}
  middle: {{in: {{low: +, high: -}}, field: {{v: v - a - w + I, w: eps*(v - g*w)}}}}
  active: {{in: {{high: +}}, field: {{v: 1 - v - w + I, w: eps*(v - g*w)}}}}
"""

VALVE = """
name: valve
states: [x, v, p]
parameters: {kappa: 1.25, beta: 20.0, delta: 10.0, q: 6.0, r: 0.8}
autonomous: true
surfaces: {seat: {observable: x}}
modes: {open: {in: {seat: +}, field: {x: v, v: -kappa*v - x - delta + p, p: beta*(q - x*sqrt(p))}}}
resets: {seat: {v: -r*v}}
spread: {x: 1, p: 11}
"""


def mckean(folder: Path, a: float, g: float, eps: float) -> tuple[cf.Model, float, float]:
    """Return McKean's neuron, and the currents at which v = g w rests on either surface.

    For eps < 0.2 and g < 1 the equilibria of all three pieces are nodes.
    """
    low, high = 0.5 * a * (1.0 + 1.0 / g), 0.5 * (1.0 + a) * (1.0 + 1.0 / g) - 1.0
    return typed(folder, MCKEAN.format(a=a, g=g, eps=eps, I=0.5 * (low + high))), low, high


@pytest.mark.parametrize("seed", range(3))
def test_a_neuron_that_comes_to_rest_on_either_surface(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    draw = np.random.default_rng(seed)
    a, g, eps = draw.uniform(0.2, 0.3), draw.uniform(0.4, 0.6), draw.uniform(0.05, 0.15)
    model, low, high = mckean(tmp_path, a, g, eps)
    diagram = cf.explore(cf.find_orbit(model), "I", (low - 0.1, high + 0.1))
    (branch,) = diagram.branches
    assert (branch.values.min(), branch.values.max()) == pytest.approx((low, high), abs=1e-6)
    assert [end.reason for end in branch.ends] == [cf.EndReason.PERIOD] * 2
    for end, surface in zip(branch.ends, ("low", "high"), strict=True):
        assert f"equilibrium on the surface '{surface}'" in str(end)
    assert not diagram.bifurcations and not diagram.loose_ends
    assert diagram.verify().passed
    # most points are at the ends: compared there, each would be solved from each of the others
    solved = []
    refine = matching.refine
    monkeypatch.setattr(matching, "refine", lambda *a, **k: solved.append(a) or refine(*a, **k))
    assert [*differences(diagram, diagram)] == []
    assert 1 <= len(solved) <= 4


@pytest.mark.parametrize("seed", range(3))
def test_a_cycle_between_a_point_and_a_node_on_the_surface(seed: int, tmp_path: Path) -> None:
    draw = np.random.default_rng(seed)
    a, b, k = draw.uniform(0.75, 0.85), draw.uniform(0.4, 0.6), draw.uniform(0.9, 5.0)
    node = b / (b + k) - a / (1.0 + k)
    model = welander(tmp_path, 1.0, a, b, k, 0.5 * node)
    diagram = cf.explore(cf.find_orbit(model), "eps", (-0.2, 0.1))
    (branch,) = diagram.branches
    assert (branch.values[0], branch.values[-1]) == pytest.approx((node, 0.0), abs=1e-6)
    assert [end.reason for end in branch.ends] == [cf.EndReason.PERIOD, cf.EndReason.POINT]
    assert "equilibrium on the surface 'density'" in str(branch.ends[0])
    verification = diagram.verify()
    assert verification.passed, verification


@pytest.mark.parametrize("turns", [2, 3, 6])
def test_a_cycle_run_through_several_times_is_one_cycle(turns: int, tmp_path: Path) -> None:
    orbit = cf.find_orbit(mckean(tmp_path, 0.25, 0.5, 0.1)[0])
    joints = np.concatenate([orbit.joints for _ in range(turns)])
    joints[:, 0] -= np.repeat(np.arange(turns)[::-1], len(orbit.itinerary)) * orbit.period
    for periods in (1, turns):
        system = build_system(orbit.model, orbit.itinerary * turns, periods)
        once = shortest(replace(orbit, system=system, joints=joints))
        assert once.itinerary == orbit.itinerary and once.periods == 1
        assert once.joints == pytest.approx(orbit.joints, abs=1e-12)


def test_cycles_of_any_number_of_flights_graze_at_one_event(tmp_path: Path) -> None:
    """The cycles of 1, 2 and 4 loops all are the smooth cycle there, run through so many times."""
    orbit = cf.find_orbit(typed(tmp_path, VALVE), state=[3.0, 0.0, 15.0])
    diagram = cf.explore(orbit, "q", (3.0, 9.0))
    (grazing,) = (n for n in diagram.nodes if abs(n.bifurcation.params["q"] - 7.557211) < 1e-5)
    assert grazing.bifurcation.kind is cf.Kind.GS
    at = [b.period[np.argmax(b.values)] for b in (diagram.branches[i] for i in grazing.branches)]
    assert sorted(np.round(np.array(at) / min(at), 6)) == [1.0, 2.0, 4.0]
