"""Planes of two parameters: what is left untraced, as it is known, would have added nothing."""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.leaving import from_flow
from contfric.atlas.plane import explore as plane_explore


def explored(params: dict[str, float], ranges: dict[str, tuple[float, float]]) -> cf.Plane:
    orbit = cf.find_orbit("coulomb", params)
    names = tuple(ranges)
    return cf.explore_plane(orbit, names, ranges, max_periods=1, max_sections=2)


def same_as_traced_whole(
    monkeypatch: pytest.MonkeyPatch,
    params: dict[str, float],
    ranges: dict[str, tuple[float, float]],
) -> int:
    """Compare a plane with one for which every curve is traced to its ends; return how many are known."""
    verdicts: list[bool] = []
    known = plane_explore._begins_known
    with monkeypatch.context() as patch:
        patch.setattr(
            plane_explore,
            "_begins_known",
            lambda *given: verdicts.append(known(*given)) or verdicts[-1],
        )
        short = explored(params, ranges)
    with monkeypatch.context() as patch:
        patch.setattr(plane_explore, "_begins_known", lambda *given: False)
        whole = explored(params, ranges)
    assert [repr(curve) for curve in short.curves] == [repr(curve) for curve in whole.curves]
    for one, other in zip(short.curves, whole.curves, strict=True):
        assert np.array_equal(one.values, other.values)
    assert [r.point for r in short.regions] == [r.point for r in whole.regions]
    assert short.notes == whole.notes
    return sum(verdicts)


def test_known_curves_need_not_be_traced_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    params = {"Omega": 0.5, "S": 0.32, "S0": 0.4, "h": 0.0}
    assert same_as_traced_whole(monkeypatch, params, {"h": (-0.05, 0.05), "S": (0.0, 0.4)}) > 0


@pytest.mark.slow
def test_known_curves_of_random_planes(monkeypatch: pytest.MonkeyPatch) -> None:
    rng, known = np.random.default_rng(2), 0
    for _ in range(2):
        offset, omega = rng.uniform(0.2, 0.8), rng.uniform(0.3, 0.6)
        params = {"Omega": omega, "S": 0.6 * offset, "S0": offset}
        ranges = {"Omega": (omega - 0.15, omega + 0.1), "S": (0.02, offset)}
        known += same_as_traced_whole(monkeypatch, params, ranges)
    assert known > 10


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_points_do_not_depend_on_the_step(seed: int) -> None:
    """Points that are located are found with another step, also where Omega = 1/2 is a continuum."""
    rng = np.random.default_rng(seed)
    offset = rng.uniform(0.3, 0.5)
    params = {"Omega": 0.55, "S": rng.uniform(0.5, 0.8) * offset, "S0": offset}
    params["h"] = rng.choice([0.0, rng.uniform(-0.05, 0.05)])
    ranges = {"Omega": (0.45, 0.65), "S0": (params["S"], params["S"] + 0.2)}
    orbit = cf.find_orbit("coulomb", params)
    found = []
    for step in (None, 0.0037):
        plane = cf.explore_plane(
            orbit, ("Omega", "S0"), ranges, max_periods=1, max_sections=2, max_step=step
        )
        assert len(plane.curves) < 15  # Omega = 1/2 is no heap of short curves
        points = [s for curve in plane.curves for s in curve.special]
        found.append([(s.params["Omega"], s.params["S0"], s.located) for s in points])
    assert any(located for *_, located in found[0])
    for some, others in (found, found[::-1]):
        for omega, load, located in some:
            near = [abs(o - omega) + abs(v - load) < 1e-7 for o, v, _ in others]
            assert any(near) or not located


def test_whole_orbits_are_found_on_the_branches_of_their_halves() -> None:
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    diagram = cf.explore(orbit, "Omega", (0.4, 0.6))
    branches = [b for b in diagram.branches if not (b.bridge or b.mirrored)]
    assert any(b.system.half for b in branches) and not all(b.system.half for b in branches)
    rng = np.random.default_rng(5)
    for branch in branches:
        for k in rng.integers(1, len(branch) - 1, 3):
            there = branch[int(k)].as_whole()  # as motions near an event come
            assert [b for b in branches if from_flow._passes(b, there)] == [branch]
