"""Located events of the LuGre oscillator against brute-force simulation on both sides.

For every event of a diagram the orbits next to it on both sides are disturbed a little, and the disturbance
is followed by the stroboscopic map alone (no Jacobian, no Newton) for up to 60 turns, its size set back after
each. Its rate a period is compared with the largest multiplier there.

    python benchmarks/lugre_events.py DIAGRAM.npz
"""

from __future__ import annotations

import sys

import numpy as np

import contfric as cf

#: Turns followed at most.
TURNS = 60
#: First size of the disturbance: far above rounding and far below the scale of kinks.
SIZE = 1e-9


def measured_rate(orbit: cf.Orbit) -> tuple[float, int]:
    """Return the growth a period of a small disturbance over the last turns, and the number of turns."""
    flow, none = orbit.model.flow, np.empty(0, dtype=np.int64)
    nothing, period = np.empty((0, 0)), orbit.period
    start, t = orbit.joints[0, 1:].copy(), float(orbit.joints[0, 0])
    mode = [m.name for m in orbit.model.modes].index(orbit.itinerary[0][0])

    def turn(y: np.ndarray) -> np.ndarray:
        out = np.empty_like(y)
        flow.flow(mode, t, y, period, orbit.vector, none, out, nothing)
        return out

    fixed, rates = turn(start), []
    size = np.array([SIZE, SIZE, SIZE * 1e-3])
    gap = size.copy()
    for count in range(TURNS):
        ahead = turn(start + gap) - fixed
        rates.append(float(np.linalg.norm(ahead) / np.linalg.norm(gap)))
        gap = ahead / np.linalg.norm(ahead) * SIZE  # the direction is kept, not the size
        if count > 10 and abs(rates[-1] / rates[-2] - 1.0) < 1e-6:
            break
    tail = rates[len(rates) // 2 :]
    return float(np.exp(np.mean(np.log(tail)))), len(rates)


def main(path: str) -> None:
    """Print a row for each side of each event."""
    diagram = cf.load(path)
    name = diagram.parameter
    print(f"| event | {name} | next to it | largest multiplier | measured rate |")
    print("|---|---|---|---|---|")
    for branch in diagram.branches:
        if branch.mirrored:
            continue
        values = branch.params[name]
        for event in branch.bifurcations:
            here = event.orbit.joints
            shapes = branch.joints.shape[1:] == here.shape
            if not shapes:
                continue
            gaps = np.abs(branch.joints - here).max(axis=(1, 2)) + np.abs(
                values - event.params[name]
            )
            k = int(np.argmin(gaps))
            for j in (k - 1, k + 1):
                if 0 <= j < len(branch):
                    orbit = branch[j]
                    whole = orbit.as_whole() if orbit.system.half else orbit
                    rate, turns = measured_rate(whole)
                    largest = float(np.abs(orbit.multipliers).max())
                    off = values[j] - event.params[name]
                    agree = (rate > 1.0) == (largest > 1.0)
                    print(
                        f"| {event.label} | {event.params[name]:.12f} | {off:+.1e} | {largest:.6f} "
                        f"| {rate:.6f} ({turns}) {'' if agree else 'DISAGREES'}|",
                        flush=True,
                    )


if __name__ == "__main__":
    main(sys.argv[1])
