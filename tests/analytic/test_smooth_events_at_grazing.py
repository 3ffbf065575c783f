"""Where SN, BP or PD meets grazing-sliding: both conditions solved in 40 digits, from another step as well.

With zeta = 0 a slide is known in closed form. A turn of the friction oscillator is a list of slides: each
begins at a stop, where a stick is released (``x - f = S0`` or ``-S0``) or directly after the slide before it,
and ends where v = 0. The multiplier is the product of what a disturbance of (time, x) becomes over each.
Nothing of the library is used but the first guess.
"""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

import contfric as cf
from contfric.bvp.system import Margin

PLANE = ("Omega", "S")
SIGN = {"SN": 1, "PD": -1, "BP": -1}


def load(t, omega, h):
    """Return the force at a time, and its rate."""
    waves = ((1, 1), (3, h))
    return (
        sum(size * mp.cos(k * omega * t) for k, size in waves),
        -sum(size * k * omega * mp.sin(k * omega * t) for k, size in waves),
    )


def slide(a, x, b, friction, omega, h):
    """Return x and v at time b of a slide that begins at rest at (a, x)."""

    waves = ((1, 1 / (1 - omega**2)), (3, h / (1 - 9 * omega**2)))

    def forced(t):
        return sum(size * mp.cos(k * omega * t) for k, size in waves) - friction

    def rate(t):
        return -sum(size * k * omega * mp.sin(k * omega * t) for k, size in waves)

    x0, v0, d = x - forced(a), -rate(a), b - a
    return (
        forced(b) + x0 * mp.cos(d) + v0 * mp.sin(d),
        rate(b) - x0 * mp.sin(d) + v0 * mp.cos(d),
    )


class Turn:
    """The slides of one turn of an orbit, as equations in their begins, ends, places, Omega and S."""

    def __init__(self, special: cf.SpecialPoint, kind: str) -> None:
        orbit = special.orbit
        (tangential,) = {t.segment for t in special.tests if t.margin is Margin.EXIT}
        self.multiplier, self.half = SIGN[kind], orbit.system.half
        self.s0, self.h, self.periods = orbit.params["S0"], orbit.params["h"], orbit.system.periods
        parts = list(zip(orbit.itinerary, orbit.begins, orbit.ends, strict=True))
        parts = parts[: orbit.system.segments]  # of a symmetric orbit half a turn, to its image
        first = [i for i, (entry, _, _) in enumerate(parts) if entry[0] != "stick"]
        slides = [parts[i] for i in first]
        self.tangential = first.index(tangential)
        self.signs = [int(np.sign(b[1] - a[1])) for _, a, b in slides]
        self.after_stick = [parts[i - 1][0][0] == "stick" for i in first]
        omega = special.params["Omega"]
        self.released = [int(np.sign(a[1] - load(a[0], omega, self.h)[0])) for _, a, _ in slides]
        self.guess = [float(value) for _, a, b in slides for value in (a[0], a[1], b[0])]
        self.guess += [special.params[name] for name in PLANE]

    def residuals(self, *unknowns):
        """Return what vanishes at the point; a disturbance (dt, dx) starts where a stick is released."""
        *places, omega, s = unknowns
        count = len(self.signs)
        slides = [tuple(places[3 * k : 3 * k + 3]) for k in range(count)]
        turn = 2 * mp.pi * self.periods / omega / (2 if self.half else 1)
        image, out = -1 if self.half else 1, []
        begin = self.after_stick.index(True)
        dt, dx = 1, load(slides[begin][0], omega, self.h)[1]
        start = dx
        for k in [*range(begin, count), *range(begin)]:
            (a, x, b), friction, following = slides[k], s * self.signs[k], (k + 1) % count
            end, speed = slide(a, x, b, friction, omega, self.h)
            pushed = load(a, omega, self.h)[0] - x - friction
            slowed = load(b, omega, self.h)[0] - end - friction
            mirrored, later = (image, turn) if following == 0 else (1, 0)
            out += [speed, mirrored * end - slides[following][1]]
            if self.after_stick[k]:
                out.append(x - load(a, omega, self.h)[0] - self.released[k] * self.s0)
            if not self.after_stick[following]:
                out.append(b - later - slides[following][0])
            if k == self.tangential:
                out.append(slowed)
            faster = -dx * mp.sin(b - a) - pushed * dt * mp.cos(b - a)
            dx = mirrored * (dx * mp.cos(b - a) - pushed * dt * mp.sin(b - a))
            if self.after_stick[following]:
                dt = dx / load(slides[following][0], omega, self.h)[1]
            else:
                dt = -faster / slowed
        return [*out, dx / start - self.multiplier]

    def solved(self):
        """Return Omega and S of the point."""
        with mp.workdps(40):
            found = mp.findroot(self.residuals, self.guess, tol=1e-60, maxsteps=30)
            return [float(v) for v in found][-2:]


def meetings(
    offset: float,
    h: float,
    section: float,
    ranges: dict[str, tuple[float, float]],
    step: float | None,
) -> list[tuple[str, cf.SpecialPoint]]:
    """Return the points of a plane at which a smooth event meets a tangential exit."""
    params = {"Omega": 0.5, "S": 0.8 * offset, "S0": offset, "h": h}
    plane = cf.explore_plane(
        cf.find_orbit("coulomb", params),
        PLANE,
        ranges,
        {"S": [section]},
        max_periods=1,
        max_sections=1,
        max_step=step,
    )
    return [
        (curve.kind.value, point)
        for curve in plane.curves
        for point in curve.special
        if curve.kind.value in SIGN and any(t.margin is Margin.EXIT for t in point.tests)
        if point.meets is cf.Kind.GS
    ]


ALL = {"Omega": (0.1, 0.7), "S": (0.02, 0.38)}


@pytest.mark.parametrize(
    ("offset", "h", "section", "ranges", "kinds"),
    [
        (0.3, 0.0, 0.2, {"Omega": (0.12, 0.16), "S": (0.19, 0.23)}, {"SN"}),
        (0.3, 0.0, 0.085, {"Omega": (0.19, 0.26), "S": (0.06, 0.11)}, {"PD"}),
        (0.4, 0.0, 0.09, {"Omega": (0.23, 0.26), "S": (0.08, 0.11)}, {"BP"}),
        pytest.param(0.4, 0.0, 0.1, ALL, {"SN"}, marks=pytest.mark.slow),
        pytest.param(0.4, -0.05, 0.1, ALL, {"SN"}, marks=pytest.mark.slow),
        pytest.param(0.5, 0.0, 0.1, ALL, {"PD"}, marks=pytest.mark.slow),
    ],
)
def test_the_point_solves_both_conditions_whatever_the_step(
    offset: float,
    h: float,
    section: float,
    ranges: dict[str, tuple[float, float]],
    kinds: set[str],
) -> None:
    met: set[str] = set()
    for step in (None, 0.0031):
        for kind, point in meetings(offset, h, section, ranges, step):
            assert point.located, point
            assert [point.params[n] for n in PLANE] == pytest.approx(
                Turn(point, kind).solved(), rel=0.0, abs=1e-10
            )
            met.add(kind)
    assert met >= kinds
