"""Curves of the LuGre plane against runs in one parameter.

At points of every curve that ``docs/gallery/lugre_plane.py FOLDER`` has left in its folder a short branch is
continued in one of the parameters, the other one fixed, from an orbit next to the curve; the event that it
locates is compared with the curve. The two have no equation of the bifurcation in common: a run looks at
multipliers of orbits (or at the slope of the parameter), the curve solves a bordered system.

    python docs/gallery/lugre_plane.py plane
    python benchmarks/lugre_curves.py plane
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import contfric as cf
from contfric.continuation.half_branch import first_point
from contfric.continuation.points import settings_of
from contfric.continuation.singular_points.switching import null_vector
from contfric.orbit.solve import refine

#: Points of each curve that are compared, and points of each side of a run.
COUNT, POINTS = 10, 14
#: Distances of the start from the curve: of a fold along its null vector, else in widths of the range.
APART = (1e-3, 1e-4, 1e-5)
#: What is found farther than this from the curve is another event.
NEAR = 1e-6


def starts(
    orbit: cf.Orbit, name: str, bounds: tuple[float, float], fold: bool
) -> Iterator[cf.Orbit]:
    """Yield orbits next to a bifurcation to start a run from."""
    active, width = orbit.model.index_of(name), bounds[1] - bounds[0]
    for distance in APART:
        for sign in (1.0, -1.0):
            if fold:
                phi = null_vector(orbit)
                moved = replace(orbit, joints=orbit.joints + sign * distance * phi)
                settings = settings_of(moved, name, bounds, None, True, POINTS)
                point = first_point(moved, settings, phi, 0.0)
                if point is not None:
                    yield refine(point.orbit(orbit, active), damped=False)
                continue
            vector = orbit.vector.copy()
            vector[active] += sign * distance * width
            yield refine(replace(orbit, vector=vector), damped=False)


def difference(curve: cf.Curve, k: int, bounds: dict[str, tuple[float, float]]) -> float:
    """Return by how much a run in one parameter differs from a point of a curve; nan if it finds none."""
    widths = np.array([bounds[n][1] - bounds[n][0] for n in curve.parameters])
    along = np.abs(curve.values[k + 1] - curve.values[k - 1]) / widths
    name = curve.parameters[int(np.argmin(along))]  # that which crosses the curve most steeply
    known = curve[k].params[name]
    for start in starts(curve[k], name, bounds[name], curve.kind is cf.Kind.SN):
        low, high = bounds[name]
        if not start.converged or not low < start.params[name] < high:
            continue
        try:
            branch = cf.continue_orbit(start, name, bounds[name], max_points=POINTS)
        except cf.ContfricError:
            continue
        found = [b.params[name] - known for b in branch.bifurcations if b.kind is curve.kind]
        nearest = min(found, key=abs, default=np.inf)
        if abs(nearest) < NEAR:
            return float(nearest)
    return float("nan")


def main(folder: Path, pattern: str) -> None:
    """Print a row for each curve whose file matches a pattern."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "docs" / "gallery"))
    from lugre_plane import RANGES

    print("| curve | orbits | points | compared | largest difference |\n|---|---|---|---|---|")
    worst = 0.0
    for file in sorted(folder.glob(pattern)):
        curve = cf.load(file)
        places = np.unique(np.linspace(1, len(curve) - 2, COUNT + 2).astype(int)[1:-1])
        off = np.array([difference(curve, int(k), RANGES) for k in places])
        missing = [f"({v[0]:.6f}, {v[1]:.6f})" for v in curve.values[places[np.isnan(off)]]]
        largest = float(np.nanmax(np.abs(off), initial=0.0))
        worst = max(worst, largest)
        kind = "symmetric" if curve.symmetric else "asymmetric"
        print(
            f"| {file.stem} | {kind} | {len(curve)} | {np.sum(np.isfinite(off))} of {len(off)} "
            f"| {largest:.1e} | {' '.join(missing)}",
            flush=True,
        )
    print(f"\nlargest difference: {worst:.1e}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else "curve-*.npz")
