"""Cost against the number of segments: one orbit, run through 2, 4, 8, .. times.

The orbit of period 2^k that runs through 1a again and again is a problem of 3 * 2^k segments with as
many unknowns, and nothing in it is known to the engine as a copy. Its branch is that of 1a; the range is
chosen so that it meets no event.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from measuring import Case, Row, measure
from page import duration
from peers.oscillator import Failure
from settings import OMEGA, orbit_at

import contfric as cf
from contfric.bvp.system import build_system
from contfric.orbit.orbit import Orbit, Status
from contfric.orbit.solve import refine
from contfric.plot.appearance.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION

mpl.use("Agg")
import matplotlib.pyplot as plt

#: Doublings of the three segments of 1a: to 1,536, beyond the thousand that is asked for.
DOUBLINGS = 9
#: Smallest number of segments in the fit: twice that of 1a. What a call costs at all counts in full.
LEAST = 6
#: The exponent that is asked for.
WANTED = 1.1
#: How far times and positions of a start are off, signs in turn: Newton takes three or four steps.
OFF = 1e-3
#: A short way along the branch, far from its events: points on each side, and the largest step.
POINTS, STEP = 20, 5e-4
#: The parameter of the branch: from its lower end to its fold there are several hundred such points.
RANGE = (0.49, 0.51)
#: Rounds; the largest problems take a second each round.
ROUNDS = 5

STYLES = {
    "Newton solve": ("o", VERMILLION),
    "point of a branch": ("s", BLUE),
    "point of a branch, no multipliers": ("v", SKY),
    "admissibility of an orbit": ("^", GREEN),
    "multipliers of an orbit": ("D", ORANGE),
    "assembling the problem": ("P", PURPLE),
    "signature of an orbit": ("*", BLACK),
}
#: Those that a branch consists of: the claim is about them. The others are asked for orbit by orbit.
CLAIMED = tuple(STYLES)[:4]


def chain() -> Iterator[Orbit]:
    """The orbit once, twice, four times, .. through."""
    orbit = orbit_at(OMEGA)
    yield orbit
    for _ in range(DOUBLINGS):
        orbit = orbit.doubled()
        yield orbit


def unsolved(orbit: Orbit) -> Orbit:
    """A start next to the orbit."""
    joints = orbit.joints.copy()
    signs = np.where(np.arange(len(joints)) % 2 == 0, 1.0, -1.0)
    joints[:, :2] += OFF * signs[:, None]
    return Orbit(orbit.system, joints, orbit.vector.copy(), np.inf, Status.NOT_CONVERGED)


def solve(start: Orbit) -> tuple[Orbit, str]:
    """Newton, undamped: as a continuation has it."""
    orbit = refine(start, damped=False)
    if not orbit.converged:
        raise Failure(orbit.status.value)
    return orbit, ""


def follow(orbit: Orbit, stability: bool) -> tuple[cf.Branch, str]:
    """A short way along the branch, both ways."""
    branch = cf.continue_orbit(
        orbit, "Omega", RANGE, max_step=STEP, max_points=POINTS, stability=stability
    )
    reasons = {end.reason.name for end in branch.ends}
    if branch.bifurcations or reasons != {"POINTS"}:
        raise Failure(f"met {branch.bifurcations}, ended by {reasons}")
    return branch, f"{len(branch)} points"


def asked(orbit: Orbit, attribute: str) -> tuple[Any, str]:
    """A property of an orbit that nothing has been asked of yet."""
    fresh = Orbit(orbit.system, orbit.joints, orbit.vector, 0.0)
    return getattr(fresh, attribute), ""


def assemble(orbit: Orbit) -> tuple[Any, str]:
    """The arrays of the boundary-value problem; the cache of those that are known is passed by."""
    itinerary = orbit.system.itinerary
    return build_system.__wrapped__(orbit.model, itinerary, orbit.periods), ""


def cases() -> list[Case]:
    """All operations on all orbits; errors are distances from the orbit."""
    found = []
    for orbit in chain():
        points = len(follow(orbit, True)[0])

        def away(other: Orbit, orbit: Orbit = orbit) -> float:
            return float(np.max(np.abs(other.joints - orbit.joints)))

        calls: dict[str, tuple[Callable[[], tuple[Any, str]], int]] = {
            "Newton solve": (partial(solve, unsolved(orbit)), 1),
            "point of a branch": (partial(follow, orbit, True), points),
            "point of a branch, no multipliers": (partial(follow, orbit, False), points),
            "admissibility of an orbit": (partial(asked, orbit, "margins"), 1),
            "multipliers of an orbit": (partial(asked, orbit, "turn_multipliers"), 1),
            "assembling the problem": (partial(assemble, orbit), 1),
            "signature of an orbit": (partial(asked, orbit, "signature"), 1),
        }
        for name, (call, units) in calls.items():
            error = away if name == "Newton solve" else (lambda _: 0.0)
            found.append(Case(name, str(orbit.system.segments), call, error, units))
    return found


def segments(rows: list[Row], name: str) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of segments of an operation, and the medians."""
    own = [row for row in rows if row.case.method == name]
    return np.array([int(r.case.setting) for r in own]), np.array([r.median for r in own])


def exponent(rows: list[Row], name: str) -> float:
    """Slope of the least-squares line of log time against log segments."""
    count, seconds = segments(rows, name)
    fitted = count >= LEAST
    return float(np.polyfit(np.log(count[fitted]), np.log(seconds[fitted]), 1)[0])


def last_exponent(rows: list[Row], name: str) -> float:
    """The same from the largest problem and the one of an eighth of its segments."""
    _, seconds = segments(rows, name)
    return math.log2(seconds[-1] / seconds[-4]) / 3.0


def table(rows: list[Row]) -> str:
    """Times for each number of segments, and the exponents below."""
    lines = ["| segments | " + " | ".join(STYLES) + " |", "|---" * (len(STYLES) + 1) + "|"]
    columns = [segments(rows, name)[1] for name in STYLES]
    for k, count in enumerate(segments(rows, "Newton solve")[0]):
        lines.append(f"| {count} | " + " | ".join(duration(c[k]) for c in columns) + " |")
    for title, fit in (
        (f"exponent, {LEAST} segments and more", exponent),
        ("exponent, last three doublings", last_exponent),
    ):
        lines.append(f"| {title} | " + " | ".join(f"{fit(rows, n):.3f}" for n in STYLES) + " |")
    return "\n".join(lines)


def shares(rows: list[Row]) -> str:
    """What a point consists of where it has the most segments."""
    time = {name: [r for r in rows if r.case.method == name][-1].least for name in STYLES}
    whole, bare = time["point of a branch"], time["point of a branch, no multipliers"]
    watch = time["admissibility of an orbit"]
    most = segments(rows, "Newton solve")[0][-1]
    return (
        f"With {most} segments a point takes {duration(whole)}, {duration(whole / most)} a segment: "
        f"{100 * watch / whole:.0f} percent for admissibility (all stationary points of the observables "
        f"of every segment), {100 * max(0.0, 1 - bare / whole):.0f} percent for multipliers (the "
        "elimination leaves their pencil over), the rest for Newton, tangent and event tests."
    )


def verdict(rows: list[Row]) -> str:
    """Say whether the exponents of a branch's operations are what is asked for."""
    fitted = {name: exponent(rows, name) for name in STYLES}
    good = all(fitted[name] <= WANTED for name in CLAIMED)
    text = f"Asked for: at most {WANTED} along a branch; " + ("held." if good else "NOT HELD.")
    slow = [name for name in STYLES if name not in CLAIMED and fitted[name] > WANTED]
    return text + (f" Beyond it, orbit by orbit only: {', '.join(slow)}." if slow else "")


def draw(rows: list[Row], path: Path) -> None:
    """Time against segments, with the fitted exponents and a line of exponent 1."""
    figure, ax = plt.subplots(figsize=(8.4, 4.6), layout="constrained")
    for name, (marker, colour) in STYLES.items():
        count, seconds = segments(rows, name)
        label = f"{name}: {exponent(rows, name):.2f}"
        ax.loglog(count, seconds, marker=marker, color=colour, linewidth=1.2, label=label)
    count, seconds = segments(rows, "admissibility of an orbit")
    below = 0.5 * seconds[-1] / count[-1] * count
    ax.loglog(count, below, color="0.5", linewidth=1.0, linestyle=":", label="exponent 1")
    ax.set(
        xlabel="segments of the problem",
        ylabel="time, s",
        title=rf"Orbit 1a run through 1 to {2**DOUBLINGS} times, $\Omega$ = {OMEGA}",
    )
    ax.grid(True, which="major", linewidth=0.4, alpha=0.6)
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside right upper", fontsize=9, title="operation: fitted exponent"
    )
    figure.savefig(path, dpi=150)
    plt.close(figure)


def run() -> list[Row]:
    """Measure."""
    return measure(cases(), ROUNDS)
