"""Random resets with ``from``: what they do not map passes, by another simulation; what ends has no rule."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.optimize import brentq
from typed import typed

import contfric as cf
from contfric.simulation.simulate import SimulationEnd

#: Quarters of the plane by the sides of the gate and of v = 0.
_QUARTERS = tuple(product("+-", repeat=2))
_MAPS = ("{x: -x - 3}", "{v: k*v}", "{v: -k*v}", "{x: x - 2, v: v/2}")


class Case:
    """A driven oscillator whose plane has a mode in each quarter but perhaps one, and a gate with a reset."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.A, self.W, self.at, self.k = (
            float(rng.uniform(*r)) for r in ((1.0, 3.0), (0.6, 1.6), (-0.8, 0.8), (0.2, 0.8))
        )
        left_out = int(rng.integers(0, 8))  # of eight, four are no quarter
        self.modes = {f"q{i}": q for i, q in enumerate(_QUARTERS) if i != left_out}
        self.acts = [m for m in self.modes if rng.random() < 0.4] or ["q0" if left_out else "q1"]
        self.map = int(rng.integers(0, len(_MAPS)))
        self.start = rng.uniform(-1.5, 1.5, 2)

    @property
    def text(self) -> str:
        """The file."""
        modes = "\n".join(
            f"  {m}: {{in: {{gate: {g}, turn: {v}}}}}" for m, (g, v) in self.modes.items()
        )
        reset = f"{_MAPS[self.map][:-1]}, from: [{', '.join(self.acts)}]}}"
        return f"""
name: quarters
states: [x, v]
parameters: {{A: {self.A!r}, W: {self.W!r}, at: {self.at!r}, k: {self.k!r}}}
period: 2*pi/W
surfaces: {{gate: {{observable: x, level: at}}, turn: {{observable: v}}}}
field: {{x: v, v: A*cos(W*t) - x - 0.2*v}}
modes:
{modes}
resets: {{gate: {reset}}}
spread: {{x: 2, v: 2}}
"""

    def moved(self, t: float, y: np.ndarray, after: float) -> np.ndarray:
        """Return the state after a time, whatever the mode: the field is one."""
        c = self.A / (1.0 - self.W**2 + 0.2j * self.W)

        def steady(s: float) -> np.ndarray:
            wave = c * np.exp(1j * self.W * s)
            return np.array([wave.real, (1j * self.W * wave).real])

        (a, b), w = y - steady(t), np.sqrt(1.0 - 0.01)
        co, si, fades = np.cos(w * after), np.sin(w * after), np.exp(-0.1 * after)
        b = (b + 0.1 * a) / w
        x = fades * (a * co + b * si)
        return np.add(steady(t + after), [x, -0.1 * x + fades * w * (b * co - a * si)])

    def sides(self, y: np.ndarray) -> tuple[str, str]:
        """Return the quarter of a state."""
        return ("+" if y[0] > self.at else "-", "+" if y[1] > 0.0 else "-")

    def mapped(self, y: np.ndarray) -> np.ndarray:
        """Return the image of a state."""
        x, v = y
        images = ((-x - 3.0, v), (x, self.k * v), (x, -self.k * v), (x - 2.0, v / 2.0))
        return np.array(images[self.map])

    @property
    def leads_nowhere(self) -> bool:
        """Whether some image on the gate has no mode: that is refused when the file is read."""
        back = {"+": "-", "-": "+"}
        met = [q for m, q in self.modes.items() if m in self.acts and q[0] != q[1]]
        images = {1: [(back[g], v) for g, v in met], 2: [(g, back[v]) for g, v in met]}
        return any(image not in self.modes.values() for image in images.get(self.map, []))

    def followed(self, until: float) -> tuple[list[tuple[str, str]], str]:
        """Return (mode, surface) of all events, and the surface with no mode behind it; else nothing."""
        by_sides = {sides: mode for mode, sides in self.modes.items()}
        t, y, found = 0.0, self.start, []
        mode = by_sides[self.sides(y)]
        while t < until:
            ahead = 0.02
            other = self.moved(t, y, ahead)
            met = [
                (brentq(lambda s, f=f, t=t, y=y: f(self.moved(t, y, s)), 1e-7, ahead), name)
                for name, f in (("gate", lambda z: z[0] - self.at), ("turn", lambda z: z[1]))
                if f(self.moved(t, y, 1e-7)) * f(other) < 0.0
            ]
            if not met:
                t, y = t + ahead, other
                continue
            after, surface = min(met)
            y, t = self.moved(t, y, after), t + after
            found.append((mode, surface))
            if surface == "gate" and mode in self.acts:
                y = self.mapped(y)
            sides = self.sides(self.moved(t, y, 1e-6))
            if sides not in by_sides:
                return found, surface
            mode = by_sides[sides]
        return found, ""


def case(seed: int) -> Case:
    """Return the first case from a seed on whose start is in a mode."""
    found = Case(seed)
    while found.sides(found.start) not in found.modes.values():
        found = Case(seed := seed + 1000)
    return found


@pytest.mark.parametrize("seed", range(12))
def test_what_is_not_mapped_passes(tmp_path, seed: int) -> None:
    """Events agree with another simulation; it ends IMPOSSIBLE just where nothing is behind the gate.

    Nothing behind 'turn' is an error of the file, which `contfric check` reports.
    """
    own = case(seed)
    events, ended = own.followed(4 * 2 * np.pi / own.W)
    if own.leads_nowhere:
        with pytest.raises(cf.ModelError, match="or to none"):
            typed(tmp_path, own.text)
        return
    model = typed(tmp_path, own.text)
    if ended == "turn":
        events.pop()
        assert "and no domain follows" in str(cf.check_model(model))
    found = cf.simulate(model, state=own.start, periods=4)
    whole = len(events) - int(ended == "gate")
    assert [*found.itinerary[:whole]] == events[:whole]
    if ended != "turn":
        assert found.end is (SimulationEnd.IMPOSSIBLE if ended else SimulationEnd.TIME)
        assert len(found) == whole
