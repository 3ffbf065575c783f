"""Random branches and diagrams, each branch retraced with a tenth of the step.

``python benchmarks/stress/continuation.py --count 100 --seed 0 --out continuation.json``

A branch that jumps to another one, turns back, or passes an event unseen is not the one that small steps
follow: its ends, its events, or the distance of its points to the retraced one tell.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable

import numpy as np
from chain import FloatArray
from events import MOST_BRANCHES, scene
from report import Report, Tally, command_line
from scenes import refusal, strictly, time_limit

import contfric as cf
from contfric.atlas.matching import identity
from contfric.continuation.points import LARGEST_STEP

WHAT = "Branches and diagrams of random orbits, retraced with a tenth of the largest step."
#: Longest that one case may take (s), and most points of a retraced side.
LIMIT, MOST_POINTS = 120.0, 200_000
#: Points of one branch that are compared: each with every chord of the finer one.
MOST_COMPARED = 300
#: Ratio of the steps.
FINER = 10.0
#: Events are at one place if their parameters agree to what both say that they are accurate to, or to
#: this, relative to 1 + the parameter: what two brackets to rounding differ by. SINGULAR ends (two
#: conditions at once, a margin that vanishes quadratically) are good to the root of rounding, and
#: UNBOUNDED ones stand where a step has passed a size.
SAME, LOOSE = 1e-9, {"SINGULAR": 1e-6, "UNBOUNDED": 1e-6}
#: A branch meets its parent at a vertex, where its equations are singular and the state is good to the
#: root of rounding, times the curvature; everywhere else points are solved. An end at an event is good to
#: what the event says that it is accurate to, if that lies between the two: where its equations are singular,
#: too, the state is known to the root of rounding, though a bound of the parameter may be far above that.
AT_VERTEX, SOLVED = 1e-4, 1e-8
#: Ends that say that something went wrong, not that something happened. SINGULAR is no failure where the
#: orbits are degenerate; it is counted.
FAILURES = frozenset({"STEP", "BROKEN", "POINTS", "START", "INTERRUPTED"})
#: Shortest branch that is retraced, in largest steps of the finer trace: below, it is one step long.
SHORT = 3.0

#: Least range of a branch's parameter, where it hardly changes along the branch (a family at Omega = 1/2):
#: the rounding of the parameter, 1e-14, is then no more than what a point is good to.
LEAST_RANGE = 1e-14 / SOLVED

#: Kind of an event or end, where it is, and the accuracy that it states.
Placed = tuple[str, float, float]
Progress = Callable[[str], None] | None


def run(count: int, seed: int, *, progress: Progress = None) -> Report:
    """Continue, explore and retrace from random starts."""
    began, tally = time.perf_counter(), Tally()
    for index in range(count):
        tally.index = index
        start = time.perf_counter()
        try:
            with strictly(), time_limit(LIMIT):
                found = scene(tally, seed, index)
                if found is not None:
                    one_case(tally, *found)
        except (
            Exception
        ) as error:  # whatever it is, it is a failure of this case and not of the run
            tally.check("no exception, in time", False, repr(error))
        else:
            tally.check("no exception, in time", True)
        tally.largest("seconds of one case", time.perf_counter() - start)
        if progress is not None and index % 10 == 9:
            progress(f"continuation: {index + 1} of {count}, {len(tally.failed)} failures")
    return tally.report("continuation", WHAT, count, seed, time.perf_counter() - began)


def one_case(tally: Tally, orbit: cf.Orbit, parameter: str, bounds: tuple[float, float]) -> None:
    """Continue an orbit, explore from it, and retrace every branch."""
    where = f"{orbit.params}, {parameter} in ({bounds[0]!r}, {bounds[1]!r})"
    try:
        branch = cf.continue_orbit(orbit, parameter, bounds)
        diagram = cf.explore(orbit, parameter, bounds, bridges=False, max_branches=MOST_BRANCHES)
    except cf.ContfricError as error:
        tally.met(refusal(error))
        return
    ends(tally, branch, where)
    retraced(tally, branch, orbit, bounds, where)
    explored(tally, diagram, orbit, bounds, where)
    for k, other in enumerate(diagram.branches):
        if not other.mirrored:
            here = f"{where}: branch {k + 1}, {other.name}"
            ends(tally, other, here)
            retraced(tally, other, other[len(other) // 2], bounds, here)


def ends(tally: Tally, branch: cf.Branch, where: str) -> None:
    """Every end has its reason; one that names an event has it."""
    for end in branch.ends:
        name = end.reason.name
        tally.met(f"end: {name}")
        tally.check("end has a reason", name not in FAILURES and bool(str(end)), f"{where}: {name}")
        if name in {"CS", "SS", "AS", "GS"}:
            event = end.bifurcation
            fine = event is not None and event.kind.value == name
            tally.check("end at an event has it", fine, f"{where}: {name}")


def explored(
    tally: Tally, diagram: cf.Diagram, orbit: cf.Orbit, bounds: tuple[float, float], where: str
) -> None:
    """The diagram with smaller steps: the same branches and the same events."""
    if not diagram.complete:
        tally.met("diagram with more branches than asked for, and says so")
        return
    step = LARGEST_STEP / FINER
    fine = cf.explore(
        orbit,
        diagram.parameter,
        bounds,
        bridges=False,
        max_step=step,
        max_branches=MOST_BRANCHES,
    )
    itineraries = [
        Counter((identity(b[0]), b.system.half, b.mirrored) for b in d.branches)
        for d in (diagram, fine)
    ]
    names = [sorted(b.name for b in d.branches if not b.mirrored) for d in (diagram, fine)]
    text = f"{where}: {names[0]}, with smaller steps {names[1]}"
    tally.check("diagram: the same branches", itineraries[0] == itineraries[1], text)
    differ = difference(*(_placed(d.bifurcations, d.parameter) for d in (diagram, fine)))
    tally.check("diagram: the same events", not differ, f"{where}: {differ}")
    for b in diagram.bifurcations:
        tally.met(f"event: {b.kind.value}{'' if b.located else ' (not located)'}")


def retraced(
    tally: Tally, branch: cf.Branch, start: cf.Orbit, bounds: tuple[float, float], where: str
) -> None:
    """One branch with a tenth of the step: the same ends, events and points."""
    step = LARGEST_STEP / FINER
    if len(branch) < 3 or branch.arc[-1] - branch.arc[0] < SHORT * step:
        tally.met("branch shorter than three small steps")
        return
    try:
        fine = cf.continue_orbit(
            start, branch.parameter, bounds, max_step=step, max_points=MOST_POINTS
        )
    except cf.ContfricError as error:
        tally.check("branch can be retraced", False, f"{where}: {error}")
        return
    differ = difference(_ends(branch), _ends(fine))
    tally.check("branch: the same ends", not differ, f"{where}: {differ}")
    differ = difference(*(_placed(b.bifurcations, branch.parameter) for b in (branch, fine)))
    tally.check("branch: the same events", not differ, f"{where}: {differ}")
    away, at = off(branch, fine)
    tally.check(
        "branch: points on the finer one",
        away <= 1.0,
        f"{where}: point {at}, {away:.3g} of a chord",
    )
    tally.largest("point off the finer branch, of the chord's height", away)
    tally.met("points compared", min(len(branch), MOST_COMPARED))


def _placed(events: Iterable[cf.Bifurcation], parameter: str) -> list[Placed]:
    return [(b.kind.value, b.params[parameter], b.accuracy) for b in events]


def _ends(branch: cf.Branch) -> list[Placed]:
    return [
        (
            end.reason.name,
            float(branch.values[k]),
            end.bifurcation.accuracy if end.bifurcation is not None else 0.0,
        )
        for end, k in zip(branch.ends, (0, -1), strict=True)
    ]


def difference(a: list[Placed], b: list[Placed]) -> str:
    """Return what is in one list and not at the same place in the other; empty if nothing."""
    left, missing = list(b), []
    for kind, value, accuracy in a:
        near = LOOSE.get(kind, SAME) * (1.0 + abs(value))
        same = [
            k
            for k, (other, there, other_accuracy) in enumerate(left)
            if other == kind and abs(there - value) <= max(near, accuracy + other_accuracy)
        ]
        if same:
            left.pop(same[0])
        else:
            missing.append(f"{kind} at {value!r}")
    gone = f"without {', '.join(missing)}" if missing else ""
    new = f"with {', '.join(f'{kind} at {value!r}' for kind, value, _ in left)}" if left else ""
    return "; ".join(text for text in (gone, new) if text)


def off(branch: cf.Branch, fine: cf.Branch) -> tuple[float, int]:
    """Return the largest distance of a point to the finer branch, and the index of the point.

    In units of the most by which a smooth curve leaves its chord: length times angle between
    neighbouring chords (8 times what a circle does), and what the point is good to, or the end of the finer
    branch where the chord is its first or last one.
    """
    width = 1.0 / max(float(np.ptp(fine.values)), LEAST_RANGE)
    a, b = _points(branch, width), _points(fine, width)
    chord = np.diff(b, axis=0)
    length = np.linalg.norm(chord, axis=1)
    keep = length > 0.0
    end_good = _of_ends(fine, int(np.count_nonzero(keep)))
    foot, chord, length = b[:-1][keep], chord[keep], length[keep]
    turn = _angles(chord, length)
    worst, at = 0.0, 0
    good = _good_to(branch)
    for k in np.unique(np.linspace(0, len(a) - 1, MOST_COMPARED).astype(int)).tolist():
        from_foot = a[k] - foot
        share = np.clip(np.sum(from_foot * chord, axis=1) / length**2, 0.0, 1.0)
        gap = np.linalg.norm(from_foot - share[:, None] * chord, axis=1)
        units = float(np.min(gap / (length * turn + np.maximum(good[k], end_good))))
        if units > worst:
            worst, at = units, k
    return worst, at


def _good_to(branch: cf.Branch) -> FloatArray:
    """Return what each point is good to; where the amplitude grows without bound the last one is free."""
    good = np.full(len(branch), SOLVED)
    for (reason, _, accuracy), k in zip(_ends(branch), (0, -1), strict=True):
        good[k] = max(SOLVED, min(accuracy, AT_VERTEX))
        if reason in ("BP", "PD"):
            good[k] = AT_VERTEX
        elif reason == "UNBOUNDED":
            good[k] = np.inf
    return good


def _of_ends(branch: cf.Branch, chords: int) -> FloatArray:
    """Return what the first and the last chord are good to, by the events at which they end; 0 for others."""
    good = np.zeros(chords)
    for (_, _, accuracy), k in zip(_ends(branch), (0, -1), strict=True):
        good[k] = max(good[k], min(accuracy, AT_VERTEX))
    return good


def _angles(chord: FloatArray, length: FloatArray) -> FloatArray:
    """Return the larger of the angles that each chord makes with its neighbours."""
    unit = chord / length[:, None]
    # by the difference of the units: an arc cosine has no digits at small angles
    between = np.linalg.norm(np.diff(unit, axis=0), axis=1)
    both = np.concatenate([[0.0], between, [0.0]])
    return np.asarray(np.maximum(both[:-1], both[1:]))


def _points(branch: cf.Branch, width: float) -> FloatArray:
    joints = branch.joints.reshape(len(branch), -1) / np.sqrt(branch.joints.shape[1])
    return np.column_stack([joints, branch.values * width])


if __name__ == "__main__":
    command_line(run, count=100)
