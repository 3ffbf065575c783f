"""The plane Omega-S of the LuGre oscillator: curves through the events of Figs. 17 and 18.

Both diagrams are explored, and each of their events that lies on no curve yet starts one. ``lugre-plane.md``
has its tables between ``<!-- plane: NAME -->`` and ``<!-- end -->``; all else is written by hand. With a
folder as argument what is finished is kept there, and taken up again.
"""

from __future__ import annotations

import re
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import contfric as cf

HERE = Path(__file__).resolve().parent
PAGE = HERE / "lugre-plane.md"
FIGURE = HERE.parent / "images" / "gallery" / "lugre-plane.png"
NAMES = ("Omega", "S")
RANGES = {"Omega": (0.4, 0.58), "S": (0.25, 0.4)}
S0 = 0.4
#: Sections: the lines of Figs. 17 and 18, with the parameters of a stable orbit to start from.
SECTIONS = {
    "fig17": ("S", (0.25, 0.4), {"Omega": 0.5, "S": 0.38, "S0": S0}),
    "fig18": ("Omega", (0.4, 0.58), {"Omega": 0.57, "S": 0.32, "S0": S0}),
}
#: Largest step of curves as a share of the ranges, and most points of each side.
STEP, POINTS = 0.004, 150
#: An event lies on a curve that crosses its section this near to it, with joints this near to its own.
SAME_LOCATION, SAME_ORBIT = 1e-5, 3e-2
#: Kinds in the order in which their curves are followed.
KINDS = (cf.Kind.BP, cf.Kind.SN)
#: Symmetric orbits between these are left out (five loops of Fig. 18 that are like the first one), and all
#: folds of asymmetric orbits but that at which the main branch turns: a curve takes 10 to 100 s.
LOOPS, MAIN_FOLD = (0.41, 0.46), 0.55
#: Places that are simulated, random starts of each, and periods that a solution may take to converge.
PLACES = (
    (0.56, 0.38),
    (0.56, 0.28),
    (0.51, 0.38),
    (0.51, 0.3),
    (0.48, 0.36),
    (0.445, 0.32),
    (0.45, 0.36),
)
STARTS, LONGEST = 6, 600
#: Digits of the tables.
DIGITS = 7
#: A curve that ends this near to an edge of the plane ends there.
EDGE = 1e-9
#: Third derivatives are differences over 2e-3: where an orbit comes nearer to a touch, a coefficient made of
#: them says nothing.
TOUCH = 2e-3


def sections(folder: Path) -> dict[str, cf.Diagram]:
    """Return the diagrams of both sections."""
    found = {}
    for name, (parameter, bounds, params) in SECTIONS.items():
        file = folder / f"{name}.npz"
        if not file.is_file():
            orbit = cf.find_orbit("lugre", params)
            cf.save(cf.explore(orbit, parameter, bounds, max_periods=1), file)
        found[name] = cf.load(file)
    return found


def events(diagrams: dict[str, cf.Diagram]) -> list[cf.Bifurcation]:
    """Return the events of the sections, mirror images and branch points of asymmetric branches left out."""
    found = [
        b
        for diagram in diagrams.values()
        for branch in diagram.branches
        if not branch.mirrored
        for b in branch.bifurcations
        if b.kind in KINDS and is_wanted(b, branch.symmetric)
    ]
    return sorted(
        found,
        key=lambda b: (
            KINDS.index(b.kind),
            not b.orbit.symmetric,
            -b.params["Omega"],
            b.params["S"],
        ),
    )


def is_wanted(event: cf.Bifurcation, symmetric: bool) -> bool:
    """Tell whether the curve of an event is drawn."""
    omega = event.params["Omega"]
    return (
        not LOOPS[0] < omega < LOOPS[1]
        if symmetric
        else omega > MAIN_FOLD and event.kind is cf.Kind.SN
    )


def crossings(curve: cf.Curve, name: str, level: float) -> list[tuple[float, int]]:
    """Return where a curve crosses a line: the other parameter, and a point next to it."""
    k = NAMES.index(name)
    along, other = curve.values[:, k] - level, curve.values[:, 1 - k]
    found = []
    for i in np.flatnonzero(along[1:] * along[:-1] <= 0.0):
        share = along[i] / (along[i] - along[i + 1])
        found.append((float(other[i] + share * (other[i + 1] - other[i])), int(i + round(share))))
    return found


def lies_on(curve: cf.Curve, event: cf.Bifurcation) -> bool:
    """Tell whether an event is a point of a curve."""
    if curve.kind is not event.kind or curve.symmetric != event.orbit.symmetric:
        return False
    on = "Omega" if event.params["Omega"] == SECTIONS["fig17"][2]["Omega"] else "S"
    free = NAMES[1 - NAMES.index(on)]
    for value, k in crossings(curve, on, event.params[on]):
        if abs(value - event.params[free]) < SAME_LOCATION:
            here, there = curve[k].as_whole().joints, event.orbit.as_whole().joints
            if here.shape == there.shape and np.max(np.abs(here - there)) < SAME_ORBIT:
                return True
    return False


def curves_of(found: list[cf.Bifurcation], folder: Path) -> tuple[list[cf.Curve], list[str]]:
    """Return the curves through events, each once, and what was refused."""
    curves = [cf.load(file) for file in sorted(folder.glob("curve-*.npz"))]
    refused = []
    for event in found:
        if any(lies_on(curve, event) for curve in curves):
            continue
        at = f"{event.kind.value} at Omega = {event.params['Omega']:.9f}, S = {event.params['S']:.9f}"
        try:
            curve = cf.continue_bifurcation(event, NAMES, RANGES, max_step=STEP, max_points=POINTS)
            curves.append(curve)
            cf.save(curve, folder / f"curve-{at}.npz".replace(" ", ""))
            print(at, curve, flush=True)
        except cf.ContfricError as error:
            refused.append(f"{at}: {error}")
            print(refused[-1], flush=True)
    return curves, refused


def ends_of(curve: cf.Curve) -> str:
    """Return how a curve ends: at an edge of the plane, at a named point, or where it gets no farther."""
    low, high = (np.array([RANGES[name][k] for name in NAMES]) for k in range(2))
    found = []
    for k, end in zip((0, -1), curve.ends, strict=True):
        point = curve.values[k]
        edge = np.min(np.abs(np.concatenate([point - low, point - high]))) < EDGE
        found.append("edge" if edge else end.special.name if end.special is not None else "stops")
    return ", ".join(found)


def curve_table(curves: list[cf.Curve]) -> list[str]:
    """Return the curves as a table: kind, orbits, both ends, range of S."""
    rows = ["| curve | orbits | from | to | S from, to | ends |", "|---|---|---|---|---|---|"]
    for curve in curves:
        values = curve.values
        first, last = (f"({values[k, 0]:.6f}, {values[k, 1]:.6f})" for k in (0, -1))
        low, high = values[:, 1].min(), values[:, 1].max()
        kind = "symmetric" if curve.symmetric else "asymmetric"
        rows.append(
            f"| {curve.kind.value} | {kind} | {first} | {last} | {low:.6f}, {high:.6f} | {ends_of(curve)} |"
        )
    return rows


def least_speed(orbit: cf.Orbit) -> float:
    """Return the least abs(v) at which v is stationary: how near the orbit comes to touching v = 0."""
    whole = orbit.as_whole()
    c = [o.name for o in whole.model.observables].index("v")
    times, values = np.empty(512), np.empty(512)
    start = whole.joints[0]
    found = whole.model.flow.stationary(
        0, c, start[0], start[1:].copy(), whole.period, whole.vector, times, values
    )
    return float(np.min(np.abs(values[:found])))


def shown_points(curves: list[cf.Curve]) -> list[Any]:
    """Return the points of codimension two that are no artefact of a touch."""
    points = [point for curve in curves for point in curve.special]
    return [p for p in points if not p.name.endswith("-T") and least_speed(p.orbit) > TOUCH]


def special_table(curves: list[cf.Curve]) -> list[str]:
    """Return the same as a table."""
    rows = ["| point | on | Omega | S | least speed |", "|---|---|---|---|---|"]
    for curve in curves:
        for point in shown_points([curve]):
            kind = f"{curve.kind.value}, {'symmetric' if curve.symmetric else 'asymmetric'}"
            at = (f"{point.params[name]:.{DIGITS}f}" for name in NAMES)
            speed = least_speed(point.orbit)
            rows.append(f"| {point.name} | {kind} | {' | '.join(at)} | {speed:.1e} |")
    return rows


def attractors_at(omega: float, s: float) -> list[str]:
    """Return what simulations from random starts converge to."""
    model, random = cf.load_model("lugre"), np.random.default_rng(1)
    params = {"Omega": omega, "S": s, "S0": S0}
    width, found = model.spread(model.check_params(params)), set()
    for _ in range(STARTS):
        start = random.uniform(-width, width)
        try:
            orbit = cf.find_orbit(model, params, state=start, longest=LONGEST)
            kind = "symmetric" if orbit.symmetric else "asymmetric"
            found.add(f"{kind}, {orbit.periods} period{'s' if orbit.periods > 1 else ''}")
        except cf.ConvergenceError:
            found.add("no period found")
    return sorted(found)


def region_table(folder: Path) -> list[str]:
    """Return what simulations converge to at places of the plane."""
    file = folder / "regions.md"
    if not file.is_file():
        rows = [f"| {o:g} | {s:g} | {'; '.join(attractors_at(o, s))} |" for o, s in PLACES]
        file.write_text("\n".join(rows), encoding="utf-8")
    head = ["| Omega | S | simulations converge to |", "|---|---|---|"]
    return [*head, *file.read_text(encoding="utf-8").splitlines()]


def draw(curves: list[cf.Curve]) -> None:
    """Write the figure."""
    from contfric.plot.plane import plot_curves

    axes = plot_curves(curves, special=False)
    for point in shown_points(curves):
        at = [point.params[name] for name in NAMES]
        axes.plot(
            *at, "o", markersize=4.5, markerfacecolor="white", markeredgecolor="black", zorder=5
        )
        axes.annotate(point.name, at, xytext=(8, -12), textcoords="offset points", fontsize=8)
    axes.set_xlim(*RANGES["Omega"])
    axes.set_ylim(*RANGES["S"])
    for name, (parameter, _, params) in SECTIONS.items():
        line = axes.axvline if parameter == "S" else axes.axhline
        fixed = NAMES[1 - NAMES.index(parameter)]
        line(params[fixed] if name == "fig17" else 0.32, color="0.8", linewidth=0.8, zorder=0)
    axes.figure.savefig(FIGURE, dpi=160, bbox_inches="tight")


def with_table(page: str, name: str, lines: list[str]) -> str:
    """Return a page with one of its tables replaced."""
    found = re.compile(rf"(<!-- plane: {name} -->\n).*?(<!-- end -->)", re.DOTALL)
    if not found.search(page):
        raise ValueError(f"the page has no place for {name}")
    return found.sub(lambda m: m.group(1) + "\n".join(lines) + "\n" + m.group(2), page)


def main(folder: Path) -> None:
    """Compute the curves, draw them and write the tables."""
    curves, refused = curves_of(events(sections(folder)), folder)
    page = PAGE.read_text(encoding="utf-8")
    page = with_table(page, "curves", curve_table(curves))
    page = with_table(page, "special", special_table(curves))
    page = with_table(page, "refused", [f"* {line}" for line in refused] or ["None."])
    page = with_table(page, "regions", region_table(folder))
    PAGE.write_text(page, encoding="utf-8")
    draw(curves)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        Path(sys.argv[1]).mkdir(parents=True, exist_ok=True)
        main(Path(sys.argv[1]))
    else:
        with tempfile.TemporaryDirectory() as temporary:
            main(Path(temporary))
