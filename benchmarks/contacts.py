"""Many friction contacts: time to load, to a first orbit, and of a response curve; docs/benchmarks-states.md.

``python benchmarks/contacts.py``: 20 masses on springs of their own and between neighbours, a harmonic force
on the first mass. Some masses rub on the ground. No mode and no itinerary is given. Each size is a process of
its own, with compiled kernels on disk.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from origin import origin

PAGE = Path(__file__).resolve().parents[1] / "docs" / "benchmarks-states.md"
HEADING = "## Many friction contacts"
MASSES, CONTACTS = 20, (1, 2, 3, 4, 6, 8, 10)
COUPLING, DAMPING, KINETIC, OMEGA, RANGE = 0.5, 0.02, 0.03, 1.0, (0.999, 1.03)
MAX_STEP = 0.01


def measure(contacts: int) -> dict[str, float]:
    """Return seconds of each step, and counts."""
    import contfric as cf

    beside = np.eye(MASSES, k=1) + np.eye(MASSES, k=-1)
    stiffness = np.eye(MASSES) + COUPLING * (np.diag(np.sum(beside, axis=1)) - beside)
    every = MASSES // contacts
    rubs = {
        f"b{i}": {"kind": "friction", "velocity": f"v{i * every}", "kinetic": "S"}
        for i in range(1, contacts + 1)
    }
    clock = [time.perf_counter()]
    model = cf.Mechanism(
        np.eye(MASSES),
        DAMPING * stiffness,
        stiffness,
        contacts=rubs,
        force={"q1": "cos(Omega*t)"},
        parameters={"Omega": OMEGA, "S": KINETIC},
        period="2*pi/Omega",
    )
    clock.append(time.perf_counter())
    orbit = cf.find_orbit(model, periods=1)
    clock.append(time.perf_counter())
    diagram = cf.explore(orbit, "Omega", RANGE, max_step=MAX_STEP, max_periods=1)
    clock.append(time.perf_counter())
    load, first, curve = np.diff(clock)
    return {
        "contacts": contacts,
        "load": load,
        "orbit": first,
        "curve": curve,
        "points": sum(map(len, diagram.branches)),
        "events": sum(b.kind != "T" for b in diagram.bifurcations),
        "loose": len(diagram.loose_ends),
        "modes": len(model.modes),
        "stops": len(orbit.itinerary),
    }


def main() -> None:
    """Measure each size in a process of its own, and write the part of the page."""
    if len(sys.argv) > 1:
        print(json.dumps(measure(int(sys.argv[1]))))
        return
    rows = []
    for contacts in CONTACTS:
        command = [sys.executable, __file__, str(contacts)]
        found = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
        print(found, flush=True)
        rows.append(
            "| {contacts} | {load:.2f} | {orbit:.2f} | {stops} | {curve:.2f} | {points} | {events} | "
            "{loose} | {modes} |".format(**found)
        )
    says = (
        f"Written by `make bench` (`benchmarks/contacts.py`): {origin()}. "
        f"{MASSES} masses on springs of their own (1) and between "
        f"neighbours ({COUPLING}), damping {DAMPING} K, a force cos(Omega t) on the first; friction S = "
        f"{KINETIC} of some masses against the ground. Seconds in one process on one core: load, first orbit "
        f"(simulated), and the response curve over Omega in [{RANGE[0]}, {RANGE[1]}], from near the peak "
        "down, with multipliers and admissibility at every point, every event located and followed. No "
        "mode is given: those that were visited are counted (59049 can be). Below 0.9977 the orbits of ten "
        "contacts lose their stability (NS)."
    )
    head = (
        "| contacts | load | first orbit | its segments | curve | points | events | loose ends | modes "
        "visited |"
    )
    text = "\n".join([HEADING, "", says, "", head, "|---" * 9 + "|", *rows])
    page = PAGE.read_text(encoding="utf-8").partition(HEADING)[0].rstrip()
    PAGE.write_text(f"{page}\n\n{text}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
