"""The Coulomb limit: how the orbits and branches of `stribeck` and `lugre` approach those of `coulomb`.

``python benchmarks/coulomb_limit.py [NAME ...]`` writes the tables of docs/coulomb-limit.md, each
between ``<!-- limit: NAME -->`` and ``<!-- end -->``, and its picture; without names all of them. The
formulas that they are compared with are in ``coulomb_limit_theory.py``.
"""

from __future__ import annotations

import math
import re
import sys
from functools import cache
from pathlib import Path

import numpy as np
from coulomb_limit_theory import Law, amplitudes, exponent, held
from scipy.integrate import solve_ivp

import contfric as cf

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "coulomb-limit.md"
#: The model stribeck with further joints inside of the hold.
CUT = Path(__file__).with_name("stribeck-cut.yaml")
S0 = 0.4
#: Kinetic friction at which 1a attracts at Omega = 1/2, and ends in a bridge 0.053 wide.
S = 0.2
#: The bridge: its range in Omega, the longest hold, and holds so long that the corners are left out.
BRIDGE, LONGEST, INNER = (0.40, 0.456), 1.0635, (0.3, 1.0)
#: Velocities of the table of bridges, where simulation finds 1a there, and the end that Newton reaches.
BRIDGES = ((0.02, 0.44), (0.01, 0.44), (0.005, 0.446), (0.0025, 0.45))
#: Multipliers beyond about this one are lost in the rounding of the others.
SEEN = 1e24
#: Columns of the tables of bridges.
COMPARED = "all of it | holds 0.3 to 1 | formulas | largest multiplier | growth"
#: vS, sigma0 = 0.2 / vS^3, sigma1 / sqrt(sigma0), Omega of a start (stable there), and the lowest Omega.
BRISTLES = (
    (0.04, 3125.0, 2.0, 0.44, 0.38),
    (0.02, 25000.0, 2.0, 0.44, 0.4),
    (0.01, 2e5, 2.0, 0.44, 0.409),
    (0.005, 1.6e6, 2.0, 0.444, 0.424),
)
#: LuGre's meander is followed piece by piece, each this wide in Omega: a step may be no longer.
PIECE = 0.002


# One release, by integration ------------------------------------------------------------------


def released(law: Law, rate: float) -> float:
    """Delay of a release under the load S0 + rate t, by integration of the law."""
    S, D, s0 = law.S, law.drop, law.sigma0

    def g(v: float) -> float:
        return S + D * math.exp(-abs(v) / law.vS)

    def bristles(_: float, y: np.ndarray) -> list[float]:
        v, z = y
        dz = v - s0 * abs(v) / g(v) * z
        return [law.S0 + rate * _ - s0 * z - law.sigma1 * dz, dz]

    def gone(_: float, y: np.ndarray) -> float:
        return float(y[0]) - 40.0 * law.vS  # exp(-40) is below rounding: Coulomb friction

    gone.terminal = True  # type: ignore[attr-defined]
    ahead = 0.0 if math.isinf(s0) else 0.5 * law.S0  # creep under half the load, slaved to it
    start = [0.0] if ahead == 0.0 else [2.0 * rate / s0, 0.5 * law.S0 / s0]
    field = bristles if ahead else lambda t, y: [law.S0 + rate * t - g(y[0])]
    run = solve_ivp(field, (-ahead / rate, 9.0), start, "Radau", rtol=1e-9, atol=1e-14, events=gone)
    t, v = float(run.t[-1]), float(run.y[0, -1])
    c = v - D * t - 0.5 * rate * t * t  # v = D (t - d) + rate (t^2 - d^2) / 2 after the delay d
    return (math.sqrt(D * D - 2.0 * rate * c) - D) / rate


def releases() -> list[str]:
    """Table: the delay of a release."""
    rate = 0.4
    lines = [
        "| vS | sigma0 | kappa | sigma1 = 0 | formula | sigma1 = 2 sqrt(sigma0) | formula |",
        "|---|---|---|---|---|---|---|",
    ]
    for vS in (0.01, 0.001):
        for sigma0 in (1e5, 1e6, 1e7, math.inf):
            laws = [Law(S, S0, vS, sigma0, m * math.sqrt(sigma0) if m else 0.0) for m in (0, 2)]
            if math.isinf(sigma0):
                laws = laws[:1]
            cells = [
                f"{d:.5f}" if law.nu < law.tau else "-"  # damping holds no release back
                for law in laws
                for d in (released(law, rate), law.release(rate))
            ]
            kappa = f"{laws[0].kappa(rate):.3g}" if len(laws) == 2 else "inf"
            lines.append(f"| {vS:g} | {sigma0:g} | {kappa} | {' | '.join((*cells, '', '')[:4])} |")
    return lines


# Stable orbits --------------------------------------------------------------------------------


def extrema(orbit: cf.Orbit) -> np.ndarray:
    """Return the smaller and the larger amplitude: mirror images have the same."""
    return np.sort([orbit.x_max, -orbit.x_min])


def stable() -> list[str]:
    """Table: Stribeck's stable orbits at Omega = 1/2."""
    lines = [
        "| S | orbit | vS | difference | derived | what is left |",
        "|---|---|---|---|---|---|",
    ]
    for kinetic, speeds in (
        (0.38, (2e-4, 1e-4, 5e-5, 2.5e-5)),
        (S, (8e-3, 4e-3, 2e-3, 1e-3, 5e-4)),
    ):
        params = {"Omega": 0.5, "S": kinetic, "S0": S0}
        limit = cf.find_orbit("coulomb", params)
        for vS in speeds:
            orbit = cf.find_orbit("stribeck", {**params, "vS": vS})
            gap = (extrema(orbit) - extrema(limit))[1]
            derived = (amplitudes(Law(kinetic, S0, vS), 0.5, 400) - extrema(limit))[1]
            lines.append(
                f"| {kinetic} | {orbit.name} | {vS:g} | {gap:.3e} | {derived:.3e} | {gap - derived:.1e} |"
            )
    return lines


#: vS and the stiffnesses of the table of LuGre's stable orbits.
STIFF = ((0.01, (1e4, 1e5, 4e5)), (0.005, (4e5,)))


def lugre() -> list[str]:
    """Table: LuGre's 1a at Omega = 1/2, next to Stribeck's and Coulomb's."""
    lines = [
        "| vS | sigma0 | sigma1 | to stribeck | derived | to coulomb | derived |",
        "|---|---|---|---|---|---|---|",
    ]
    params = {"Omega": 0.5, "S": S, "S0": S0}
    limit = extrema(cf.find_orbit("coulomb", params))
    for vS, stiffnesses in STIFF:
        steep = extrema(cf.find_orbit("stribeck", {**params, "vS": vS}))
        slow = amplitudes(Law(S, S0, vS), 0.5, 80)
        for sigma0 in stiffnesses:
            for m in (0.0, 2.0):
                sigma1 = m * math.sqrt(sigma0)
                where = {**params, "vS": vS, "sigma0": sigma0, "sigma1": sigma1}
                found = extrema(cf.find_orbit("lugre", where, longest=60))
                derived = amplitudes(Law(S, S0, vS, sigma0, sigma1), 0.5, 80)
                values = (found - steep, derived - slow, found - limit, derived - limit)
                cells = " | ".join(f"{v[1]:.2e}" for v in values)
                lines.append(f"| {vS:g} | {sigma0:.0e} | {sigma1:g} | {cells} |")
    return lines


# Bridges --------------------------------------------------------------------------------------


def curve(branch: cf.Branch) -> np.ndarray:
    """Omega, x_max and -x_min along a branch."""
    return np.column_stack([branch.values, branch.x_max, -branch.x_min])


def distances(points: np.ndarray, line: np.ndarray) -> np.ndarray:
    """Distance of each point to a polygon."""
    start, edge = line[:-1], np.diff(line, axis=0)
    square = np.maximum(np.sum(edge**2, axis=1), 1e-300)
    along = np.clip(np.einsum("pij,ij->pi", points[:, None] - start, edge) / square, 0.0, 1.0)
    gaps = start + along[..., None] * edge - points[:, None]
    return np.sqrt(np.min(np.sum(gaps**2, axis=2), axis=1))


def holds(law: Law, lengths: np.ndarray, delays: bool = True) -> np.ndarray:
    """Points of the bridge under a law, by the formulas."""
    points, guess = [], np.array([0.4547, -1.1793])
    for length in np.unique(np.concatenate([np.arange(0.0, lengths[0], 0.02), lengths])):
        point = held(law, float(length), guess, delays)
        guess = point[[0, 2]] * (1.0, -1.0)
        if length in lengths:
            points.append(point)
    return np.array(points)


@cache
def diagram() -> cf.Diagram:
    """Coulomb's diagram, with its bridge."""
    start = cf.find_orbit("coulomb", {"Omega": 0.5, "S": S, "S0": S0})
    return cf.explore(start, "Omega", (0.35, 0.52))


@cache
def steep(vS: float, Omega: float) -> cf.Branch:
    """Stribeck's branch 1a with its meander, to where its slide touches rest."""
    start = cf.find_orbit(cf.load_model(CUT), {"Omega": Omega, "S": S, "S0": S0, "vS": vS})
    return cf.continue_orbit(start, "Omega", (0.35, 0.4635), max_step=0.005)


def measured(branch: cf.Branch) -> np.ndarray:
    """Omega, x_max, -x_min and the largest multiplier along a branch, in the order of Omega or against it."""
    largest = [float(np.max(np.abs(orbit.multipliers))) for orbit in branch]
    return np.column_stack([curve(branch), largest])


@cache
def bristled(vS: float, sigma0: float, damping: float, Omega: float, lowest: float) -> np.ndarray:
    """LuGre's branch from large Omega down, cut in the middle of the hold: as `measured`."""
    sigma1 = damping * math.sqrt(sigma0)
    law = {"vS": vS, "sigma0": sigma0, "sigma1": sigma1, "phi0": 6.2}
    orbit = cf.find_orbit("lugre", {"Omega": Omega, "S": S, "S0": S0, **law}, longest=60)
    up = measured(cf.continue_orbit(orbit, "Omega", (Omega - 1e-6, 0.4635), max_step=0.1))
    pieces = [up[np.argsort(-up[:, 0])]]
    while Omega > lowest:
        down = (Omega - PIECE, Omega + 1e-6)
        piece = cf.continue_orbit(orbit, "Omega", down, max_step=0.5, stability=False)
        if piece.values.min() > Omega - 0.5 * PIECE:
            break
        orbit = piece[int(np.argmin(piece.values))]
        Omega = orbit.params["Omega"]
        found = measured(piece)
        pieces.append(found[np.argsort(-found[:, 0])])
    return np.vstack(pieces)


def growth(law: Law, found: np.ndarray) -> str:
    """Largest multiplier, and its growth along the meander over that of the formula."""
    lengths = np.linspace(*INNER, 36)
    line, multipliers = found[:, :3], found[:, 3]
    points = holds(law, lengths)
    lengths, points = (
        lengths[points[:, 0] > line[:, 0].min()],
        points[points[:, 0] > line[:, 0].min()],
    )
    nearest = [int(np.argmin(np.sum((line - point) ** 2, axis=1))) for point in points]
    grown = np.log(multipliers[nearest])
    derived = np.array([exponent(law, p, n) for p, n in zip(points, lengths, strict=True)])
    clear = derived < 0.8 * math.log(SEEN)
    if clear.sum() < 5:
        return f"{multipliers.max():.0e} | -"
    slope = np.polyfit(derived[clear], grown[clear], 1)[0]
    return f"{multipliers.max():.0e} | {slope:.3f}"


def row(law: Law, line: np.ndarray) -> list[str]:
    """Distances of Coulomb's bridge, all of it and its inner part, and of that of the formulas."""
    lowest = (
        line[:, 0].min() + 0.5 * PIECE
    )  # a branch that ends early is compared as far as it goes
    every, inner = np.linspace(0.0, LONGEST, 60), np.linspace(*INNER, 36)
    limit = Law(S, S0, 1.0)
    compared = (
        holds(limit, every, delays=False),
        holds(limit, inner, delays=False),
        holds(law, inner),
    )
    reached = [p[p[:, 0] > lowest] for p in compared]
    return [f"{distances(p, line).max():.2e}" if len(p) else "-" for p in reached]


def meander() -> list[str]:
    """Table: Stribeck's meander and the bridge."""
    lines = [
        f"| vS | {COMPARED} |",
        "|---|---|---|---|---|---|",
    ]
    for vS, Omega in BRIDGES:
        branch = steep(vS, Omega)
        law = Law(S, S0, vS)
        cells = [*row(law, curve(branch)), growth(law, measured(branch))]
        lines.append(f"| {vS:g} | {' | '.join(cells)} |")
    return lines


def bristles() -> list[str]:
    """Table: LuGre's meander and the bridge."""
    lines = [
        f"| vS | sigma0 | sigma1 | {COMPARED} | down to |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for vS, sigma0, damping, Omega, lowest in BRISTLES:
        found = bristled(vS, sigma0, damping, Omega, lowest)
        law = Law(S, S0, vS, sigma0, damping * math.sqrt(sigma0))
        cells = [*row(law, found[:, :3]), growth(law, found), f"{found[:, 0].min():.3f}"]
        lines.append(f"| {vS:g} | {sigma0:g} | {law.sigma1:.4g} | {' | '.join(cells)} |")
    return lines


# The page -------------------------------------------------------------------------------------

TABLES = {
    "release": releases,
    "stable": stable,
    "lugre": lugre,
    "meander": meander,
    "bristles": bristles,
}


def with_table(page: str, name: str, lines: list[str]) -> str:
    """Return a page with one of its tables replaced."""
    found = re.compile(rf"(<!-- limit: {name} -->\n).*?(<!-- end -->)", re.DOTALL)
    if not found.search(page):
        raise ValueError(f"the page has no place for {name}")
    return found.sub(lambda m: m.group(1) + "\n".join(lines) + "\n" + m.group(2), page)


def main(names: list[str]) -> None:
    """Write tables (and the picture) of the page."""
    for name in names or [*TABLES, "picture"]:
        if name == "picture":
            from coulomb_limit_picture import draw

            draw()
            continue
        lines = TABLES[name]()
        print("\n".join(lines), flush=True)
        PAGE.write_text(with_table(PAGE.read_text("utf-8"), name, lines), "utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
