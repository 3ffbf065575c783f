"""Orbits at events and at the ends of branches, where conditions hold as equalities to rounding."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import contfric as cf
from contfric.orbit.itinerary.itineraries import decode

PARAMS = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
SCENES = {
    "Omega": (0.4, 0.6),
    "S": (0.0, 0.4),
    "S0": (0.32, 0.7),
    "h": (-0.2, 0.2),
    "zeta": (0.0, 0.1),
}
each_scene = pytest.mark.parametrize("parameter", SCENES)


@cache
def diagram(parameter: str) -> cf.Diagram:
    return cf.explore(cf.find_orbit("coulomb", PARAMS), parameter, SCENES[parameter])


def special_orbits(found: cf.Diagram) -> list[cf.Orbit]:
    tips = [branch[k] for branch in found.branches for k in (0, -1)]
    return [*tips, *(b.orbit for b in found.bifurcations)]


@each_scene
def test_each_has_a_signature_a_text_and_a_file(parameter: str, tmp_path: Path) -> None:
    for orbit in special_orbits(diagram(parameter)):
        signature = orbit.signature  # a Signature is a closed walk, or it cannot be made
        assert signature.periods == orbit.periods
        assert orbit.name in repr(orbit)
        cf.save(orbit, tmp_path / "orbit.npz")
        assert cf.load(tmp_path / "orbit.npz").signature == signature


@each_scene
def test_mirror_branches_carry_their_own_margins_and_labels(parameter: str) -> None:
    found = diagram(parameter)
    mirrored = [branch for branch in found.branches if branch.mirrored]
    for branch in mirrored:
        for i in range(1, len(branch) - 1, 4):
            orbit = branch[i]
            finite = np.isfinite(orbit.margins)
            assert np.allclose(branch.margins[i][finite], orbit.margins[finite], atol=1e-9)
            passed = [d for code in branch.labels[i] for d in decode(int(code), ["F+", "F-", "v"])]
            count = len(branch.system.itinerary) + len(passed)  # each crossing is one segment more
            if all(
                orbit.ends[:, 0] > orbit.cycle[:, 0] + 1e-6
            ):  # of a slide that vanishes: rounding
                assert count == len(orbit.signature.segments)
    assert bool(mirrored) == any(not b.symmetric for b in found.branches)


@pytest.mark.parametrize("index", range(6))
def test_any_end_of_fig05_leads_to_the_same_events(index: int) -> None:
    found = diagram("Omega")
    wanted = [(b.kind, b.params["Omega"]) for b in found.bifurcations]
    start = found.branches[index][0 if index != 2 else -1]
    if found.branches[index].ends[0].reason is cf.EndReason.BP:
        start = found.branches[index][-1]  # the vertex itself has no unique continuation
    again = [
        (b.kind, b.params["Omega"]) for b in cf.explore(start, "Omega", (0.4, 0.6)).bifurcations
    ]
    assert [kind for kind, _ in again] == [kind for kind, _ in wanted]
    for (_, value), (_, known) in zip(again, wanted, strict=True):
        assert value == pytest.approx(known, rel=1e-10)


@pytest.mark.parametrize("bounds", [(0.32, 0.6), (0.32, 2.6), (0.1, 0.6)])
def test_a_physical_limit_is_not_passed_and_has_no_events(bounds: tuple[float, float]) -> None:
    """At Omega = 1/2 and S0 = S the orbit is one of a continuum: what is located there is noise."""
    branch = cf.continue_orbit(cf.find_orbit("coulomb", PARAMS), "S0", bounds)
    assert branch.ends[0].reason is cf.EndReason.LIMIT
    assert 0.0 <= branch.values.min() - 0.32 < 1e-6 * (bounds[1] - bounds[0])
    assert branch[0].admissible
    assert all(b.params["S0"] > 0.33 for b in branch.bifurcations)


def test_a_stick_of_negative_duration_is_not_admissible() -> None:
    branch = next(b for b in diagram("Omega").branches if b.name == "2s")
    orbit = branch[len(branch) // 2]
    joints = orbit.joints.copy()
    joints[0, 0] += 2.0 * (orbit.ends[0, 0] - orbit.cycle[0, 0])  # the slide ends before it starts
    wrong = cf.Orbit(orbit.system, joints, orbit.vector, 0.0)
    assert orbit.admissible
    assert not wrong.admissible


def test_negative_damping_gives_a_torus_bifurcation() -> None:
    """A complex pair leaves the unit circle: |mu_1 mu_2| = 1 there, located on the branch."""
    orbit = cf.find_orbit("coulomb", {"Omega": 1.6, "S": 0.1, "S0": 0.1, "zeta": 0.05})
    branch = cf.continue_orbit(orbit, "zeta", (-0.2, 0.1))
    torus = [b for b in branch.bifurcations if b.kind is cf.Kind.NS]
    assert len(torus) == 1
    mu = torus[0].orbit.multipliers
    assert abs(mu[0].imag) > 1e-3
    assert np.allclose(np.abs(mu), 1.0, atol=1e-10)
    assert torus[0].params["zeta"] < 0.0
    assert (torus[0].stable_before, torus[0].stable_after) in {(True, False), (False, True)}


@pytest.mark.parametrize(("column", "kind"), [(0, "SN"), (2, "BP")])
def test_an_event_that_cannot_be_located_is_said(
    column: int, kind: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The sign change is known, the place is not: reported at the point before, and not followed."""
    from contfric.continuation.locating import smooth
    from contfric.continuation.points import EXTRA

    trial = smooth.locate_change

    def failing(orbit, before, after, settings, by, index, *rest):  # type: ignore[no-untyped-def]
        if by == 0 and index == len(before.tests) - EXTRA + column:
            return None
        return trial(orbit, before, after, settings, by, index, *rest)

    monkeypatch.setattr(smooth, "locate_change", failing)
    found = cf.explore(cf.find_orbit("coulomb", PARAMS), "Omega", (0.4, 0.6))
    # as the branch has it: the event of a diagram is that of the branch on which it is known best
    events = [b for branch in found.branches for b in branch.bifurcations if not b.located]
    assert events and {event.kind.value for event in events} == {kind}
    for event in events:
        assert "not located" in repr(event)
        assert any("not located" in proposal.why for proposal in event.proposals)
    cf.save(found, tmp_path / "diagram.npz")
    again = cf.load(tmp_path / "diagram.npz")
    located = [b.located for branch in again.branches for b in branch.bifurcations]
    assert located.count(False) == len(events)
