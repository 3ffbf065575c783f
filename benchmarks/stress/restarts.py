"""Random diagrams in all five parameters, explored again from up to six of their branches.

``python benchmarks/stress/restarts.py --count 3000 --seed 1 --workers 2 --out restarts.json``

Each restart has 0.31 times the step. What differs is counted by class. The classes that are excused are
fixed here by the scene, and in :mod:`contfric.atlas.completeness.degenerate` by the events. Each excuses
what differs at its values of the parameter, or is joined by these alone; everything else is a fault.
Points are asked for admissibility, and sums of indices are tested.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from chunks import Chunked
from report import Tally
from scenes import time_limit

import contfric as cf
from contfric.atlas.completeness.degenerate import Degenerate
from contfric.atlas.completeness.verification import Verification, verify

WHAT = "Diagrams of random scenes in all five parameters, explored again from up to six of their branches."
#: Longest that one scene may take with its restarts (s of processor time); longer ones are counted as cut.
#: Diagrams of some 600 branches end by themselves; they take 20 s, and a restart two to three times that.
LIMIT = 240.0
#: Most branches of a diagram, far above what any has: what a diagram needs is bounded by its time.
MOST_BRANCHES = 3000
#: Restarts a scene, and scenes of a chunk of work.
RESTARTS, CHUNK = 6, 10
#: Branches of all restarts of a scene together: a large diagram is restarted from fewer of its branches, at
#: least from one. Counted in branches, and not in time, the restarts are the same on every machine.
RESTARTED = 360
#: S0 and S this near (relative) are equal.
EQUAL = 1e-6
#: Omega this near to 1/n with this little damping: a slide lasts whole half natural periods whatever its
#: amplitude (n even), or the n-th harmonic is in resonance (n odd).
RESONANT, UNDAMPED = 1e-6, 1e-6
#: Omega = 1/n is asked below this n: scenes have Omega above 0.059.
MOST_SLIDES = 20
VARIED = ("Omega", "S", "S0", "h", "zeta")


@dataclass(frozen=True)
class Scene:
    """Parameters, what varies, and its range; the model, and where it is simulated from."""

    params: dict[str, float]
    vary: str
    range: tuple[float, float]
    model: str = "coulomb"
    start: dict[str, Any] = field(default_factory=dict)


def scene(seed: int, index: int) -> Scene:
    """Return a random scene; special values (S = S0, Omega = 1/2 or 1/3, no damping) are drawn on purpose."""
    rng = np.random.default_rng([seed, index])
    omega = float(np.exp(rng.uniform(np.log(0.07), np.log(1.5))))
    if rng.random() < 0.05:
        omega = float(rng.choice([0.5, 1.0 / 3.0, 0.25]))
    top = float(np.exp(rng.uniform(np.log(0.02), np.log(1.1))))
    share = 1.0 if rng.random() < 0.03 else rng.uniform(0.1, 1.0)
    h = 0.0 if rng.random() < 0.4 else float(rng.uniform(-0.5, 0.5))
    zeta = float(rng.choice([0.0, 1e-9, 10.0 ** rng.uniform(-8, -1), rng.uniform(0.0, 0.1)]))
    params = {"Omega": omega, "S": share * top, "S0": top, "h": h, "zeta": zeta}
    vary = str(rng.choice(VARIED))
    size = {"Omega": omega, "S": params["S"], "S0": top, "h": 1.0, "zeta": 0.5}[vary]
    low, high = (float(rng.uniform(0.03, 0.15)) * size for _ in range(2))
    return Scene(params, vary, (params[vary] - low, params[vary] + high))


def excuses(found: Scene) -> tuple[Degenerate, ...]:
    """Return where a scene is degenerate by its equations; none if nowhere. Fixed before any scene is run.

    With equal limits Omega may vary through such a value, too: there orbits of every amplitude are crossed.
    """
    if found.model != "coulomb":
        return ()
    p, (low, high) = found.params, found.range
    undamped, equal = abs(p["zeta"]) < UNDAMPED, abs(p["S"] - p["S0"]) < EQUAL * p["S0"]
    text = f"{found.vary}: a continuum, or resonance, of Omega = 1/n without damping"
    if found.vary == "Omega":
        at = [1.0 / n for n in range(1, MOST_SLIDES) if low <= 1.0 / n <= high]
        near = [Degenerate(text, w * (1.0 - RESONANT), w * (1.0 + RESONANT)) for w in at]
        return tuple(near) if undamped and equal else ()
    inverse = 1.0 / p["Omega"]
    nearest = round(inverse)
    if nearest == 0 or abs(inverse - nearest) >= RESONANT * nearest:
        return ()
    if found.vary == "zeta":
        return (Degenerate(text, -UNDAMPED, UNDAMPED),)
    return (Degenerate(text, low, high),) if undamped else ()


def chunk(
    seed: int,
    first: int,
    last: int,
    draw: Callable[[int, int], Scene] = scene,
    limit: float = LIMIT,
    most_periods: int | None = None,
) -> Tally:
    """Explore the random scenes of a range of indices, and restart them."""
    tally = Tally()
    for index in range(first, last):
        tally.index = index
        start = time.process_time()
        try:
            with time_limit(limit):
                one_scene(tally, draw(seed, index), max_periods=most_periods)
        except TimeoutError:
            tally.set_aside(
                f"cut: longer than {limit:g} s of the processor", f"{draw(seed, index)}"
            )
            tally.met(f"cut of {Path(draw(seed, index).model).stem}")
        except (
            Exception
        ) as error:  # whatever it is, it is a failure of this scene and not of the run
            tally.check("no exception", False, f"{draw(seed, index)}: {error!r}")
        tally.largest("processor seconds of one scene", time.process_time() - start)
    return tally


def one_scene(
    tally: Tally,
    found: Scene,
    most: int = RESTARTS,
    branches: int = MOST_BRANCHES,
    max_periods: int | None = None,
) -> None:
    """Explore one scene, ask its points, and verify it; one with more branches is cut."""
    try:
        orbit = cf.find_orbit(found.model, found.params, longest=1000, **found.start)
        diagram = cf.explore(
            orbit, found.vary, found.range, max_branches=branches, max_periods=max_periods
        )
    except cf.ContfricError as error:
        tally.met(f"no start: {type(error).__name__}")
        return
    if not diagram.complete:
        tally.set_aside("cut: more branches than asked for", f"{found}")
        return
    tally.met("scenes")
    if found.model != "coulomb":
        tally.met(f"scenes of {Path(found.model).stem}")
    tally.met("branches", len(diagram.branches))
    tally.met("events", len(diagram.events))
    tally.met("loose ends", len(diagram.loose_ends))
    known = excuses(found)
    most = min(most, max(1, RESTARTED // len(diagram.branches)))
    report(tally, found, verify(diagram, most, known=known))
    points = [orbit for branch in diagram.branches if not branch.mirrored for orbit in branch]
    wrong = [orbit.params[found.vary] for orbit in points if not orbit.admissible]
    tally.met("points asked for admissibility", len(points))
    text = f"{found}: {len(wrong)} of {len(points)} points not admissible"
    if wrong and all(any(d.holds(value) for d in known) for value in wrong):
        tally.set_aside(f"excused: {_name(known[0].text)}", text)
        return
    tally.check("all points admissible", not wrong, text)


def _name(text: str) -> str:
    """Return the class of a degeneracy in words, without where it is."""
    return text.rpartition(": ")[2]


def report(tally: Tally, found: Scene, held: Verification) -> None:
    """Count what a verification has found."""
    for restart in held.restarts:
        if not restart.complete:
            tally.set_aside("cut: a restart with more branches than asked for", f"{found}")
            return
    tally.met("restarts", len(held.restarts))
    different = [str(r) for r in held.restarts if not r.same]
    unbalanced = [str(b) for b in held.balances if not b.holds]
    if (different or unbalanced) and held.explained:
        name = _name(held.degeneracies[0])
        tally.set_aside(f"excused: {name}", "; ".join([*different, *unbalanced]))
        return
    tally.check("the same from every branch", not different, f"{found}: {different}")
    tally.met("balances", len(held.balances))
    tally.check("indices balance at every event", not unbalanced, f"{found}: {unbalanced}")
    tally.met("sums of indices", len(held.sums))
    tally.met("sums that tell of another component", len(held.missing))


RUN = Chunked("restarts", WHAT, chunk, CHUNK, limit=LIMIT)

if __name__ == "__main__":
    RUN.command_line(count=60, seed=0)
