"""How far the located events of the LuGre oscillator depend on tolerance, phase of the cut and step.

Every event of a saved diagram is located again, with orbits that are integrated at each tolerance and cut at
each phase: from an orbit a few points before it a short branch is continued over it.

    contfric run fig17 --out fig17
    python benchmarks/lugre_relocate.py fig17/diagram.npz

The rows say how far the values of an event lie apart, and how near its orbit comes to touching v = 0: there
multipliers change with the root of the parameter.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

import contfric as cf
from contfric.bvp.system import build_system
from contfric.models.reading.files import model_of
from contfric.orbit.solve import refine

#: What is varied: tolerance of the integration; phase of the cut with the largest step.
TOLERANCES = (1e-11, 1e-12, 1e-13)
CUTS = ((0.7, 0.001), (1.9, 0.0007))
#: Points of the diagram between the start of a short branch and its event.
BEHIND = 3
#: Points of each side of a short branch (the first steps are short), and of a second attempt.
POINTS = (14, 60)
#: An event that was asked for lies within this of where it is known (fold and doubling may be 4e-7 apart).
NEAR = 1e-6


@dataclass(frozen=True)
class Place:
    """An event of a diagram with an orbit before it on its branch."""

    event: cf.Bifurcation
    start: cf.Orbit


def with_tolerance(model: cf.Model, tolerance: float) -> cf.Model:
    """Return a declared model that is integrated to another tolerance."""
    return model_of(replace(model.description, tolerance=tolerance).text)


def moved_cut(orbit: cf.Orbit, model: cf.Model, phase: float) -> cf.Orbit:
    """Return an orbit cut at another phase of the excitation, solved with another model."""
    params = orbit.params
    ahead = (phase - params["phi0"]) / params["Omega"]
    vector = model.vector({**params, "phi0": phase})
    none, nothing = np.empty(0, dtype=np.int64), np.empty((0, 0))
    joints = orbit.joints.copy()
    joints[:, 0] += ahead
    if ahead != 0.0:
        for k, joint in enumerate(orbit.joints):
            model.flow.flow(
                0, joint[0], joint[1:].copy(), ahead, vector, none, joints[k, 1:], nothing
            )
    system = build_system(
        model, orbit.system.itinerary, orbit.system.periods, half=orbit.system.half
    )
    return refine(cf.Orbit(system, joints, vector, 0.0), damped=False)


def places(diagram: cf.Diagram) -> Iterator[Place]:
    """Yield every event once, with the orbit to start from."""
    for branch in diagram.branches:
        if branch.mirrored:
            continue
        values = branch.params[diagram.parameter]
        for event in branch.bifurcations:
            here = event.orbit.joints
            if branch.joints.shape[1:] != here.shape:
                continue  # a branch point is located on its symmetric orbits
            gaps = np.abs(branch.joints - here).max(axis=(1, 2))
            k = int(np.argmin(gaps + np.abs(values - event.params[diagram.parameter])))
            behind = k - BEHIND if k >= BEHIND else k + BEHIND
            yield Place(event, branch[min(behind, len(branch) - 1)])


def located(place: Place, model: cf.Model, phase: float, step: float, diagram: cf.Diagram) -> float:
    """Return where an event is with another tolerance, phase and step; nan if it is not found."""
    name = diagram.parameter
    start = moved_cut(place.start, model, phase)
    if not start.converged:
        return float("nan")
    known = place.event.params[name]
    for points in POINTS:
        branch = cf.continue_orbit(start, name, diagram.range, max_step=step, max_points=points)
        found = [b.params[name] for b in branch.bifurcations if b.kind is place.event.kind]
        nearest = min(found, key=lambda value: abs(value - known), default=float("nan"))
        if abs(nearest - known) < NEAR:
            return nearest
    return float("nan")


def touch(orbit: cf.Orbit) -> float:
    """Return the least |v| at which the velocity is stationary: how near the orbit is to touch v = 0."""
    whole = orbit.as_whole()
    model = whole.model
    c = [o.name for o in model.observables].index("v")
    times, values = np.empty(512), np.empty(512)
    start = whole.joints[0]
    found = model.flow.stationary(
        0, c, start[0], start[1:].copy(), whole.period, whole.vector, times, values
    )
    return float(np.min(np.abs(values[:found])))


def main(path: str, only: str, tolerances: tuple[float, ...]) -> None:
    """Print a row for each event."""
    diagram = cf.load(path)
    base = diagram.branches[0].model
    cases = [(t, phase, step) for t in tolerances for phase, step in CUTS]
    models = {tolerance: with_tolerance(base, tolerance) for tolerance in tolerances}
    heads = " | ".join(f"{tolerance:.0e}, {phase}" for tolerance, phase, _ in cases)
    print(f"| event | {diagram.parameter} | least speed | largest difference | {heads} |")
    print("|---|---|---|---|" + "---|" * len(cases))
    worst = 0.0
    for place in places(diagram):
        known = place.event.params[diagram.parameter]
        if only and only not in f"{place.event.label} {known:.9f}":
            continue
        values = np.array([located(place, models[t], f, h, diagram) for t, f, h in cases])
        apart = float(np.nanmax(values) - np.nanmin(values))
        worst = max(worst, apart)
        shown = " | ".join(f"{value - known:+.1e}" for value in values)
        near = touch(place.event.orbit)
        label = f"{place.event.kind.value}{'' if place.event.orbit.symmetric else ', asymmetric'}"
        print(f"| {label} | {known:.13f} | {near:.1e} | {apart:.1e} | {shown} |", flush=True)
    print(f"\nlargest difference: {worst:.1e}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("diagram", help="diagram.npz of a run of fig17 or fig18")
    parser.add_argument("--only", default="", help="part of the label and value of an event")
    parser.add_argument("--tolerances", type=float, nargs="+", default=TOLERANCES)
    arguments = parser.parse_args()
    main(arguments.diagram, arguments.only, tuple(arguments.tolerances))
