"""Time for a point of a branch of six segments against the number of states; docs/benchmarks-states.md.

``python benchmarks/six_segments.py``: the chain of ``states.py`` with its first mass on friction, under a
force with a third harmonic and a constant part, along the amplitude of the force, which is in no matrix, and
along a factor of the stiffness, which makes every matrix another one at each point.
Seconds of the processor, in turns with a yardstick.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from origin import origin

import contfric as cf

if __package__:
    from benchmarks.contacts import HEADING as NEXT
    from benchmarks.states import DAMPING, stiffness_of
else:
    from contacts import HEADING as NEXT
    from states import DAMPING, stiffness_of

PAGE = Path(__file__).resolve().parents[1] / "docs" / "benchmarks-states.md"
HEADING = "## A point of six segments"
#: Masses, frequency and friction at which an orbit has six segments.
CASES = ((1, 0.25, 0.1), (10, 0.3, 0.2), (12, 0.3, 0.2))
ROUNDS, WIDTH, POINTS = 5, 2e-3, 1000


def chain(n: int, factor: bool = False) -> cf.Model:
    """Return the chain as a model; with a parameter k that multiplies its stiffness, if that is asked for."""
    stiffness = stiffness_of(n)
    scaled = [[f"{entry!r}*k" if entry else "0" for entry in row] for row in stiffness.tolist()]
    return cf.Mechanism(
        np.eye(n),
        DAMPING * stiffness + 0.05 * np.eye(n),
        scaled if factor else stiffness,
        contacts={"pad": {"kind": "friction", "velocity": "v1", "kinetic": "S"}},
        force={f"q{n}": "F*cos(w*t) + 0.6*F*cos(3*w*t) + 0.02"},
        parameters={"w": 0.3, "F": 0.6, "S": 0.2} | ({"k": 1.0} if factor else {}),
        period="2*pi/w",
        name=f"six-{n}" + "-k" * factor,
    )


def least(calls: dict[str, Callable[[], Any]]) -> dict[str, tuple[float, Any]]:
    """Return the least processor seconds of each call, in turns, and what it returned."""
    found: dict[str, tuple[float, Any]] = {name: (np.inf, call()) for name, call in calls.items()}
    for _ in range(ROUNDS):
        for name, call in calls.items():
            start = time.process_time()
            result = call()
            found[name] = min(found[name][0], time.process_time() - start), result
    return found


def row_of(n: int, w: float, friction: float) -> str:
    """Measure one chain."""
    at = {"w": w, "F": 0.6, "S": friction}
    orbits = {"F": cf.find_orbit(chain(n), at), "k": cf.find_orbit(chain(n, True), at)}
    assert all(orbit.system.segments == 6 for orbit in orbits.values())
    numbers = np.random.default_rng(1).normal(size=200_000)

    def branch(parameter: str, stability: bool) -> Callable[[], cf.Branch]:
        step, orbit = 2.0 / POINTS, orbits[parameter]
        value = orbit.params[parameter]
        reach = value, value + WIDTH
        return lambda: cf.continue_orbit(
            orbit, parameter, reach, max_step=step, stability=stability
        )

    found = least(
        {
            "yard": lambda: np.sort(numbers),
            "plain": branch("F", False),
            "stable": branch("F", True),
            "matrix": branch("k", False),
            "matrix-stable": branch("k", True),
        }
    )
    cells = [str(2 * n), str(len(found["plain"][1]))]
    cells += [f"{1e6 * found[k][0] / len(found[k][1]):.0f}" for k in list(found)[1:]]
    return "| " + " | ".join([*cells, f"{1e3 * found['yard'][0]:.0f}"]) + " |"


def main() -> None:
    """Measure each chain, and write the part of the page."""
    rows = [row_of(*case) for case in CASES]
    lines = [
        HEADING,
        "",
        f"Written by `make bench` (`benchmarks/six_segments.py`): {origin()}. The chain above under F (cos "
        "wt + 0.6 cos 3wt) + 0.02, its first mass on friction S; orbits of six segments along F, which is "
        "in no matrix, and along a factor k of the stiffness, with which every matrix is another one at "
        "each point. Microseconds of the processor for a point: prediction, Newton's method, all margins "
        f"with their stationary points; and with multipliers. The least of {ROUNDS} branches in turns with "
        "a yardstick (200,000 numbers sorted, milliseconds), all that a call costs divided by its points. "
        "Beyond six states most of each solution is kept from point to point (docs/integration.md), which "
        "is part of the time of the first points.",
        "",
        "| states | points | a point | with multipliers | along k | with multipliers | yardstick |",
        "|---|---|---|---|---|---|---|",
        *rows,
    ]
    text = PAGE.read_text(encoding="utf-8")
    before, _, _ = text.partition(HEADING if HEADING in text else NEXT)
    _, heading, after = text.partition(NEXT)
    PAGE.write_text("\n".join([before.rstrip(), "", *lines, "", heading + after]), encoding="utf-8")
    print("\n".join(rows))


if __name__ == "__main__":
    main()
