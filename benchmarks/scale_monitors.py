"""What each monitor and each quantity costs, warm, in one process: with it and without it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

from bench_engine import CASES, branch_of
from measuring import Case, Row, measure
from page import duration

import contfric as cf
from contfric.base.files import write_csv
from contfric.study.drawings import draw as draw_figure
from contfric.study.read import Study, read_study
from contfric.study.tables import points

#: Rounds of points and quantities, of which multipliers are a few percent, and of figures: half a second.
ROUNDS, OF_FIGURES = 25, 5
#: What a study may want; the columns of each are computed from the joints.
WANTS = ("stability", "asymmetry", "extrema", "stops")
#: Properties of a branch that a table, a figure or a user asks for.
QUANTITIES = {
    "stable": "stable",
    "stops": "stops",
    "x_max and x_min": "extrema",
    "asymmetry": "asymmetry",
    "name": "name",
    "margins": "margins",
}

STUDY = """
model: coulomb
params: {{Omega: 0.5, S: 0.32, S0: 0.4}}
start: {{signature: 1a}}
explore: {{parameter: Omega, range: [0.4, 0.6]}}
want: [{want}]
figures: [{figures}]
"""
FIGURES = "{kind: diagram, rows: [x_max, stops, psi]}, {kind: orbit}, {kind: transitions}"

Call = Callable[[], tuple[Any, str]]


def study_of(folder: Path, *want: str, figures: str = "") -> Study:
    """A study that wants this and nothing else."""
    path = folder / "study.yaml"
    path.write_text(STUDY.format(want=", ".join(want), figures=figures), encoding="utf-8")
    return read_study(path)


def explore(orbit: cf.Orbit, stability: bool) -> tuple[int, str]:
    """The diagram of Fig. 5, from a solved orbit."""
    diagram = cf.explore(orbit, "Omega", (0.4, 0.6), stability=stability)
    points = sum(len(b) for b in diagram.branches if not b.mirrored)
    return points, f"{len(diagram.branches)} branches, {len(diagram.bifurcations)} events"


def quantity(branch: cf.Branch, name: str) -> tuple[Any, str]:
    """A property of a branch of which nothing has been asked yet."""
    fresh = replace(branch)
    if name == "extrema":
        return (fresh.x_max, fresh.x_min), ""
    return getattr(fresh, name), ""


def counted(call: Callable[[], cf.Branch]) -> tuple[cf.Branch, str]:
    """A call, and how many points came."""
    branch = call()
    return branch, f"{len(branch)} points, {len(branch.bifurcations)} events inside"


def wrote(path: Path, study: Study, branch: cf.Branch) -> tuple[None, str]:
    """The table of points of a branch."""
    table = points(study, (replace(branch),))
    write_csv(path, chain([table.header], table.rows))
    return None, f"{path.stat().st_size / len(branch):.0f} bytes a point"


def _case(group: str, name: str, call: Call, units: int) -> Case:
    return Case(group, name, call, lambda _: 0.0, units)


def monitor_cases() -> list[Case]:
    """Continuation and exploration, with multipliers and without."""
    found = []
    for name in ("1a", "2s", "2a-14seg"):
        for on in (True, False):
            call = branch_of(name, stability=on)
            text = f"branch {name}, " + ("with multipliers" if on else "without")
            found.append(_case("point", text, partial(counted, call), len(call())))
    orbit = cf.solve_orbit("coulomb", "1a", CASES["1a"][0])
    for on in (True, False):
        points = explore(orbit, on)[0]
        text = "Fig. 5, explored, " + ("with multipliers" if on else "without (no BP, no PD)")
        found.append(_case("point", text, partial(explore, orbit, on), points))
    return found


def quantity_cases(branch: cf.Branch, folder: Path) -> list[Case]:
    """Columns of a table: computed, and written."""
    count = len(branch)
    found = [
        _case("quantity", f"`{name}` of a branch", partial(quantity, branch, key), count)
        for name, key in QUANTITIES.items()
    ]
    for want in ((), *((want,) for want in WANTS), WANTS):
        study = study_of(folder, *want)
        text = f"points.csv, want: [{', '.join(want)}]"
        found.append(
            _case("quantity", text, partial(wrote, folder / "points.csv", study, branch), count)
        )
    return found


def figure_cases(folder: Path) -> list[Case]:
    """Figures, when matplotlib is loaded."""
    study = study_of(folder, *WANTS, figures=FIGURES)
    orbit = cf.solve_orbit("coulomb", "1a", CASES["1a"][0])
    diagram = cf.explore(orbit, "Omega", (0.4, 0.6))

    def draw(index: int) -> tuple[None, str]:
        drawing = study.drawings[index]
        path = folder / drawing.file
        draw_figure(path, drawing, {"orbit": orbit, "diagram": diagram}, study.title)
        return None, f"{path.stat().st_size / 1e3:.0f} kB"

    return [
        _case("figure", f"{drawing.kind}.png", partial(draw, index), 1)
        for index, drawing in enumerate(study.drawings)
    ]


def run() -> list[Row]:
    """Measure everything, in turns."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        branch = branch_of("1a")()
        found = measure([*monitor_cases(), *quantity_cases(branch, folder)], ROUNDS)
        return found + measure(figure_cases(folder), OF_FIGURES)


def table(rows: list[Row]) -> str:
    """Everything, and what a scene that does not ask for multipliers saves."""
    lines = ["| what | unit | median | minimum | remark |", "|---|---|---|---|---|"]
    lines += [
        f"| {r.case.setting} | a {'figure' if r.case.method == 'figure' else 'point'} "
        f"| {duration(r.median)} | {duration(r.least)} | {r.remark} |"
        for r in rows
    ]
    return "\n".join(lines)


def savings(rows: list[Row]) -> str:
    """What multipliers are of a point, by the minima: the difference is a few percent."""
    points = [row for row in rows if row.case.method == "point"]
    parts = []
    for on, off in zip(points[::2], points[1::2], strict=True):
        share = 100.0 * (1.0 - off.least / on.least)
        parts.append(f"{on.case.setting.rsplit(',', 1)[0]}: {share:.0f} percent")
    return "Saved by not asking for stability (by the minima): " + "; ".join(parts) + "."
