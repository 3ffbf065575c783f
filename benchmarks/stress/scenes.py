"""Random parameters and random starts, all drawn from ``(seed, index)``.

The kinds of parameters cover what is easy and what is not: resonance and its neighbourhood, no damping
and more than critical, friction near zero and near its static limit, a static limit that nearly holds
the mass for ever, and the small friction at which orbits of many periods attract.
"""

from __future__ import annotations

import contextlib
import re
import signal
import warnings
from collections.abc import Iterator

import numpy as np

import contfric as cf

Params = dict[str, float]

#: Dampings: none, from rounding up, critical, more than critical.
ZETAS = (0.0, 0.0, 0.0, 1e-12, 1e-9, 1e-6, 1e-3, 0.05, 0.3, 1.0, 1.0 + 1e-9, 3.0)
#: Distances to resonance; exactly there in one case of seven.
BESIDE = (0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, -1e-9)
#: Periods to simulate before a solution counts as aperiodic: what creeps longer is another start.
LONGEST = 3000
#: Without damping resonance is bounded where friction takes more than the force gives: S > pi/4.
RESONANT = np.pi / 4

KINDS = (
    "any",
    "any",
    "resonance",
    "third",
    "damped",
    "weak",
    "equal",
    "nearly",
    "held",
    "long",
    "long",
)


def generator(seed: int, index: int) -> np.random.Generator:
    """Return the random numbers of one case."""
    return np.random.default_rng([seed, index])


def draw(rng: np.random.Generator) -> tuple[str, Params]:
    """Return a kind and its parameters."""
    kind = str(rng.choice(KINDS))
    S = rng.uniform(0.02, 0.8)
    p = {
        "Omega": float(np.exp(rng.uniform(np.log(0.02), np.log(5.0)))),
        "S": S,
        "S0": S * rng.uniform(1.0, 2.5),
        "h": float(rng.choice([0.0, rng.uniform(-0.3, 0.3)])),
        "zeta": float(rng.choice(ZETAS)),
    }
    return kind, {name: float(value) for name, value in (p | _special(kind, p, rng)).items()}


def _special(kind: str, p: Params, rng: np.random.Generator) -> Params:
    """Return the parameters that make a case one of its kind."""
    beside = float(rng.choice(BESIDE))
    S, S0 = p["S"], p["S0"]
    if kind == "resonance":
        S = rng.uniform(RESONANT, 1.0)
        return {"Omega": 1.0 + beside, "S": S, "S0": S * rng.uniform(1.0, 1.1), "h": 0.0}
    if kind == "third":
        return {"Omega": (1.0 + beside) / 3.0, "h": rng.uniform(-0.3, 0.3)}
    if kind == "damped":
        return {"zeta": 10.0 ** rng.uniform(-2, 1)}
    if kind == "weak":  # damping, or nothing would converge
        S = 10.0 ** rng.uniform(-12, -2)
        return {"S": S, "S0": S + rng.choice([0.0, 1e-9, 1e-3, 0.3]), "zeta": 0.03}
    if kind == "equal":
        return {"S0": S}
    if kind == "nearly":
        return {"S0": S * (1.0 + 10.0 ** rng.uniform(-12, -2))}
    if kind == "held":  # |f| reaches 1 + h: the last limits at which something can move
        return {"S0": max(S, (1.0 + abs(p["h"])) * (1.0 - 10.0 ** rng.uniform(-9, -0.3)))}
    if kind == "long":
        S, zeta = 10.0 ** rng.uniform(-3, -1.5), rng.choice([0.0, 0.0, 10.0 ** rng.uniform(-4, -2)])
        above = rng.uniform(0.1, 0.8)
        return {"Omega": rng.uniform(0.1, 0.9), "S": S, "S0": S + above, "zeta": zeta}
    return {"S0": S0}


def start(rng: np.random.Generator) -> tuple[str, Params, cf.Orbit | None, str]:
    """Return a kind, parameters, and what attracts from a random state there, or why nothing does."""
    kind, params = draw(rng)
    state = [float(rng.uniform(-2, 2)), 0.0 if rng.random() < 0.5 else float(rng.uniform(-1, 1))]
    try:
        return kind, params, cf.find_orbit("coulomb", params, state=state, longest=LONGEST), ""
    except cf.ContfricError as error:
        return kind, params, None, refusal(error)


def refusal(error: cf.ContfricError) -> str:
    """Return why there is no orbit, without its numbers."""
    text = str(error)
    for itineraries in ("rest for ever", "grows without bound", "has not converged", "aperiodic"):
        if itineraries in text:
            return f"{type(error).__name__}: {itineraries}"
    text = re.sub(r" '[^']*'| at .*", "", text.split(":", maxsplit=1)[0])
    return f"{type(error).__name__}: {text}"


@contextlib.contextmanager
def strictly() -> Iterator[None]:
    """Turn every warning, of numpy and of others, into an error."""
    with warnings.catch_warnings(), np.errstate(all="raise"):
        warnings.simplefilter("error")
        # numba's, of a feature that contfric.compiled needs and ignores in the same way
        warnings.filterwarnings("ignore", message="First-class function type")
        yield


@contextlib.contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise TimeoutError after a processor time, where the system has such a signal (not on Windows).

    Not the time of a clock: what else a machine does must not decide which cases are cut.
    """

    def late(*_: object) -> None:
        raise TimeoutError(f"not done after {seconds:g} s of processor time")

    if not hasattr(signal, "SIGPROF"):
        yield
        return
    before = signal.signal(signal.SIGPROF, late)
    # again and again: what is raised while a finaliser runs is lost
    signal.setitimer(signal.ITIMER_PROF, seconds, 1.0)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
