"""Two branches compared with AUTO-07p, paired in one run; writes docs/benchmarks-auto.md.

``AUTO_DIR=.. python benchmarks/auto.py`` takes AUTO-07p built from its public repository (its ``lib`` and
``include``) and gfortran; without them there is nothing to do. Both programs take turns; times are of the
processor, AUTO's without those of its start (a run of one point).

- The orbit 1a of Fig. 5: AUTO solves its reduced form (``peers/friction.f90``: two slides, three free
  parameters, exact Jacobians), one way from Omega = 0.5 over the fold to the end; contfric follows the whole
  branch, with multipliers, margins and events.
- A smooth Duffing oscillator over its resonance (``peers/duffing.f90``), from w = 3 to 0.3, with two folds.
"""

from __future__ import annotations

import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from bench_engine import branch_in_default_steps, branch_of
from gate import compiled_yardstick, spent
from origin import origin

import contfric as cf

PAGE = Path(__file__).parents[1] / "docs" / "benchmarks-auto.md"
PEERS = Path(__file__).with_name("peers")
#: The fold of 1a to 20 digits (docs/literature.md), and turns of everything.
FOLD, ROUNDS = 0.54191281694501173442, 15
#: The folds of the Duffing oscillator: Newton's method in 45 digits on a Taylor series of 28 terms, 60 steps.
DUFFING_FOLDS = (1.324236200770565556698496, 1.779719524298573114152533)
#: Tolerances and longest steps of AUTO: fine ones, and those of its demos.
FINE = {"EPSL": 1e-10, "EPSU": 1e-10, "EPSS": 1e-8, "DSMAX": 0.005}
DEFAULT = {"EPSL": 1e-7, "EPSU": 1e-7, "EPSS": 1e-5, "DSMAX": 0.05}
CONSTANTS = {
    **{"IPS": 4, "IRS": 0, "ILP": 1, "NCOL": 4, "IAD": 3, "ISP": 2, "ISW": 1, "IPLT": 0, "NINT": 0},
    **{"NPR": 1000, "MXBF": 10, "IID": 2, "ITMX": 10, "ITNW": 7, "NWTN": 3, "JAC": 1, "DS": 0.01},
    **{"DSMIN": 1e-7, "IADS": 1, "NMX": 4000},
}
FRICTION = {
    **{"NDIM": 6, "NBC": 8, "NPAR": 10},
    **{"ICP": "[1, 4, 5, 6, 7, 8, 9]", "UZSTOP": "{8: [0.0]}"},
}
#: Branch points are not looked for (ISP = 0): there are none, and each point is cheaper.
DUFFING = {
    "NDIM": 3,
    "NBC": 3,
    "NPAR": 3,
    "ICP": "[1]",
    "UZSTOP": "{1: [0.3, 3.1]}",
    "DS": -0.01,
    "ISP": 0,
}
DUFFING_FILE = (
    "name: duffing\nstates: [x, v]\nparameters: {{w: 3.0, zeta: 0.05, A: 0.3}}\nperiod: 2*pi/w\n"
    "field: {{x: v, v: -x - x**3 - 2*zeta*v + A*cos(w*t)}}\nintegration: {{tolerance: {tolerance}}}\n"
)


@dataclass
class Series:
    """What was measured of one setting: seconds of its turns, points, and the folds in their order."""

    points: int = 0
    folds: tuple[float, ...] = ()
    seconds: list[float] = field(default_factory=list)

    @property
    def median(self) -> float:
        """Seconds, the median."""
        return statistics.median(self.seconds)


@dataclass(frozen=True)
class Pairing:
    """One branch: calls of ours and settings of AUTO by name; which of ours each stands beside."""

    ours: Mapping[str, Callable[[], cf.Branch]]
    program: Path
    constants: Mapping[str, object]
    settings: Mapping[str, Mapping[str, object]]
    parameter: str
    folds: tuple[float, ...]
    beside: Callable[[str], str]


def built(folder: Path, auto: Path, problem: Path) -> Path:
    """Compile a problem with AUTO's library, as AUTO does it."""
    program = folder / problem.stem
    objects = sorted(map(str, (auto / "lib").glob("*.o")))
    options = ["-cpp", "-O", "-fopenmp", "-DFAM1A", f"-I{auto / 'include'}"]
    command = ["gfortran", *options, str(problem), *objects, "-o", str(program)]
    subprocess.run(command, check=True, cwd=folder)
    return program


def run(program: Path, constants: Mapping[str, object]) -> tuple[float, list[list[float]]]:
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


def series_of(branch: cf.Branch, parameter: str) -> Series:
    """Return a series without turns: the points of a branch of ours, and its folds."""
    folds = (b.params[parameter] for b in branch.bifurcations if b.kind is cf.Kind.SN)
    return Series(len(branch), tuple(sorted(folds)))


def friction(folder: Path, auto: Path) -> Pairing:
    """Return the branch 1a of Fig. 5, in fine and in default steps."""
    kinds = {"fine": FINE, "default": DEFAULT}
    return Pairing(
        {"contfric, fine": branch_of("1a"), "contfric, default": branch_in_default_steps()},
        built(folder, auto, PEERS / "friction.f90"),
        FRICTION,
        {f"AUTO {n}, {kind}": {"NTST": n, **kinds[kind]} for kind in kinds for n in (5, 10, 20)},
        "Omega",
        (FOLD,),
        lambda name: f"contfric, {name.rpartition(' ')[2]}",
    )


def duffing(folder: Path, auto: Path) -> Pairing:
    """Return the Duffing oscillator over its resonance, at two tolerances of ours."""

    def branch(tolerance: float) -> Callable[[], cf.Branch]:
        path = folder / f"duffing{tolerance:g}.yaml"
        path.write_text(DUFFING_FILE.format(tolerance=tolerance), encoding="utf-8")
        orbit = cf.find_orbit(path)
        return lambda: cf.continue_orbit(orbit, "w", (0.3, 3.0))

    ours = {f"contfric, tolerance {tolerance:g}": branch(tolerance) for tolerance in (1e-12, 1e-9)}
    return Pairing(
        ours,
        built(folder, auto, PEERS / "duffing.f90"),
        DUFFING,
        {f"AUTO {n}": {"NTST": n, **DEFAULT} for n in (10, 20, 40)},
        "w",
        DUFFING_FOLDS,
        lambda _name: next(iter(ours)),
    )


def measured(pairing: Pairing) -> dict[str, Series]:
    """Take turns; return the series by name."""
    found = {name: series_of(call(), pairing.parameter) for name, call in pairing.ours.items()}
    for _ in range(ROUNDS):
        for name, call in pairing.ours.items():
            found[name].seconds.append(spent(call))
        start, _rows = run(pairing.program, {**pairing.constants, "NTST": 20, "NMX": 1, **FINE})
        for name, options in pairing.settings.items():
            took, rows = run(pairing.program, {**pairing.constants, **options})
            series = found.setdefault(name, Series(len(rows)))
            series.folds = tuple(sorted(row[4] for row in rows if row[2] == 5))
            series.seconds.append(took - start)
    return found


def table(pairing: Pairing, found: Mapping[str, Series]) -> list[str]:
    """Return the lines of a table."""
    lines = [
        "| setting | points | a point | times contfric | a branch | times contfric | error of the fold |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, series in found.items():
        own = found[name if name in pairing.ours else pairing.beside(name)]
        point, other = series.median / series.points, own.median / own.points
        error = max(abs(x - y) for x, y in zip(series.folds, pairing.folds, strict=True))
        lines.append(
            f"| {name} | {series.points} | {point * 1e6:.2f} us | {point / other:.1f} | "
            f"{series.median * 1e3:.2f} ms | {series.median / own.median:.1f} | {error:.0e} |"
        )
    return lines


def page(tables: Sequence[list[str]]) -> str:
    """Return the page."""
    of_friction, of_duffing = ("\n".join(lines) for lines in tables)
    return f"""# Against AUTO-07p

Written by `benchmarks/auto.py`: {origin()}. Medians of {ROUNDS}
turns, processor time; AUTO's start is taken off. The number next to AUTO's name is that of its mesh
intervals, `NTST`.

## The orbit 1a of Fig. 5

AUTO solves the reduced form (two slides), one way from Omega = 0.5 over the fold to its end, without
multipliers or admissibility; contfric follows the whole branch, both ways, with both. Steps differ: compare
fine steps by the point, default steps by the branch.

{of_friction}

## A smooth oscillator

`x'' + 0.1 x' + x + x^3 = 0.3 cos(w t)` from w = 3 to 0.3, which has two folds; their references are of 45
digits. contfric integrates with error control and gives multipliers at each point, AUTO collocates and
gives none. Compare times at equal errors.

{of_duffing}
"""


def main() -> int:
    """Measure and write, if AUTO is there."""
    auto = os.environ.get("AUTO_DIR")
    if auto is None or shutil.which("gfortran") is None:
        print("AUTO_DIR is not set, or gfortran is not there: nothing is compared", file=sys.stderr)
        return 0
    compiled_yardstick()
    with tempfile.TemporaryDirectory() as folder:
        pairings = [problem(Path(folder), Path(auto)) for problem in (friction, duffing)]
        tables = [table(pairing, measured(pairing)) for pairing in pairings]
    PAGE.write_text(page(tables), encoding="utf-8")
    print(PAGE.read_text(encoding="utf-8"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
