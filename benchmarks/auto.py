"""A branch of Fig. 5 beside AUTO-07p, paired in one run; writes docs/benchmarks-auto.md.

``AUTO_DIR=.. python benchmarks/auto.py`` takes AUTO-07p built from its public repository (its ``lib`` and
``include``) and gfortran; without them there is nothing to do. AUTO solves the reduced form of the orbit 1a
(``peers/friction.f90``: two slides, three free parameters, exact Jacobians), one way from Omega = 0.5 over
the fold to the end; contfric follows the whole branch, with multipliers, margins and events. Both take turns;
times are of the processor, AUTO's without those of its start (a run of one point).
"""

from __future__ import annotations

import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from bench_engine import branch_in_default_steps, branch_of
from gate import LOOP, spent, turn_of_yardstick
from origin import origin

import contfric as cf

PAGE = Path(__file__).parents[1] / "docs" / "benchmarks-auto.md"
PROBLEM = Path(__file__).with_name("peers") / "friction.f90"
#: The fold of 1a to 20 digits (docs/literature.md), and turns of everything.
FOLD, ROUNDS = 0.54191281694501173442, 15
#: Numbers of collocation intervals, tolerances and longest steps of AUTO: fine ones, and those of its demos.
INTERVALS = (5, 10, 20)
FINE = {"EPSL": 1e-10, "EPSU": 1e-10, "EPSS": 1e-8, "DSMAX": 0.005}
DEFAULT = {"EPSL": 1e-7, "EPSU": 1e-7, "EPSS": 1e-5, "DSMAX": 0.05}
CONSTANTS = {
    **{"IPS": 4, "IRS": 0, "ILP": 1, "NCOL": 4, "IAD": 3, "ISP": 2, "ISW": 1, "IPLT": 0, "NINT": 0},
    **{"NPR": 1000, "MXBF": 10, "IID": 2, "ITMX": 10, "ITNW": 7, "NWTN": 3, "JAC": 1, "DS": 0.01},
    **{"DSMIN": 1e-7, "IADS": 1, "NDIM": 6, "NBC": 8, "NPAR": 10, "NMX": 4000},
    **{"ICP": "[1, 4, 5, 6, 7, 8, 9]", "UZSTOP": "{8: [0.0]}"},
}


@dataclass
class Series:
    """What was measured of one setting: seconds of its turns, points, and the fold."""

    points: int = 0
    fold: float = 0.0
    seconds: list[float] = field(default_factory=list)

    @property
    def median(self) -> float:
        """Seconds, the median."""
        return statistics.median(self.seconds)


def built(folder: Path, auto: Path) -> Path:
    """Compile the problem with AUTO's library, as AUTO does it."""
    program = folder / "friction"
    objects = sorted(map(str, (auto / "lib").glob("*.o")))
    options = ["-cpp", "-O", "-fopenmp", "-DFAM1A", f"-I{auto / 'include'}"]
    command = ["gfortran", *options, str(PROBLEM), *objects, "-o", str(program)]
    subprocess.run(command, check=True, cwd=folder)
    return program


def run(program: Path, **constants: object) -> tuple[float, list[list[float]]]:
    """Run AUTO in an empty folder; return seconds of the processor, and the rows of its output."""
    with tempfile.TemporaryDirectory() as folder:
        lines = [f"{name} = {value}" for name, value in {**CONSTANTS, **constants}.items()]
        Path(folder, "fort.2").write_text("\n".join(lines) + "\n", encoding="utf-8")
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        subprocess.run([program], cwd=folder, env=environment, check=True, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        rows = []
        for line in Path(folder, "fort.7").read_text(encoding="utf-8").splitlines():
            numbers = line.split()
            if numbers and numbers[0] != "0":
                rows.append([float(number) for number in numbers])
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, rows


def series_of(branch: cf.Branch) -> Series:
    """Return a series without turns: the points of a branch of ours, and its fold."""
    fold = next(b for b in branch.bifurcations if b.kind is cf.Kind.SN)
    return Series(len(branch), fold.params["Omega"])


def measured(program: Path) -> tuple[dict[str, Series], float]:
    """Take turns; return the series by name, and the yardstick in seconds."""
    ours: dict[str, Callable[[], cf.Branch]] = {
        "contfric, fine": branch_of("1a"),
        "contfric, default": branch_in_default_steps(),
    }
    found = {name: series_of(call()) for name, call in ours.items()}
    turn_of_yardstick(LOOP)
    yard: list[float] = []
    for _ in range(ROUNDS):
        yard.append(spent(lambda: turn_of_yardstick(LOOP)))
        for name, call in ours.items():
            found[name].seconds.append(spent(call))
        start, _rows = run(program, NTST=20, NMX=1, **FINE)
        for kind, options in (("fine", FINE), ("default", DEFAULT)):
            for count in INTERVALS:
                took, rows = run(program, NTST=count, **options)
                series = found.setdefault(f"AUTO {count}, {kind}", Series(len(rows)))
                series.fold = next(row[4] for row in rows if row[2] == 5)
                series.seconds.append(took - start)
    return found, statistics.median(yard)


def page(found: dict[str, Series], yard: float) -> str:
    """Return the page."""
    lines = [
        "# Against AUTO-07p",
        "",
        f"Written by `benchmarks/auto.py`: {origin()} (in the median of these turns "
        f"{yard * 1e3:.2f} ms). Medians of {ROUNDS} turns, processor time; AUTO's start is taken off. "
        "AUTO solves the reduced form of the orbit 1a (two slides), one way from Omega = 0.5 over the fold "
        "to its end, without multipliers or admissibility; contfric follows the whole branch, both ways, "
        "with both. Steps differ: compare fine steps by the point, default steps by the branch.",
        "",
        "| setting | points | a point | times contfric | a branch | times contfric | error of the fold |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, series in found.items():
        own = found["contfric, fine" if name.endswith("fine") else "contfric, default"]
        point, other = series.median / series.points, own.median / own.points
        error = f"{abs(series.fold - FOLD):.0e}"
        lines.append(
            f"| {name} | {series.points} | {point * 1e6:.2f} us | {point / other:.1f} | "
            f"{series.median * 1e3:.2f} ms | {series.median / own.median:.1f} | {error} |"
        )
    return "\n".join(lines) + "\n"


def main() -> int:
    """Measure and write, if AUTO is there."""
    auto = os.environ.get("AUTO_DIR")
    if auto is None or shutil.which("gfortran") is None:
        print("AUTO_DIR is not set, or gfortran is not there: nothing is compared", file=sys.stderr)
        return 0
    with tempfile.TemporaryDirectory() as folder:
        found, yard = measured(built(Path(folder), Path(auto)))
    PAGE.write_text(page(found, yard), encoding="utf-8")
    print(PAGE.read_text(encoding="utf-8"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
