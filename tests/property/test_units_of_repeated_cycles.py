"""Units of solutions that repeat themselves: each turn of the orbit is one, with or without excitation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import contfric as cf
from contfric.events.incident.unit import form_of, pieces, unit_of

FLYBACK = Path(__file__).resolve().parents[2] / "benchmarks" / "stress" / "typed" / "flyback.yaml"
SCENES = [
    ("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4}),
    ("belt", {}),
    ("relay", {}),
    ("thermostat", {}),
    (FLYBACK, {}),
]


@pytest.mark.parametrize(
    ("model", "params"), SCENES, ids=["coulomb", "belt", "relay", "thermostat", "flyback"]
)
def test_every_turn_is_a_unit(model: str | Path, params: dict[str, float]) -> None:
    orbit = cf.find_orbit(model, params).as_whole()
    own = pieces(orbit, unit_of(orbit))
    twice = orbit.doubled()
    for whole in (twice, twice.doubled()):
        turns = round(whole.period / orbit.period)
        unit = unit_of(whole)
        found = pieces(whole, unit)
        assert len(found) == turns * len(own)
        covered = [i % len(whole.itinerary) for piece in found for i in piece.segments]
        assert sorted(covered) == list(range(len(whole.itinerary)))
        away = np.zeros(len(whole.itinerary))
        for piece in found:
            form = form_of(whole, away, unit, piece, "")
            assert form.joints[0, 0] == pytest.approx(unit.cut[0], abs=1e-9)
            begins = unit.image(whole.begins[piece.segments[0]][None], -piece.number)[0]
            assert np.abs(begins - unit.cut)[1:].max() < 1e-9
            assert piece.itinerary in {p.itinerary for p in found[: len(own)]}


def test_a_border_collision_of_a_clocked_converter_is_the_same_from_its_doubled_orbit() -> None:
    """Where the current just vanishes at the tick of the clock both orbits of one period meet one of two."""
    rng, told = np.random.default_rng(115), 0
    for _ in range(3):
        params = {
            "E": 26.965 * rng.uniform(0.98, 1.02),
            "n": 0.55778,
            "L": 0.000212812,
            "Ip": 2.589,
        }
        params |= {"C": 9.63739e-5, "R": 22.245 * rng.uniform(0.98, 1.02), "Ts": 4.067275e-5}
        orbit = cf.find_orbit(FLYBACK, params, longest=1000)
        diagram = cf.explore(orbit, "Ip", (2.4, 4.4), max_periods=2)
        if any(b.system.periods == 2 for b in diagram.branches):
            found = diagram.verify()
            assert found.passed, str(found)
            told += 1
    assert told >= 2
