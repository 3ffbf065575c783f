"""Located events of random explorations, against 50 digits; orbits and branches next to them.

``python benchmarks/stress/events.py --count 100 --seed 0 --out events.json``
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from beside import beside
from bordered import TooLong, locate
from chain import DIGITS, NoReference
from mpmath import mp, mpf
from report import Report, Tally, command_line
from scenes import Params, generator, refusal, strictly, time_limit

import contfric as cf
from contfric.events.bifurcation import ACCURACY

WHAT = "Events of random explorations, compared with their own equations solved in 50 digits."
#: Accuracy that is asked of a located parameter, relative; its condition explains more.
ASKED = 1e-12
#: Longest that one case may take (s).
LIMIT = 120.0
#: Events of one exploration that are compared: some have hundreds, of few kinds.
MOST_EVENTS = 30
MOST_BRANCHES = 20
#: Largest steps: an event must not depend on where the step stood that met it.
STEPS = (0.01, 0.003, 0.001)
#: Names of the parameters and half-widths of their ranges, relative to 1 + the value.
HALF_WIDTHS = {"Omega": 0.15, "S": 0.25, "S0": 0.3, "h": 0.35, "zeta": 0.15}

Progress = Callable[[str], None] | None
Scene = tuple[cf.Orbit, str, tuple[float, float]]


def run(count: int, seed: int, *, progress: Progress = None) -> Report:
    """Explore from random starts and check every event."""
    began, tally = time.perf_counter(), Tally()
    for index in range(count):
        tally.index = index
        try:
            with strictly(), time_limit(LIMIT), mp.workdps(DIGITS):
                one_case(tally, seed, index)
        except (
            Exception
        ) as error:  # whatever it is, it is a failure of this case and not of the run
            tally.check("no exception", False, repr(error))
        else:
            tally.check("no exception", True)
        if progress is not None and index % 10 == 9:
            progress(f"events: {index + 1} of {count}, {len(tally.failed)} failures")
    return tally.report("events", WHAT, count, seed, time.perf_counter() - began)


def scene(tally: Tally, seed: int, index: int) -> Scene | None:
    """Return an orbit, a parameter and a range; None if nothing periodic attracts there."""
    rng = generator(seed, index)
    params = draw(rng)
    try:
        orbit = cf.find_orbit("coulomb", params, longest=3000)
    except cf.ContfricError as error:
        tally.met(refusal(error))
        return None
    parameter = str(rng.choice(list(HALF_WIDTHS)))
    value, half = params[parameter], HALF_WIDTHS[parameter] * rng.uniform(0.2, 1.0)
    half *= 1.0 + abs(value)
    low, high = value - half, value + half
    if parameter == "Omega":
        low = max(low, 0.3 * value)
    return orbit, parameter, (low, high)


def draw(rng: np.random.Generator) -> Params:
    """Return parameters at which something happens nearby: three of four of moderate size."""
    wide = rng.random() < 0.25
    S = 10.0 ** rng.uniform(-2.5, -0.5) if wide else rng.uniform(0.03, 0.6)
    above = S * rng.uniform(1.0, 2.2) if rng.random() < 0.7 else S + rng.uniform(0.0, 0.5)
    omega = rng.uniform(0.05, 2.5) if wide else rng.uniform(0.2, 0.85)
    return {
        "Omega": omega,
        "S": S,
        "S0": S if rng.random() < 0.1 else above,
        "h": float(rng.choice([0.0, 0.0, rng.uniform(-0.4, 0.4)])),
        "zeta": float(rng.choice([0.0, 0.0, rng.uniform(0.0, 0.2), 10.0 ** rng.uniform(-6, 0)])),
    }


def one_case(tally: Tally, seed: int, index: int) -> None:
    """Explore, and look at every event and next to it."""
    found = scene(tally, seed, index)
    if found is None:
        return
    orbit, parameter, bounds = found
    step = float(generator(seed, index).choice(STEPS))
    try:
        # what is compared are motions; tests/property/test_bridges.py is about bridges
        diagram = cf.explore(
            orbit, parameter, bounds, bridges=False, max_branches=MOST_BRANCHES, max_step=step
        )
    except cf.ContfricError as error:
        tally.met(f"explore: {refusal(error)}")
        return
    for event in diagram.bifurcations[:MOST_EVENTS]:
        where = (
            f"{event.kind.value} in {parameter} at {event.params}, {event.orbit.name}, explored from "
            f"{orbit.params} in ({bounds[0]!r}, {bounds[1]!r}) with max_step {step}"
        )
        if not event.located:
            tally.check("event is located", False, where)
            continue
        tally.check("event is located", True)
        if event.accuracy > ACCURACY:  # CS and AS at once: the reference, too, is singular there
            tally.met(f"{event.kind.value}: located to the root of rounding, as the event says")
            continue
        if events_of(tally, event, parameter, where):
            beside(tally, event, parameter, bounds, where)


def events_of(tally: Tally, event: cf.Bifurcation, parameter: str, where: str) -> bool:
    """Compare one event with its equations; False if there is nothing to compare with."""
    kind = event.kind.value
    try:
        exact = locate(event, parameter)
    except TooLong as reason:
        tally.met(f"{kind}: {reason}")
        return False
    except NoReference as reason:  # in 50 digits there is no such event
        return tally.check(f"{kind}: its parameter", False, f"{where}: {reason}")
    error = float(abs(exact.value - mpf(event.params[parameter])))
    relative = error / max(abs(event.params[parameter]), 1e-300)
    fine = relative <= ASKED or error <= exact.allowed
    text = f"{where}: off by {error:.3g} ({relative:.2g}), rounding explains {exact.allowed:.2g}"
    tally.check(f"{kind}: its parameter", fine, text)
    tally.largest(f"{kind}: error, of what rounding explains", error / exact.allowed)
    tally.largest(f"{kind}: error", error)
    if relative > ASKED:
        tally.met(f"{kind}: beyond 1e-12 relative, explained by its condition", int(fine))
    return True


if __name__ == "__main__":
    command_line(run, count=100)
