"""Searches along structures whose fast modes decay, against the sum over their modes."""

from __future__ import annotations

import time

import numpy as np
import pytest
from numpy.typing import NDArray

import contfric as cf
from contfric.models.view import FlowView


class Structure:
    """A structure with one pad, made of its modes: natural frequencies, and damping in proportion."""

    def __init__(self, seed: int, fastest: float, damping: float | None = None) -> None:
        self.draw = draw = np.random.default_rng(seed)
        n = int(draw.integers(4, 9))
        self.w = np.concatenate(
            [[1.0], np.sort(fastest ** draw.uniform(0.0, 1.0, n - 2)), [fastest]]
        )
        drawn = 10.0 ** draw.uniform(-3.0, -1.3)
        self.beta, self.alpha = damping or drawn, float(draw.uniform(0.0, 0.1))
        turned, _ = np.linalg.qr(draw.normal(size=(n, n)))
        self.modes = turned / np.sqrt(draw.uniform(0.5, 2.0, n))[:, None]  # columns
        back = np.linalg.inv(self.modes)
        mass, stiffness = back.T @ back, back.T @ np.diag(self.w**2) @ back
        stiffness = 0.5 * (stiffness + stiffness.T)
        self.omega, self.friction = float(draw.uniform(0.5, 1.5)), 0.2
        self.n, self.model = n, cf.Mechanism(
            0.5 * (mass + mass.T),
            self.alpha * mass + self.beta * stiffness,
            stiffness,
            contacts={"pad": {"kind": "friction", "velocity": "v1", "kinetic": "S"}},
            force={"q2": "cos(w*t) + 0.5*sin(3*w*t)", "q1": "0.4*cos(w*t)"},
            parameters={"w": self.omega, "S": self.friction},
            period="2*pi/w",
        )  # fmt: skip

    def view(self) -> FlowView:
        """Return the flow at the parameters."""
        return self.model.view(self.model.vector({"w": self.omega, "S": self.friction}))

    def start(self) -> NDArray[np.float64]:
        """Return a state in which every mode moves as fast."""
        q, v = self.draw.normal(size=(2, self.n))
        return np.concatenate([self.modes @ (q / self.w), self.modes @ v])

    def velocity(
        self, sign: float, t: float, y: NDArray[np.float64], taus: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the velocity of the pad and its rate at some durations, (2, len(taus)), by the modes."""
        n, w, mine = self.n, self.w, self.modes[0]
        drag = 0.5 * (self.alpha + self.beta * w**2)
        root = np.sqrt((drag**2 - w**2).astype(complex))
        first, second = -drag + root, -drag - root
        back = np.linalg.inv(self.modes)
        parts = [(0.0, -sign * self.friction * mine.astype(complex))]
        parts += [
            (self.omega, self.modes[1] + 0.4 * mine + 0j),
            (3 * self.omega, -0.5j * self.modes[1]),
        ]
        found, q, v = np.zeros((2, len(taus))), back @ y[:n] + 0j, back @ y[n:] + 0j
        for turn, force in parts:
            answer = force / (w**2 - turn**2 + 2j * turn * drag)
            there = 1j * turn * answer
            q -= (answer * np.exp(1j * turn * t)).real
            v -= (there * np.exp(1j * turn * t)).real
            wave = np.exp(1j * turn * (t + taus))
            found += np.array([(mine @ there * wave).real, (mine @ there * 1j * turn * wave).real])
        a, b = (v - second * q) / (first - second), (first * q - v) / (first - second)
        for rate, size in ((first, a), (second, b)):
            for k in range(n):
                free = mine[k] * size[k] * rate[k] * np.exp(rate[k] * taus)
                found += np.array([free.real, (rate[k] * free).real])
        return found


CASES = [(seed, fastest) for seed in range(2) for fastest in (30.0, 300.0, 1500.0)]


@pytest.mark.parametrize(("seed", "fastest"), CASES)
def test_hits_and_stationary_points_are_those_of_the_modes(seed: int, fastest: float) -> None:
    """None is missed on a fine grid, and each is one, to the rounding of the stiffness."""
    structure = Structure(seed, fastest)
    view, draw, hits, points = structure.view(), structure.draw, 0, 0
    for _ in range(12):
        mode, sign = ("p", 1.0) if draw.random() < 0.5 else ("n", -1.0)
        start, lasts, y = (
            float(draw.uniform(-9.0, 9.0)),
            float(draw.uniform(1.0, 20.0)),
            structure.start(),
        )
        taus = np.sort(np.append(np.geomspace(1e-8, lasts, 3000), np.linspace(1e-8, lasts, 3000)))
        speed, rate = structure.velocity(sign, start, y, taus)
        rounding = 1e-14 * (1.0 + fastest**2) * (1.0 + np.max(np.abs(speed)))
        level = float(draw.choice(speed[3000:]) + draw.choice([0.0, 1e-3, 0.1]))
        found = view.first(mode, "v1", level, start, y, lasts, on=False)
        side = np.sign(speed - level) * (np.abs(speed - level) > 10.0 * rounding)
        across = taus[side == -np.sign(y[structure.n] - level)]
        if found is None:
            assert len(across) == 0
        else:
            assert len(across) == 0 or found[0] <= across[0]
            there = structure.velocity(sign, start, y, np.array([found[0]]))[0, 0]
            assert there == pytest.approx(level, abs=rounding)
            assert found[1][structure.n] == pytest.approx(level, abs=1e-12 * (1.0 + abs(level)))
            hits += 1
        times, values = view.stationary(mode, "v1", start, y, lasts)
        there, slope = structure.velocity(sign, start, y, times)
        assert values == pytest.approx(there, abs=rounding)
        assert np.all(np.abs(slope) <= 1e-9 * np.max(np.abs(rate)))
        late = np.abs(rate) > 1e-9 * np.max(np.abs(rate))
        assert len(times) >= np.count_nonzero(np.diff(np.sign(rate[late])))
        points += len(times)
    assert hits > 4
    assert points > 12


def test_the_time_of_a_search_does_not_grow_with_the_fastest_decay() -> None:
    """A rate of decay of 1e5 takes as long as one of 1e2: ordinary steps take a thousand times as long."""
    structure = Structure(1, 1e3, damping=0.1)
    view, y = structure.view(), structure.start()
    for _ in range(2):  # what is kept of the matrix is there the second time
        begun = time.process_time()
        assert view.first("p", "v1", 1e3, 0.0, y, 20.0, on=False) is None
        times, _ = view.stationary("p", "v1", 0.0, y, 20.0)
        taken = time.process_time() - begun
    assert len(times) > 5
    assert taken < 0.1


@pytest.mark.parametrize("seed", range(4))
def test_a_hit_after_millions_of_decays_is_that_of_the_modes(seed: int) -> None:
    """The load leads to it long after the fastest mode has come to rest, at a rate of decay near 1e6."""
    structure, lasts = Structure(seed, 1e3, damping=0.9), 3.0
    view, rest, taus = structure.view(), np.zeros(2 * structure.n), np.linspace(0.0, 3.0, 3001)
    for start in structure.draw.uniform(0.0, 9.0, 200):
        speed, _ = structure.velocity(1.0, float(start), rest, taus)
        early, highest = np.max(speed[: int(0.85 * len(taus))]), np.max(speed)
        if highest > 1.02 * early > 0.0:
            break
    level = 0.5 * (early + highest)
    found = view.first("p", "v1", level, float(start), rest, lasts, on=False)
    assert found is not None
    assert 0.85 * lasts <= found[0] <= lasts
    assert found[1][structure.n] == pytest.approx(level, abs=1e-8 * (1.0 + abs(level)))
    there, _ = structure.velocity(1.0, float(start), rest, np.array([found[0]]))
    assert there[0] == pytest.approx(level, abs=1e-8 * (1.0 + abs(level)))
