"""What a horseshoe of the release map of ``coulomb`` states, decided in 60 digits by stepping; and others.

Solutions are steps of Taylor's series of the equation of motion, as those of :mod:`tests.certificate_oracle`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from flint import ctx
from mpmath import mp, mpf

import contfric as cf
from contfric.certify.horseshoe import Horseshoe, _covering
from contfric.certify.releases.returns import Release, ReturnMap
from contfric.certify.releases.stretch import UndecidedError
from tests.certificate_oracle import DIGITS, Truth

#: Steps in which a stop or a release is looked for, and of Newton's method from there.
STEP, NEWTON = mpf("0.2"), 9

#: A horseshoe that is proved.
STATED = Horseshoe(
    {"Omega": 0.396, "S": 0.082, "S0": 0.4, "h": 0.0, "zeta": 0.0},
    6,
    (2.2180320133043097, 2.4546760491510367),
    ((2.22529479629277, 2.2927279719380054), (2.427594323228476, 2.4474276101829573)),
    472,
)


class Releases:
    """The release map, in 60 digits."""

    def __init__(self, params: dict[str, float]) -> None:
        own = {"h": 0.0, "zeta": 0.0} | params
        self.truth = Truth({"params": own, "half": False, "periods": 1, "segments": []})

    def follow(self, phase: mpf) -> tuple[mpf, tuple[int, ...]]:
        """Return the time of the next release after one on F+, in the mirror if on F-; and its slides."""
        truth, t, sign, slides = self.truth, phase, -1, list[int]()
        x = truth.s0 + truth.force(phase)
        while True:
            slides.append(sign)
            t, x = self._stop(sign, t, x)
            load = x - truth.force(t)
            if abs(load) < truth.s0:
                break
            sign = -1 if load > 0 else 1
        while abs(x - truth.force(t + STEP)) < truth.s0:
            t += STEP
        side = 1 if x - truth.force(t + STEP) > 0 else -1
        t += STEP
        for _ in range(NEWTON):
            t += (x - truth.force(t) - side * truth.s0) / truth.force(t, 1)
        return (t if side > 0 else t - truth.turn / 2), (*slides, side)

    def _stop(self, sign: int, t: mpf, x: mpf) -> tuple[mpf, mpf]:
        """Return where a slide from rest stops."""
        truth, v = self.truth, mpf(0)
        while True:
            y, w = truth.step(sign, t, x, v, STEP)
            if sign * w <= 0:
                break
            t, x, v = t + STEP, y, w
        if v == 0:
            raise ValueError("a slide is shorter than a step")
        tau = STEP * v / (v - w)
        for _ in range(NEWTON):
            y, w = truth.step(sign, t, x, v, tau)
            tau -= w / (truth.force(t + tau) - y - 2 * truth.zeta * w - sign * truth.s)
        return t + tau, y

    def image(self, phase: float, returns: int) -> tuple[mpf, tuple[tuple[int, ...], ...]]:
        """Return the time of a later release, and the slides on the way."""
        found, ways = mpf(phase), []
        with mp.workdps(DIGITS):
            for _ in range(returns):
                found, way = self.follow(found)
                ways.append(way)
        return found, tuple(ways)


def false_intervals(stated: Horseshoe) -> list[tuple[float, float]]:
    """Return the intervals whose ends are not mapped to the two sides of the window."""
    map_, found = Releases(stated.params), list[tuple[float, float]]()
    with mp.workdps(DIGITS):
        low, high = (mpf(c) for c in stated.window)
        for interval in stated.intervals:
            ends = [map_.image(t, stated.returns)[0] for t in interval]
            turns = mp.nint((sum(ends) - low - high) / 2 / map_.truth.turn)
            shift = turns * map_.truth.turn
            if not (min(ends) < low + shift and high + shift < max(ends)):
                found.append(interval)
    return found


def proves(stated: Horseshoe, interval: tuple[float, float]) -> bool:
    """Tell whether a statement about one of its intervals is proved."""
    model = cf.load_model("coulomb")
    release = Release("stick", "F+", "v", 1, 5, "F-")
    with ctx.workprec(100):
        returns = ReturnMap(model, model.vector(stated.params), release)
        try:
            return _covering(returns, stated.returns, stated.window, interval) > 0
        except UndecidedError:
            return False


def changed(stated: Horseshoe, rng: np.random.Generator) -> Horseshoe:
    """Return another statement: other parameters, returns or intervals, or a window that is too wide."""
    what = rng.choice(["params", "returns", "interval", "window"], p=[0.2, 0.1, 0.3, 0.4])
    if what == "params":
        name, size = rng.choice(["Omega", "S", "S0"]), 10.0 ** rng.uniform(-5, -2)
        return replace(
            stated,
            params=stated.params | {name: stated.params[name] * (1 + rng.choice([-1, 1]) * size)},
        )
    if what == "returns":
        return replace(stated, returns=stated.returns + int(rng.choice([-1, 1])))
    k, end = int(rng.integers(len(stated.intervals))), int(rng.integers(2))
    interval = list(stated.intervals[k])
    if what == "interval":
        interval[end] += rng.uniform(0.01, 0.9) * (interval[1 - end] - interval[end])
        every = [tuple(interval) if j == k else own for j, own in enumerate(stated.intervals)]
        return replace(stated, intervals=tuple(every))
    # a window whose end is next to the image of an end of an interval, on one of its sides
    map_ = Releases(stated.params)
    image = float(map_.image(interval[end], stated.returns)[0])
    turns = round((image - sum(stated.window) / 2) / float(map_.truth.turn))
    image += float(rng.choice([-1, 1]) * 10.0 ** rng.uniform(-13, -4)) - turns * float(
        map_.truth.turn
    )
    low, high = stated.window
    return replace(stated, window=(image, high) if image < (low + high) / 2 else (low, image))
