"""Holds that go on while another contact changes its state: solutions of the inclusion, and complete."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.completeness.verification import verify
from contfric.bvp.holds import Hold
from contfric.signature import parse_signature
from contfric.signature.holds import is_hold
from contfric.signature.reduced import canonical_itinerary, reduced_itinerary

#: Scenes drawn with holds that begin at a stop on the limit (SS: 9, 41), at a touch of the limit (AS: 34) or
#: of rest (GS: 7, 45), and go through two modes or three (7).
SEEDS = (9, 34, 41, 45, 7)
#: What a state may differ by from one that is simulated, and a load from its limit.
MOTION = 1e-9
#: What a place may differ by in another unit.
PLACE = 1e-6
NAMES = ("low", "high")


@cache
def numbers(seed: int) -> dict[str, float]:
    """Draw a scene: spring, limits, amplitudes of the force on either mass (third harmonic: b), mass."""
    r = np.random.default_rng([80, seed])
    found = {"k": r.uniform(0.3, 1.5)}
    kinetic = [r.uniform(0.1, 0.4) for _ in NAMES]
    static = [s * r.uniform(1.1, 2.0) for s in kinetic]
    found |= dict(zip(("S1", "S2", "T1", "T2"), (*kinetic, *static), strict=True))
    found |= {"F": r.uniform(0.5, 1.5), "w": r.uniform(0.3, 1.2)}
    return {name: float(x) for name, x in found.items()} | dict(
        zip(("a", "b", "m"), (*r.uniform(-0.7, 0.7, 2).tolist(), r.uniform(0.5, 2.0)), strict=True)
    )


def springs(seed: int) -> np.ndarray:
    k = numbers(seed)["k"]
    return np.array([[1.0 + k, -k], [-k, 1.0 + k]])


@cache
def drawn(seed: int, unit: float = 1.0) -> cf.Diagram:
    """Explore two masses on friction, with time in such a unit."""
    p, stiffness = numbers(seed), springs(seed)
    p = p | {"w": unit * p["w"]}
    model = cf.Mechanism(
        np.diag([1.0, p["m"]]) / unit**2,
        0.04 * stiffness / unit,
        stiffness,
        contacts={
            name: {"kind": "friction", "velocity": f"v{i}", "kinetic": f"S{i}", "static": f"T{i}"}
            for i, name in enumerate(NAMES, 1)
        },
        force={
            "q1": "F*cos(w*t)",
            "q2": f"{p['a']:.6f}*F*cos(w*t)+{p['b']:.6f}*F*cos(3*w*t)",
        },
        parameters={name: p[name] for name in ("w", "F", "S1", "S2", "T1", "T2")},
        period="2*pi/w",
    )
    w = p["w"]
    return cf.explore(cf.find_orbit(model), "w", (0.9 * w, 1.1 * w), max_periods=1, max_branches=60)


def long_holds(diagram: cf.Diagram) -> list[tuple[cf.Orbit, Hold, Hold]]:
    """Return orbits along the bridges with such holds, with the first and the last part of each."""
    found = []
    for branch in (b for b in diagram.branches if not b.mirrored):
        for point in branch[1 : -1 : max(1, len(branch) // 4)]:
            whole = point.as_whole()
            found += [(whole, *hold) for hold in whole.system.ends_of_holds if hold[0] != hold[1]]
    return found


def loads(seed: int, orbit: cf.Orbit, contact: int, times: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the force on a mass at rest without its friction."""
    p, turns = numbers(seed), orbit.params["w"] * times
    first, third = orbit.params["F"] * np.cos(turns), orbit.params["F"] * np.cos(3.0 * turns)
    acts = first if contact == 0 else round(p["a"], 6) * first + round(p["b"], 6) * third
    return np.asarray(acts - (y[:, :2] + 0.04 * y[:, 2:]) @ springs(seed)[contact])


@pytest.mark.parametrize("seed", SEEDS)
def test_it_is_a_solution_of_the_inclusion(seed: int) -> None:
    """Glued for the time of the hold, the mass moves as in a simulation, and might be let go all along."""
    found = long_holds(drawn(seed))
    assert found
    for orbit, first, last in found:
        contact = NAMES.index(first.leaves)
        begin, end = orbit.begins[first.segment], orbit.ends[last.segment]
        kinetic, static = (orbit.params[f"{name}{contact + 1}"] for name in ("S", "T"))
        start = begin[1:].copy()
        start[2 + contact] = 0.0
        path = cf.simulate(
            orbit.model,
            {**orbit.params, f"T{contact + 1}": 1e3},
            state=start,
            time=float(begin[0]),
            periods=float((end[0] - begin[0]) / orbit.period * orbit.periods),
        )
        assert np.max(np.abs(path.last[2] - end[1:])) < MOTION
        assert len(path) == last.segment - first.segment  # what the other mass meets meanwhile
        times = np.linspace(begin[0], begin[0] + 0.999999 * (end[0] - begin[0]), 200)
        (at_end,) = loads(seed, orbit, contact, end[:1], end[None, 1:])
        side = np.sign(at_end)
        all_along = side * loads(seed, orbit, contact, times, path.sample(times))
        assert kinetic - MOTION < np.min(all_along)
        assert np.max(all_along) < static + MOTION
        moved = orbit.flow.rate(last.departs, f"v{contact + 1}", float(end[0]), end[1:])
        mass = numbers(seed)["m"] if contact else 1.0
        assert np.isclose(moved * mass, at_end - side * kinetic, atol=MOTION)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_diagram_is_the_same_from_every_branch(seed: int) -> None:
    """No end is loose, and indices balance where a hold begins to go on, and where it is a stick."""
    diagram = drawn(seed)
    held = verify(diagram, 3)
    assert not diagram.loose_ends
    assert all(restart.same for restart in held.restarts), [str(r) for r in held.restarts]
    assert held.balances and all(balance.holds for balance in held.balances)


@pytest.mark.parametrize("unit", [0.03, 0.55, 30.0])
@pytest.mark.parametrize("seed", (*SEEDS, 248))
def test_it_is_the_same_in_another_unit_of_time(seed: int, unit: float) -> None:
    """Both have the same branches and events: one had ghosts (41), or no T next to an end (248)."""
    here, there = drawn(seed), drawn(seed, unit)
    assert not there.loose_ends
    for places in (_ends_of_branches, _places_of_events):
        one, other = places(here, 1.0), places(there, unit)
        assert [kind for kind, *_ in one] == [kind for kind, *_ in other]
        assert np.allclose([at for _, *at in one], [at for _, *at in other], atol=PLACE)


def _ends_of_branches(diagram: cf.Diagram, unit: float) -> list[tuple[object, float, float]]:
    own = [b for b in diagram.branches if not b.mirrored]
    return sorted(
        (b.bridge, *sorted(round(at / unit, 7) for at in (b.values[0], b.values[-1]))) for b in own
    )


def _places_of_events(diagram: cf.Diagram, unit: float) -> list[tuple[str, float]]:
    """Where each kind of event is; which branch gives an orbit its name differs."""
    found = [n.bifurcation for n in diagram.events if not n.mirrored]
    return sorted((b.kind.value, round(b.params["w"] / unit, 7)) for b in found)


@pytest.mark.parametrize("seed", SEEDS)
def test_its_signature_is_read_back(seed: int) -> None:
    """The modes of its parts follow from the domains before and behind it, and it counts as one hold."""
    for orbit, _, _ in long_holds(drawn(seed)):
        signature = orbit.signature
        again = parse_signature(str(signature), orbit.model)
        assert reduced_itinerary(again) == canonical_itinerary(orbit.itinerary, orbit.model)
        parts = sum(is_hold(exit_) for _, exit_ in orbit.itinerary)
        assert signature.holds == len(orbit.system.ends_of_holds) < parts


@pytest.mark.parametrize("seed", [34])
def test_one_is_proved(seed: int) -> None:
    """In balls there is one such orbit near the printed one, and it obeys every inequality."""
    orbit, _, _ = long_holds(drawn(seed))[1]
    assert orbit.certify().proved
