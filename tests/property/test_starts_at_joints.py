"""Simulations that start at the joints of an orbit: each walks the itinerary of the orbit from there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from two_masses import stuck_next_to_a_gap

import contfric as cf
from contfric.errors import ContfricError

#: Periods of the orbit that each simulation covers, and how near it stays where the orbit is stable.
PERIODS, NEAR = 3, 1e-6
#: Models with rest, hysteresis, sliding, resets, chatter and sections.
QUICK = (
    "bang-bang",
    "blade-damper",
    "coulomb",
    "dead-band",
    "jenkins",
    "relay-sliding",
    "two-blocks",
)
OTHERS = (
    "beam-stop",
    "belt",
    "braced-chain",
    "buck",
    "gear-pair",
    "impact",
    "iwan",
    "normal-force",
)
OTHERS += ("pendulum", "popp", "pounding", "rimless-wheel", "rocking-block", "storeys", "stribeck")
CHATTER: tuple[tuple[str, dict[str, float]], ...] = (
    ("bouncing-ball", {"a": 1.2, "e": 0.5}),
    ("impact", {"w": 0.25, "e": 0.4, "d": 0.2}),
    ("pounding", {"w": 0.3, "e": 0.2, "d": 0.0, "F": 0.5}),
)


def structure(seed: int) -> cf.Model:
    """Return two or three masses with friction, a spring with a gap, and some with a Jenkins element."""
    draw = np.random.default_rng(seed)
    n = int(draw.integers(2, 4))
    between = np.abs(draw.normal(size=(n, n))) * 0.5
    between += between.T
    stiffness = np.diag(np.sum(between, axis=1) + draw.uniform(0.5, 1.5, n)) - between
    stiffness += np.diag(np.diag(between))
    limit = float(draw.choice([draw.uniform(0.3, 3.0), draw.uniform(0.05, 0.3)]))
    contacts: dict[str, dict[str, Any]] = {}
    for i in draw.choice(n, size=int(draw.integers(1, n + 1)), replace=False):
        static = limit * float(draw.choice([1.0, 1.3]))
        force = {"kinetic": limit, "static": static}
        contacts[f"c{i + 1}"] = {"kind": "friction", "velocity": f"v{i + 1}", **force}
    gap = f"{float(draw.uniform(-0.05, 0.15))} - q{int(draw.integers(1, n + 1))}"
    contacts["stop"] = {"kind": "spring", "gap": gap, "stiffness": float(draw.uniform(0.5, 4.0))}
    if draw.random() < 0.4:
        element = {"displacement": "q1 - q2", "stiffness": 1.0, "limit": 0.1}
        contacts["jk"] = {"kind": "jenkins", **element}
    return cf.Mechanism(
        np.eye(n),
        float(draw.uniform(0.05, 0.15)) * stiffness,
        stiffness,
        contacts=contacts,
        force={f"q{i + 1}": f"{0.5 * float(draw.normal())}*cos(w*t)" for i in range(n)},
        parameters={"w": float(draw.uniform(0.4, 1.3))},
        period="2*pi/w",
    )


def check_starts(orbit: cf.Orbit) -> None:
    """Start at every joint of the whole cycle, at its time, after its reset."""
    model, begins, ends = orbit.model, orbit.begins, orbit.ends
    smooth = all(pair in model.sections for pair in orbit.itinerary)

    def events(itinerary: Any) -> list[tuple[int, tuple[str, str]]]:
        """Return the events but sections, of which an orbit that has others shows none; modes as wholes."""
        kept = [
            (i, pair) for i, pair in enumerate(itinerary) if smooth or pair not in model.sections
        ]
        return [(i, (mode if smooth else model.whole_mode(mode), s)) for i, (mode, s) in kept]

    count, unit = len(begins), 1.0 if model.autonomous else orbit.flow.period
    for j, (t, *y) in enumerate(begins.tolist()):
        length = (PERIODS + 0.5) * orbit.period / unit
        found = cf.simulate(model, orbit.params, state=y, time=t, periods=length)
        order = [(j + i) % count for i in range(PERIODS * count)]
        expected, met = events([orbit.itinerary[k] for k in order]), events(found.itinerary)
        if (
            orbit.itinerary[j][0] in model.chatter_by_mode
        ):  # a few impacts come before it is known as one
            known = next(i for i, (_, pair) in enumerate(met) if pair == expected[0][1])
            assert all(s in {c.surface for c in model.chatters} for _, (_, s) in met[:known])
            met = met[known:]
        assert [pair for _, pair in met[: len(expected)]] == [pair for _, pair in expected], (
            j,
            t,
            y,
        )
        if orbit.stable:
            there = ends[[order[i] for i, _ in expected], 1:]
            here = found.states[[i for i, _ in met[: len(expected)]]]
            assert np.max(np.abs(here - there), initial=0.0) < NEAR, (j, t, y)


@pytest.mark.parametrize("name", QUICK)
def test_of_bundled_models(name: str) -> None:
    check_starts(cf.find_orbit(name))


@pytest.mark.parametrize("name", ["blade-damper", "coulomb", "jenkins"])
def test_of_sections(name: str) -> None:
    """Compiled starts, as those of sweeps, maps and basins, go on as simulations do."""
    orbit = cf.find_orbit(name)
    period = orbit.flow.period
    for t, *y in orbit.begins.tolist():
        found = cf.poincare(
            orbit.model,
            orbit.params,
            y,
            section=0.37,
            time=t,
            periods=PERIODS,
            transient=0,
        )
        followed = cf.simulate(orbit.model, orbit.params, state=y, time=t, periods=PERIODS + 1)
        begun = np.floor(t / period)
        assert len(found.states) >= PERIODS - 1, (t, y)
        there = followed.sample((begun + found.cycles) * period + found.times)
        assert np.max(np.abs(found.states - there)) < NEAR, (t, y)


@pytest.mark.slow
@pytest.mark.parametrize("name", OTHERS)
def test_of_other_bundled_models(name: str) -> None:
    check_starts(cf.find_orbit(name))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "params"), CHATTER)
def test_of_chatter(name: str, params: dict[str, float]) -> None:
    check_starts(cf.find_orbit(name, params))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(9, 19))
def test_of_random_structures(seed: int) -> None:
    """A contact that sticks has a velocity of rounding, and the gap of a spring may close there."""
    try:
        orbit = cf.find_orbit(structure(seed))
    except ContfricError as error:
        pytest.skip(f"no orbit: {error}")
    check_starts(orbit)


@pytest.mark.parametrize("seed", [0, 1])
def test_of_a_contact_that_sticks_where_a_gap_closes(seed: int) -> None:
    """The velocity of the stuck contact is rounding in the state that a user hands over."""
    model = stuck_next_to_a_gap(np.random.default_rng(seed), 0.03)
    orbit = cf.find_orbit(model, at={"c1": 0.0})
    for t, *y in orbit.begins.tolist():
        for velocity in (1e-32, -1e-32, 1e-17, -1e-17, 0.0):
            y[2] = velocity
            found = cf.simulate(model, state=y, time=t, periods=3.5)
            assert {mode.rstrip("-")[0] for mode, _ in found.itinerary} == {"s"}, (t, y)
            assert len([s for _, s in found.itinerary if s == "stop"]) >= 6
