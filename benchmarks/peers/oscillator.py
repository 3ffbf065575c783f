"""What all peers share: the parameters, the release from a stick, and how an integrator is called."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

#: (Omega, S, S0)
Params = tuple[float, float, float]

#: Derivatives of position and velocity by a quantity that the slide depends on.
Tangent = tuple[float, float]

#: A slide is looked at for two periods of the excitation: a longer one would not belong to orbit 1a.
LONGEST_SLIDE = 2.0

#: A slide that ends this soon has its start reported as its stop; real ones here last longer than 1.
SHORTEST_SLIDE = 1e-9


class Failure(Exception):
    """A method gave no result; the text says why."""


@dataclass
class Counter:
    """Evaluations of a right-hand side, or steps where a package does not count those."""

    calls: int = 0


class Integrator(Protocol):
    """Integrates a slide to its stop."""

    rtol: float
    unit: str

    def slide(
        self,
        t: float,
        x: float,
        sign: int,
        params: Params,
        counter: Counter,
        tangents: Sequence[Tangent] = (),
    ) -> tuple[float, np.ndarray]:
        """Return time and state at the stop that ends a slide from rest at (t, x).

        The state is position and velocity, then both of each tangent: the first tangent is by the time of
        the release, the second one by Omega, which also acts on the excitation.
        """
        ...


def checked(start: float, end: float) -> float:
    """Return the time of a stop, unless it is the start that was taken for one."""
    if end <= start + SHORTEST_SLIDE:
        raise Failure("the event was not seen: the slide ends where it starts")
    return end


def until(t: float, params: Params) -> float:
    """Return the time at which the search for a stop is given up."""
    return t + LONGEST_SLIDE * 2 * math.pi / params[0]


def release(expected: float, x: float, params: Params) -> float:
    """Return the time nearest to the expected one at which the load of a mass held at x falls to -S0.

    Nearest and not next: a step past the end of the branch, where the stick has no length left, is
    still one that can be taken.
    """
    omega, _, S0 = params
    if abs(x + S0) > 1:
        raise Failure("a stick without a release")
    phase = 2 * math.pi - math.acos(x + S0)
    return (phase + 2 * math.pi * round((omega * expected - phase) / (2 * math.pi))) / omega


def first_release(t: float, x: float, params: Params) -> float:
    """Return the first time after t at which the load of a mass held at x reaches S0 or -S0."""
    omega, _, S0 = params
    found = []
    for level in (x - S0, x + S0):
        if abs(level) > 1:
            continue
        for phase in (math.acos(level), 2 * math.pi - math.acos(level)):
            laps = math.ceil((omega * t - phase) / (2 * math.pi))
            found.append((phase + 2 * math.pi * laps) / omega)
    if not found:
        raise Failure("held for ever")
    return min(found)
