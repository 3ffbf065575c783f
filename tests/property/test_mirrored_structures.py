"""Two equal structures side by side: every event of one falls together with that of the other.

Their motion is that of one of them, simulated by itself. Which of two events that fall together comes first
is decided by rounding, and a contact then begins a mode with its velocity, or its load, a rounding beyond.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest

import contfric as cf
from contfric.simulation.simulate import SimulationEnd

PERIODS = 4
#: Errors of locations (1e-15) grow by the stiffest contact over some stops: far above that, far below an
#: event that is missed (1e-3 and more).
NEAR = 1e-9


class Half(NamedTuple):
    """One of the two: two masses in a row, with contacts."""

    mass: np.ndarray
    stiffness: np.ndarray
    contacts: dict[str, dict[str, Any]]
    forces: list[str]
    w: float


def drawn(seed: int) -> Half:
    """Draw masses with friction, an element between them that slides, and a stop."""
    r = np.random.default_rng([71, seed])
    k, w = r.uniform(0.3, 2.0, 3), round(float(r.uniform(0.4, 1.4)), 3)
    contacts: dict[str, dict[str, Any]] = {}
    for i in "12":
        kinetic = round(float(r.uniform(0.1, 0.4)), 3)
        static = kinetic + (0.1 if r.random() < 0.4 else 0.0)
        if r.random() < 0.8:
            contacts[f"f{i}"] = {"kind": "friction", "velocity": f"v{i}", "kinetic": kinetic}
            contacts[f"f{i}"]["static"] = static
    contacts["jk"] = {"kind": "jenkins", "displacement": "q1 - q2", "stiffness": 1.2}
    contacts["jk"]["limit"] = round(float(r.uniform(0.05, 0.2)), 3)
    if r.random() < 0.4:
        contacts["stop"] = {"kind": "spring", "gap": "0.4 - q1", "stiffness": 10.0}
    force = round(float(r.uniform(0.6, 1.5)), 3), round(float(r.uniform(-0.3, 0.3)), 3)
    return Half(
        np.diag(r.uniform(0.6, 1.6, 2)),
        np.array([[k[0] + k[1], -k[1]], [-k[1], k[1] + k[2]]]),
        contacts,
        [f"{force[0]}*cos({w}*t)", f"({force[1]})"],
        w,
    )


def structure(half: Half, copies: int) -> cf.Model:
    """Return copies of a structure, with springs and an element between their second masses."""
    one, size = np.eye(copies), 2 * copies
    mass, stiffness = np.kron(one, half.mass), np.kron(one, half.stiffness)
    contacts, forces = {}, {}
    for j in range(copies):
        forces |= {f"q{2 * j + i + 1}": force for i, force in enumerate(half.forces)}
        for name, contact in half.contacts.items():
            contacts[f"{name}_{'ab'[j]}"] = {key: _moved(x, 2 * j) for key, x in contact.items()}
    damping = 0.08 * stiffness
    if copies == 2:
        apart = np.zeros(size)
        apart[[1, 3]] = 1.0, -1.0
        stiffness = stiffness + 0.7 * np.outer(apart, apart)
        between = {"kind": "jenkins", "displacement": "q2 - q4", "stiffness": 1.5, "limit": 0.2}
        contacts["between"] = between
    return cf.Mechanism(
        mass, damping, stiffness, contacts=contacts, force=forces, period=f"2*pi/{half.w}"
    )


def _moved(value: Any, by: int) -> Any:
    """Return an entry of a contact for the coordinates of a copy."""
    if not isinstance(value, str) or value in ("friction", "jenkins", "spring"):
        return value
    for i in "21":
        value = value.replace(f"q{i}", f"q{int(i) + by}").replace(f"v{i}", f"v{int(i) + by}")
    return value


@pytest.mark.parametrize("seed", range(6))
def test_two_equal_structures_move_as_one(seed: int) -> None:
    """What stops, slips and closes in one does so in the other at the same time, in whatever order."""
    half = drawn(seed)
    one, two = structure(half, 1), structure(half, 2)
    elements = np.zeros(len(one.states) - 4)
    start = np.array([0.3, -0.2, 0.1, 0.0])
    begin = np.concatenate([start, elements])
    alone = cf.simulate(one, state=begin, periods=PERIODS)
    both = [start[:2], start[:2], start[2:], start[2:], elements, elements, [0.0]]
    found = cf.simulate(two, state=np.concatenate(both), periods=PERIODS)
    assert (alone.end, found.end) == (SimulationEnd.TIME, SimulationEnd.TIME)
    times = np.linspace(0.0, PERIODS * 2.0 * np.pi / half.w * 0.999, 400)
    there, here = alone.sample(times), found.sample(times)
    for first in (0, 2):
        assert np.max(np.abs(here[:, first : first + 2] - there[:, :2])) < NEAR
