"""Write docs/benchmarks-scenes.md: what a scene costs from the shell, and what it does not do."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from origin import origin
from scene_tables import (
    Seen,
    breakdown_table,
    claims,
    kernel_table,
    scene_table,
    skipped_table,
)

#: Runs of a scene whose wall time is a claim, and of the others.
ROUNDS, FEW = 5, 1
BARE = """
model: coulomb
params: {Omega: 0.5, S: 0.32, S0: 0.4}
start: {signature: 1a}
continue: {parameter: Omega, range: [0.4, 0.6]}
"""
FIG04 = """
title: Bifurcations in S at Omega = 0.5, S0 = 0.4
model: coulomb
params: {Omega: 0.5, S: 0.32, S0: 0.4}
start: simulate
explore: {parameter: S, range: [0.02, 0.4]}
want: [stability, asymmetry, extrema, stops]
figures: [{kind: diagram, rows: [x_max, stops, psi]}]
"""
ORBIT_ONLY = "model: coulomb\nparams: {Omega: 0.5, S: 0.32, S0: 0.4}\nstart: simulate\n"

#: Name -> (what the file says, runs). ``fig05`` is the bundled study.
SCENES: dict[str, tuple[str, int]] = {
    "orbit, simulated": (ORBIT_ONLY, FEW),
    "bare branch": (BARE, ROUNDS),
    "+ stability": (BARE + "want: [stability]\n", FEW),
    "+ asymmetry": (BARE + "want: [asymmetry]\n", FEW),
    "+ extrema": (BARE + "want: [extrema]\n", FEW),
    "+ stops": (BARE + "want: [stops]\n", FEW),
    "+ figure: transitions": (BARE + "figures: [{kind: transitions}]\n", FEW),
    "+ figure: orbit": (BARE + "figures: [{kind: orbit}]\n", FEW),
    "+ extrema, figure: diagram": (
        BARE + "want: [extrema]\nfigures: [{kind: diagram, rows: [x_max]}]\n",
        FEW,
    ),
    "fig05 without figures": ("", ROUNDS),
    "fig05": ("", ROUNDS),
    "fig04": (FIG04, ROUNDS),
}
#: Those whose time is taken apart.
TAKEN_APART = ("bare branch", "fig05 without figures", "fig05", "fig04")


def process(*arguments: str, env: Mapping[str, str] | None = None) -> tuple[float, str]:
    """Run Python with arguments in a fresh process; return (wall seconds, what it printed)."""
    command = [sys.executable, *arguments]
    start = time.perf_counter()
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, env=env, text=True)
    return time.perf_counter() - start, done.stdout


def study_file(name: str, folder: Path) -> str:
    """The file of a scene; a bundled study is known by its name."""
    text = SCENES[name][0]
    if name == "fig05":
        return name
    if not text:
        from contfric.study import study_path

        text = study_path("fig05").read_text(encoding="utf-8").split("figures:")[0]
    path = folder / f"scene{list(SCENES).index(name)}.yaml"
    path.write_text(text, encoding="utf-8")
    return str(path)


def probe(study: str, out: Path, env: Mapping[str, str] | None = None) -> tuple[float, Any]:
    """Run the probe; return (wall seconds, its report)."""
    script = str(Path(__file__).with_name("scene_probe.py"))
    before = time.time()
    wall, text = process(script, study, str(out), env=env)
    report = json.loads(text)
    # two processes have the clock of the day in common, and no other
    report["starting"], report["ending"] = report["began"] - before, time.time() - report["ended"]
    return wall, report


def run_scenes(folder: Path) -> dict[str, Seen]:
    """Run every scene: the command line as it is, then once with the probe; the first run warms up."""
    process("-m", "contfric", "run", "fig05", "--out", str(folder / "warm"), "--quiet")
    seen = {}
    for name, (_, rounds) in SCENES.items():
        study, out = study_file(name, folder), folder / "out"
        arguments = ("-m", "contfric", "run", study, "--out", str(out), "--force", "--quiet")
        wall = [process(*arguments)[0] for _ in range(rounds)]
        seen[name] = Seen(wall, probe(study, out)[1])
    return seen


def run_cold(folder: Path) -> Seen:
    """Run ``fig05`` once with an empty cache of kernels."""
    cache = folder / "kernels"
    cache.mkdir()
    env = os.environ | {"CONTFRIC_CACHE_DIR": str(cache)}
    wall, report = probe("fig05", folder / "cold", env)
    return Seen([wall], report)


def run_import() -> float:
    """Median seconds of ``import contfric``, by the clock of each process."""
    code = "import time; t = time.perf_counter(); import contfric; print(time.perf_counter() - t)"
    return statistics.median(float(process("-c", code)[1]) for _ in range(ROUNDS))


TEMPLATE = """# What a scene costs, and what it does not do

Written by `make bench` (`benchmarks/scenes.py`, which took {took:.0f} s): {origin}.
Every number is of fresh processes; wall times are medians of {rounds} runs of
`contfric run` for the scenes that are claims, single runs for the others.

{claims}

## Scenes

The bare branch follows 1a in Omega from its signature, and wants nothing; a line with + is the bare
branch and that. `fig05` is the bundled study, `fig04` explores in S from 0.02 to 0.4 at Omega = 0.5.
"Modules" is all that Python has imported at the end.

{scenes}

A study leaves out what it does not name; its `run.json` says so. The last column is what was loaded
although no step used it: numba imports scipy's linear algebra before its first kernel (no kernel of
contfric uses it), and matplotlib its three-dimensional axes. Kernels are compiled, or loaded, when they are
first called; the process leaves without taking Python and the compiler apart, which took 0.3 s.

{skipped}

## Where the time goes

One run of each scene with the clock on each part (`benchmarks/scene_probe.py`): imports in the order in
which a run has them, kernels loaded from the cache. The last column is the very first run.

{parts}

## Kernels

Compiled in the very first run, loaded in all others. A helper is compiled for the first kernel that calls it,
and counts there.

{kernels}
"""


def main() -> None:
    """Measure and write the page."""
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        seen, cold, importing = run_scenes(folder), run_cold(folder), run_import()
    columns = {name: seen[name] for name in TAKEN_APART} | {"fig05, first time": cold}
    page = Path(__file__).parents[1] / "docs" / "benchmarks-scenes.md"
    page.write_text(
        TEMPLATE.format(
            took=time.perf_counter() - began,
            origin=origin(),
            rounds=ROUNDS,
            claims=claims(seen, cold, importing),
            scenes=scene_table(seen),
            skipped=skipped_table(seen),
            parts=breakdown_table(columns),
            kernels=kernel_table(seen["fig05"], cold),
        ),
        encoding="utf-8",
    )
    print(page.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
