"""The page on chaos: what the paper says of it, measured; ``make gallery``.

Maps and lines of Lyapunov exponents from the paper's initial state (1 + 0.9 S0, 0). Solutions that are
chaotic over 600 periods are followed for 10,000 more, so that chaotic transients are told from chaos.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import contfric as cf

HERE = Path(__file__).resolve().parent
PAGE = HERE / "chaos.md"
IMAGE = HERE.parent / "images" / "gallery" / "chaos.png"
#: Static limit, third harmonic, range of Omega (S runs from 0 to S0), and S of the section on which the
#: curves of the enclosure are found.
CASES = (
    (0.2, 0.0, (0.1, 0.6), 0.15),
    (0.3, 0.0, (0.1, 0.6), 0.25),
    (0.4, 0.0, (0.1, 0.6), 0.32),
    (0.5, 0.0, (0.1, 0.7), 0.35),
    (0.8, 0.0, (0.1, 0.9), 0.4),
    (0.4, 0.05, (0.1, 0.6), 0.28),
    (0.4, -0.05, (0.1, 0.6), 0.32),
)
#: Points along each side of a map, and periods that a chaotic solution is followed further.
SIDE, CONFIRM = 100, 10_000


def chaos_at(omega: object, S: object, S0: float, h: float = 0.0, **how: object) -> cf.LyapunovMap:
    """Return the map on a grid, from the paper's initial state."""
    grid = {"Omega": np.atleast_1d(np.asarray(omega)), "S": np.atleast_1d(np.asarray(S))}
    options = {"state": [1.0 + 0.9 * S0, 0.0], "confirm": CONFIRM, **how}
    return cf.lyapunov_map("coulomb", grid, {"S0": S0, "h": h}, **options)


def maps() -> dict[tuple[float, float], cf.LyapunovMap]:
    """Return the maps by (S0, h)."""
    found = {}
    for S0, h, ends, _ in CASES:
        found[S0, h] = chaos_at(np.linspace(*ends, SIDE), np.linspace(0.0, S0, SIDE), S0, h)
        print(f"S0 = {S0}, h = {h}: {found[S0, h]}", flush=True)
    return found


def map_rows(lmap: cf.LyapunovMap) -> list[str]:
    """Return the cells of the table of maps for one of them."""
    omega, S = np.meshgrid(*lmap.axes.values(), indexing="ij")
    chaos, transient = lmap.chaotic, lmap.where(cf.Motion.TRANSIENT)
    side = [f"{omega[chaos].min():.3f} to {omega[chaos].max():.3f}"]
    area = chaos.mean() * np.ptp(omega) * np.ptp(S)
    return [*side, f"{S[chaos].max():.3f}", f"{area:.4f}", f"{transient.mean():.2%}"]


def widths(lmap: cf.LyapunovMap, values: tuple[float, ...]) -> list[str]:
    """Return how much of Omega is chaotic at some S."""
    step = float(np.diff(lmap.axes["Omega"])[0])
    rows = [int(np.argmin(np.abs(lmap.axes["S"] - S))) for S in values]
    return [f"{lmap.chaotic[:, row].sum() * step:.3f}" for row in rows]


def table_of_maps(found: dict[tuple[float, float], cf.LyapunovMap]) -> list[str]:
    """Return the table of the maps."""
    at = (0.05, 0.1, 0.15, 0.2)
    head = "| S0 | h | Omega of chaos | largest S | area in the plane | transients | "
    lines = [head + " | ".join(f"S = {S}" for S in at) + " |", "|---" * (6 + len(at)) + "|"]
    for (S0, h), lmap in found.items():
        cells = [f"{S0}", f"{h:g}", *map_rows(lmap), *widths(lmap, at)]
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def enclosure(found: dict[tuple[float, float], cf.LyapunovMap]) -> list[str]:
    """Return the table of how much of the chaos lies below BP_2s and to the left of SN_1a."""
    head = "| S0 | h | BP_2s from (Omega, S) | to | chaos below it | SN_1a at S = 0 | chaos left of it |"
    lines = [head, "|---|---|---|---|---|---|---|"]
    for S0, h, ends, section in CASES:
        orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": section, "S0": S0, "h": h})
        seeds = cf.Seeds(values=30, states=2)
        diagram = cf.explore(orbit, "Omega", (0.3, ends[1] + 0.1), seeds=seeds)
        ranges = {"Omega": (0.05, ends[1] + 0.3), "S": (0.0, S0)}
        curves: dict[str, list[cf.Curve]] = {"BP_2s": [], "SN_1a": []}
        for event in diagram.bifurcations:
            if event.label in curves:
                curve = cf.continue_bifurcation(event, ("Omega", "S"), ranges)
                curves[event.label].append(curve)
        cells = [f"{S0}", f"{h:g}", *_below(found[S0, h], curves["BP_2s"])]
        lines.append(f"| {' | '.join([*cells, *_left(found[S0, h], curves['SN_1a'])])} |")
    return lines


def _chaotic_points(lmap: cf.LyapunovMap) -> tuple[np.ndarray, np.ndarray]:
    omega, S = np.meshgrid(*lmap.axes.values(), indexing="ij")
    return omega[lmap.chaotic], S[lmap.chaotic]


def _below(lmap: cf.LyapunovMap, curves: list[cf.Curve]) -> list[str]:
    """Compare where both are: the curve has a range of Omega."""
    longest = max(curves, key=len).values
    curve = longest[np.argsort(longest[:, 0])]
    omega, S = _chaotic_points(lmap)
    over = (omega >= curve[0, 0]) & (omega <= curve[-1, 0])
    limit = np.interp(omega, *curve.T) + np.diff(lmap.axes["S"])[0]  # to a cell of the map
    ends = [f"({a:.4f}, {b:.4f})" for a, b in (curve[0], curve[-1])]
    return [*ends, f"{np.mean(S[over] <= limit[over]):.1%}"]


def _left(lmap: cf.LyapunovMap, curves: list[cf.Curve]) -> list[str]:
    if not curves:
        return ["-", "-"]
    right = max(curves, key=lambda curve: float(curve.values[:, 0].max())).values
    curve = right[np.argsort(right[:, 1])]
    omega, S = _chaotic_points(lmap)
    beside = (curve[0, 1] <= S) & (curve[-1, 1] >= S)
    limit = np.interp(S, curve[:, 1], curve[:, 0]) + np.diff(lmap.axes["Omega"])[0]
    return [f"{curve[0, 0]:.4f}", f"{np.mean(omega[beside] <= limit[beside]):.1%}"]


def band() -> list[str]:
    """Return the table of the narrow band at S0 = 0.3."""
    omega = np.linspace(0.465, 0.49, 51)
    lines = ["| S | S0 / S | Omega of chaos | largest exponent |", "|---|---|---|---|"]
    for S in (0.265, 0.275, 0.285, 0.29):
        lmap = chaos_at(omega, S, 0.3, periods=2000)
        where = omega[lmap.chaotic[:, 0]]
        ends = f"{where.min():.4f} to {where.max():.4f}"
        lines.append(f"| {S} | {0.3 / S:.3f} | {ends} | {lmap.values[:, 0].max():.5f} |")
    return lines


def half() -> list[str]:
    """Return the table of the line Omega = 1/2, S0 = 0.4."""
    S = np.linspace(0.0, 0.09, 181)
    lmap = chaos_at(0.5, S, 0.4, periods=2000)
    lines = ["| S | values | chaotic | periodic, of periods |", "|---|---|---|---|"]
    for low, high in ((0.0, 0.03562), (0.03562, 0.043479), (0.043479, 0.055787), (0.055787, 0.09)):
        here = (low <= S) & (high > S)
        periods = sorted(set(lmap.periods[0, here, 0].tolist()) - {0})
        count, chaos = int(here.sum()), int(lmap.chaotic[0, here].sum())
        lines.append(
            f"| {low:g} to {high:g} | {count} | {chaos} | {', '.join(map(str, periods))} |"
        )
    return lines


def draw(found: dict[tuple[float, float], cf.LyapunovMap]) -> None:
    """Draw the maps side by side."""
    from contfric.plot.appearance.save import new_figure, save_figure

    figure = new_figure(13.0, 10.0)
    grid = figure.subplots(3, 3)
    for axes, ((S0, h), lmap) in zip(grid.flat, found.items(), strict=False):
        lmap.plot(ax=axes)
        axes.set_title(f"$S_0$ = {S0:g}" + (f", $h$ = {h:g}" if h else ""), fontsize=10)
    for axes in grid.flat[len(found) :]:
        axes.set_axis_off()
    save_figure(figure, IMAGE)


def with_table(page: str, name: str, lines: list[str]) -> str:
    """Return the text of the page with a table put in its place."""
    before, begin, rest = page.partition(f"<!-- table: {name} -->\n")
    _, end, after = rest.partition("<!-- end -->")
    if not end:
        raise ValueError(f"the page has no place for the table {name}")
    return before + begin + "\n".join(lines) + "\n" + end + after


def main() -> None:
    """Compute the tables and the figure."""
    found = maps()
    text = PAGE.read_text(encoding="utf-8")
    tables = {
        "maps": table_of_maps(found),
        "enclosure": enclosure(found),
        "band": band(),
        "half": half(),
    }
    for name, lines in tables.items():
        text = with_table(text, name, lines)
    PAGE.write_text(text, encoding="utf-8")
    draw(found)


if __name__ == "__main__":
    main()
