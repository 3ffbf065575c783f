"""Many friction contacts: time to load, to a first orbit, and of a response curve; docs/benchmarks-states.md.

``python benchmarks/contacts.py``: 20 masses on springs of their own and between neighbours, a harmonic force
on the first mass. Some masses rub on the ground. No mode and no itinerary is given. Each size is a process of
its own, with compiled kernels on disk; so is each of some structures with random data.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from origin import origin

PAGE = Path(__file__).resolve().parents[1] / "docs" / "benchmarks-states.md"
HEADING = "## Many friction contacts"
MASSES, CONTACTS = 20, (1, 2, 3, 4, 6, 8, 10)
COUPLING, DAMPING, KINETIC, OMEGA, RANGE = 0.5, 0.02, 0.03, 1.0, (0.999, 1.03)
MAX_STEP = 0.01
#: Share of the range within which its end is reached.
WITHIN = 1e-9
#: Seeds of structures with random data, and how far to either side of the lowest natural frequency.
SEEDS, WIDTH = (0, 1, 2, 3, 4, 6), 0.03


@dataclass(frozen=True)
class Row:
    """Masses on springs of their own and between neighbours: which of them rub, how much, and the range."""

    name: str
    mass: np.ndarray
    stiffness: np.ndarray
    rubs: dict[int, str]
    omega: float
    reach: tuple[float, float]


def regular(contacts: int) -> Row:
    """Return equal masses, of which every so many rub."""
    beside = np.eye(MASSES, k=1) + np.eye(MASSES, k=-1)
    stiffness = np.eye(MASSES) + COUPLING * (np.diag(np.sum(beside, axis=1)) - beside)
    rubs = {i * (MASSES // contacts): "S" for i in range(1, contacts + 1)}
    return Row(str(contacts), np.eye(MASSES), stiffness, rubs, OMEGA, RANGE)


def drawn(seed: int) -> Row:
    """Return random masses, springs and friction, ten of the masses rubbing."""
    draw = np.random.default_rng(seed)
    beside = np.diag(draw.uniform(0.6, 1.4, MASSES - 1) * COUPLING, 1)
    beside = beside + beside.T
    stiffness = np.diag(draw.uniform(0.8, 1.2, MASSES) + beside.sum(axis=1)) - beside
    mass = np.diag(draw.uniform(0.8, 1.2, MASSES))
    which = np.sort(draw.choice(np.arange(1, MASSES + 1), 10, replace=False))
    rubs = {int(i): f"{draw.uniform(0.5, 1.5):.4f}*S" for i in which}
    low = float(np.sqrt(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real.min()))
    reach = (1.0 - WIDTH) * low, (1.0 + WIDTH) * low
    return Row(f"10, random {seed}", mass, stiffness, rubs, low, reach)


def reached(diagram: Any) -> str:
    """Return whether both ends of the range are reached, else where and why the last branch ended."""
    width, found = diagram.range[1] - diagram.range[0], []
    for side, wanted in zip((min, max), diagram.range, strict=True):
        nearest = side(diagram.branches, key=lambda branch: side(branch.values))
        end = nearest.ends[0 if nearest.values[0] == side(nearest.values) else 1]
        at = float(side(nearest.values))
        if abs(at - wanted) > WITHIN * width:
            found.append(f"{at:.4f}: {end.reason.name}")
    return "; ".join([*found, *([] if diagram.complete else diagram.notes)]) or "yes"


def measure(row: Row) -> dict[str, float | str]:
    """Return seconds of each step, and counts."""
    import contfric as cf

    rubs = {
        f"b{k}": {"kind": "friction", "velocity": f"v{i}", "kinetic": kinetic}
        for k, (i, kinetic) in enumerate(row.rubs.items(), start=1)
    }
    clock = [time.process_time()]
    model = cf.Mechanism(
        row.mass,
        DAMPING * row.stiffness,
        row.stiffness,
        contacts=rubs,
        force={"q1": "cos(Omega*t)"},
        parameters={"Omega": row.omega, "S": KINETIC},
        period="2*pi/Omega",
    )
    clock.append(time.process_time())
    orbit = cf.find_orbit(model, periods=1)
    clock.append(time.process_time())
    diagram = cf.explore(orbit, "Omega", row.reach, max_step=MAX_STEP, max_periods=1)
    clock.append(time.process_time())
    load, first, curve = np.diff(clock)
    return {
        "contacts": row.name,
        "load": load,
        "orbit": first,
        "curve": curve,
        "points": sum(map(len, diagram.branches)),
        "events": sum(b.kind != "T" for b in diagram.bifurcations),
        "loose": len(diagram.loose_ends),
        "modes": len(model.modes),
        "stops": len(orbit.itinerary),
        "reached": reached(diagram),
    }


def main() -> None:
    """Measure each size in a process of its own, and write the part of the page."""
    if len(sys.argv) > 1:
        kind, number = sys.argv[1:]
        row = drawn(int(number)) if kind == "drawn" else regular(int(number))
        print(json.dumps(measure(row)))
        return
    rows = []
    for kind, number in [*(("regular", n) for n in CONTACTS), *(("drawn", n) for n in SEEDS)]:
        command = [sys.executable, __file__, kind, str(number)]
        found = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
        print(found, flush=True)
        rows.append(
            "| {contacts} | {load:.2f} | {orbit:.2f} | {stops} | {curve:.2f} | {points} | {events} | "
            "{loose} | {modes} | {reached} |".format(**found)
        )
    says = (
        f"Written by `make bench` (`benchmarks/contacts.py`): {origin()}. {MASSES} masses on springs of "
        f"their own (1) and between neighbours ({COUPLING}), damping {DAMPING} K, a force cos(Omega t) on "
        f"the first; friction S = {KINETIC} of some masses against the ground. Seconds of the processor: "
        f"load, first orbit (simulated), and the response curve over Omega in [{RANGE[0]}, {RANGE[1]}], "
        "from near the peak down, with multipliers and admissibility at every point, every event located "
        "and followed. No mode is given: those that were visited are counted (59049 can be). Below 0.9977 "
        "the orbits of ten contacts lose their stability (NS). Last rows: masses, springs and friction "
        f"drawn at random, over {100 * WIDTH:.0f} % to either side of the lowest natural frequency. Where "
        "an end of the range is not reached, the last column says at which value the last branch ended, and "
        "why (SHAKEDOWN: beyond it a stuck contact slips to one side until it sticks at another position)."
    )
    head = (
        "| contacts | load | first orbit | its segments | curve | points | events | loose ends | modes "
        "visited | range reached |"
    )
    text = "\n".join([HEADING, "", says, "", head, "|---" * 10 + "|", *rows])
    page = PAGE.read_text(encoding="utf-8").partition(HEADING)[0].rstrip()
    PAGE.write_text(f"{page}\n\n{text}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
