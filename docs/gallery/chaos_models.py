"""The page on chaos of integrated models: maps, chaotic solutions, period doublings; ``make gallery``.

Everything goes through ``lyapunov_map`` and ``lyapunov_exponent``, as for the model in closed form.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

import contfric as cf

sys.path.append(str(Path(__file__).parents[2]))
from tests.two_orbits import two_orbit_estimate

HERE = Path(__file__).resolve().parent
PAGE = HERE / "chaos-models.md"
IMAGES = HERE.parent / "images" / "gallery"
#: Maps: model, grid (low, high, values), fixed parameters, file of the figure.
MAPS = {
    "popp": ({"omega": (0.6, 2.0, 60), "F": (0.05, 0.35, 40)}, {}, "chaos-popp.png"),
    "impact": ({"w": (0.5, 5.0, 60), "d": (-0.4, 1.0, 40)}, {}, "chaos-impact.png"),
}
#: Chaotic solutions, one of each kind: model, parameters, periods.
CHAOS = (
    ("popp", "slides and sticks, no jump", {"omega": 1.69, "F": 0.1}, 2000),
    ("impact", "impacts", {"w": 2.8, "d": 0.0}, 2000),
    ("bang-bang", "the force jumps", {"A": 100.0}, 1000),
    ("coulomb-yaml", "sticks, jumps", {"Omega": 0.35, "S": 0.05, "S0": 0.4}, 600),
    ("lugre", "a kink", {"Omega": 0.5, "S": 0.372, "S0": 0.4}, 600),
)
#: Period doublings of Popp's oscillator (popp.md): F and omega.
DOUBLINGS = (
    (0.1, 1.71298103623),
    (0.11, 1.74206308478),
    (0.12, 1.76610218792),
    (0.13, 1.78710166362),
    (0.15, 1.82335414075),
)
#: Distances from a doubling at which exponents are taken, to extrapolate to where they vanish.
BESIDE = np.array([2e-3, 4e-3, 6e-3, 8e-3])


def map_of(model: str) -> tuple[cf.LyapunovMap, float]:
    """Return a map and the seconds that it took."""
    sides, fixed, _ = MAPS[model]
    grid = {name: np.linspace(low, high, count) for name, (low, high, count) in sides.items()}
    cf.lyapunov_exponent(model, fixed, periods=1)  # what is compiled or loaded once
    began = time.perf_counter()
    found = cf.lyapunov_map(model, grid, fixed)
    return found, time.perf_counter() - began


def table_of_maps() -> list[str]:
    """Compute the maps, draw them, and return the table of what is in them."""
    from contfric.plot.appearance.save import new_figure, save_figure

    lines = ["| model | points | seconds | what the solutions are |", "|---|---|---|---|"]
    for model, (_, _, file) in MAPS.items():
        found, seconds = map_of(model)
        figure = new_figure(6.4, 4.6)
        found.plot(ax=figure.add_subplot())
        save_figure(figure, IMAGES / file)
        kinds = ", ".join(f"{n} {motion.name.lower()}" for motion, n in found.counts().items())
        points = " x ".join(str(side) for side in found.shape)
        lines.append(f"| `{model}` | {points} | {seconds:.0f} | {kinds} |")
        print(lines[-1], flush=True)
    return lines


def table_of_chaos() -> list[str]:
    """Return the exponents of chaotic solutions, by the tangent map and by two orbits."""
    head = "| model | | at | exponents | error | two orbits | error | apart, in errors |"
    lines = [head, "|---" * 8 + "|"]
    for model, kind, params, periods in CHAOS:
        found = cf.lyapunov_exponent(model, params, periods=periods, tolerance=0.0)
        other = two_orbit_estimate(model, params, periods=min(periods, 600))
        apart = abs(found.largest - other.value) / np.hypot(found.error, other.error)
        at = ", ".join(f"{name} = {value:g}" for name, value in params.items())
        values = ", ".join(f"{value:.4f}" for value in found.exponents)
        lines.append(
            f"| `{model}` | {kind} | {at} | {values} | {found.error:.4f} "
            f"| {other.value:.4f} | {other.error:.4f} | {apart:.1f} |"
        )
        assert found.motion is cf.Motion.CHAOTIC, (model, found)
        print(lines[-1], flush=True)
    return lines


def vanishes(F: float, omega: float, side: float) -> float:
    """Return where the exponent of Popp's oscillator vanishes, extrapolated from one side of a value."""
    values = [
        cf.lyapunov_exponent("popp", {"F": F, "omega": omega + side * d}, periods=2000).largest
        for d in BESIDE
    ]
    # omega as a cubic of the exponent, at 0
    return omega + side * float(np.polyfit(values, BESIDE, 3)[-1])


def table_of_doublings() -> list[str]:
    """Return where the exponents vanish, next to the doublings that are solved for."""
    lines = ["| F | PD (popp.md) | exponent vanishes, from above | apart |", "|---|---|---|---|"]
    for F, omega in DOUBLINGS:
        found = vanishes(F, omega, 1.0)
        lines.append(f"| {F:g} | {omega:.8f} | {found:.8f} | {abs(found - omega):.0e} |")
        print(lines[-1], flush=True)
    return lines


def with_table(page: str, name: str, lines: list[str]) -> str:
    """Return the text of the page with a table put in its place."""
    before, begin, rest = page.partition(f"<!-- table: {name} -->\n")
    _, end, after = rest.partition("<!-- end -->")
    if not end:
        raise ValueError(f"the page has no place for the table {name}")
    return before + begin + "\n".join(lines) + "\n" + end + after


def main() -> None:
    """Compute the tables and the figures."""
    tables = {
        "doublings": table_of_doublings(),
        "chaos": table_of_chaos(),
        "maps": table_of_maps(),
    }
    text = PAGE.read_text(encoding="utf-8")
    for name, lines in tables.items():
        text = with_table(text, name, lines)
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
