"""Sweeps and basins next to what one would write by hand; ``python benchmarks/everyday.py`` writes the page.

Coulomb's oscillator, simulated by ``scipy.integrate.solve_ivp`` (DOP853, one call for each slide, terminal
events at stops; releases from a stick by their formula) in a loop over values or starts. Basins by hand are
found by recurrences, as Attractors.jl and pyBasin do: the plane is cut into cells, and a solution that has
come into cells that it had visited before, so many times in a row, has found an attractor; one that meets
cells of an attractor that many times has converged to it. The same recurrences are also run over the
solutions of contfric, which tells the integrator and the method apart.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from origin import origin
from peers.oscillator import first_release
from scipy.integrate import solve_ivp

import contfric as cf

PAGE = Path(__file__).resolve().parents[1] / "docs" / "benchmarks-everyday.md"
S, S0, OMEGA = 0.32, 0.4, 0.541
#: Tolerance of the loop; periods of transient and of what is kept in sweeps, and values of the parameter.
RTOL, TRANSIENT, KEPT, VALUES = 1e-9, 40, 10, 5
#: Cells in each direction over these ranges, and visits in a row: a tenth of the cells of a usual grid of
#: Attractors.jl, and its default number of visits.
CELLS, RANGES, VISITS, LONGEST = 100, ((-3.0, 3.0), (-2.0, 2.0)), 10, 1000
#: Starts in each direction by scipy, by recurrences over solutions of contfric, and by contfric.
STARTS = {"scipy": 6, "recurrences": 12, "contfric": 200}

Point = tuple[float, float]


def periods_of(x: float, v: float, omega: float) -> Iterator[tuple[Point, list[float]]]:
    """Yield the state at the end of each period, and the displacements at its stops, by scipy."""
    t, period = 0.0, 2.0 * np.pi / omega
    sign = int(np.sign(v))
    for k in range(1, 10**6):
        end, stops = k * period, []
        while t < end:
            if sign == 0:  # at rest: held until the load reaches a limit
                load = x - np.cos(omega * t)
                if abs(load) < S0:
                    t = min(first_release(t, x, (omega, S, S0)), end)
                    load = x - np.cos(omega * t)
                    if t == end:
                        break
                sign = -int(np.sign(load))

            def rate(t: float, y: np.ndarray, s: int = sign) -> tuple[float, float]:
                return y[1], np.cos(omega * t) - y[0] - s * S

            def stop(t: float, y: np.ndarray) -> float:
                return float(y[1])

            stop.terminal, stop.direction = True, -sign  # type: ignore[attr-defined]
            found = solve_ivp(
                rate, (t, end), (x, v), method="DOP853", rtol=RTOL, atol=RTOL, events=stop
            )
            t, (x, v) = float(found.t[-1]), found.y[:, -1].tolist()
            if found.status == 1:
                v, sign = 0.0, 0
                stops.append(x)
        yield (x, v), stops


def solutions_of(x: float, v: float, omega: float) -> Iterator[tuple[Point, list[float]]]:
    """Yield the same by a simulation of contfric, without the stops."""
    params = {"Omega": omega, "S": S, "S0": S0}
    for first in range(0, LONGEST, 50):
        found = cf.poincare("coulomb", params, section=0.0, periods=50, transient=0, state=(x, v))
        states = found.states if first == 0 else found.states[1:]
        x, v = states[-1].tolist()
        for state in states[first == 0 :].tolist():
            yield (state[0], state[1]), []


def recurrences(starts: list[Point], periods: Callable[..., Any]) -> list[int]:
    """Label starts by the attractor whose cells they come to, numbered as they are found."""
    cells: dict[tuple[int, ...], int] = {}
    labels: list[int] = []
    for x, v in starts:
        visited, again, met, label = set(), 0, 0, -1
        for state, _ in islice(periods(x, v, OMEGA), LONGEST):
            cell = tuple(
                int((value - low) / (high - low) * CELLS)
                for value, (low, high) in zip(state, RANGES, strict=True)
            )
            met = met + 1 if cell in cells else 0
            again = again + 1 if cell in visited else 0
            visited.add(cell)
            if met == VISITS:
                label = cells[cell]
            elif again == VISITS:
                label = max(cells.values(), default=-1) + 1
                cells[cell] = label
            if label >= 0:
                break
        labels.append(label)
    return labels


def grid(count: int) -> dict[str, np.ndarray]:
    """Return starts on a grid."""
    return {"x": np.linspace(-2.0, 2.0, count), "v": np.linspace(-1.5, 1.5, count)}


def spent(call: Callable[[], Any]) -> tuple[float, Any]:
    """Return processor time and result of a call, which was warm before."""
    start = time.process_time()
    found = call()
    return time.process_time() - start, found


def sweeps() -> Iterator[str]:
    """Yield rows of the table of sweeps: milliseconds a period, and how far stops are from solved orbits."""
    values, fixed = np.linspace(0.56, 0.6, VALUES), {"S": S, "S0": S0}
    exact = {w: cf.find_orbit("coulomb", {"Omega": w, **fixed}).x_max for w in values.tolist()}

    def loop() -> dict[float, list[float]]:
        found, state = {}, (1.0, 0.0)
        for omega in values.tolist():
            turns = list(islice(periods_of(*state, omega), TRANSIENT + KEPT))
            state, found[omega] = turns[-1][0], [x for _, stops in turns[TRANSIENT:] for x in stops]
        return found

    def compiled() -> cf.Sweep:
        times = {"transient": TRANSIENT, "periods": KEPT, "direction": "up"}
        return cf.sweep("coulomb", "Omega", np.linspace(0.56, 0.6, 400), fixed, **times)

    work, by_hand = spent(loop)
    error = max(abs(max(stops) - exact[w]) for w, stops in by_hand.items())
    yield f"| loop with scipy | {work / VALUES / (TRANSIENT + KEPT) * 1e3:.3g} | {error:.0e} |"
    compiled()
    work, swept = spent(compiled)
    each = work / len(swept.values) / (TRANSIENT + KEPT)
    places = np.searchsorted(swept.values, values[[0, -1]] - 1e-12)
    stops = [swept.up.states[swept.up.index == k, 0].max() for k in places.tolist()]
    error = max(abs(x - exact[w]) for x, w in zip(stops, values[[0, -1]].tolist(), strict=True))
    yield f"| `cf.sweep` | {each * 1e3:.3g} | {error:.0e} |"


def basins() -> Iterator[str]:
    """Yield rows of the table of basins: milliseconds a start, and starts with a label of their own."""
    params = {"Omega": OMEGA, "S": S, "S0": S0}

    def labelled(count: int) -> cf.Basins:
        return cf.basins("coulomb", grid(count), params)

    labelled(5)
    ways = {"scipy": periods_of, "recurrences": solutions_of}
    names = {
        "scipy": "recurrences, loop with scipy",
        "recurrences": "recurrences over `cf.poincare`",
    }
    for name, periods in ways.items():
        axes = grid(STARTS[name])
        starts = [(x, v) for x in axes["x"].tolist() for v in axes["v"].tolist()]
        work, labels = spent(lambda s=starts, p=periods: recurrences(s, p))
        exact = labelled(STARTS[name]).labels.ravel().tolist()
        pairs = Counter(zip(labels, exact, strict=True))
        best = {label: max(n for (k, _), n in pairs.items() if k == label) for label in set(labels)}
        wrong = len(labels) - sum(best[label] for label in best if label >= 0)
        yield (
            f"| {names[name]} | {len(starts)} | {work / len(starts) * 1e3:.3g} | "
            f"{len(set(labels) - {-1})} | {wrong} |"
        )
    work, found = spent(lambda: labelled(STARTS["contfric"]))
    count = found.labels.size
    yield f"| `cf.basins` | {count} | {work / count * 1e3:.3g} | {len(found.orbits)} | - |"


def main() -> None:
    """Measure, and write the page."""
    text = PAGE_TEXT.format(
        origin=origin(),
        sweeps="\n".join(sweeps()),
        basins="\n".join(basins()),
        visits=VISITS,
        cells=CELLS,
    )
    PAGE.write_text(text, encoding="utf-8")
    print(text)


PAGE_TEXT = """# Sweeps and basins next to a loop by hand

Written by `python benchmarks/everyday.py`: {origin}.
Times are of the processor, on one core.

`coulomb` at S = 0.32, S0 = 0.4. By hand: `scipy.integrate.solve_ivp` (DOP853, tolerance 1e-9), one call for
each slide with an event at its stop.

A sweep over Omega from 0.56 to 0.6, with 40 periods of transient and 10 that are kept. The error is that
of the largest stop, against the solved orbit:

| how | ms a period | error |
|---|---|---|
{sweeps}

`cf.sweep` ends a simulation that repeats itself, so that most of the periods asked for need not be simulated.

Basins at Omega = 0.541, starts on a square grid. Recurrences, the method of Attractors.jl and pyBasin, on
{cells} x {cells} cells of the plane once a period, with {visits} visits in a row. pyBasin itself was not
measured, as it needs Python 3.12. Labels are compared with those of `cf.basins`,
which solves each orbit that it finds:

| how | starts | ms a start | attractors | other labels |
|---|---|---|---|---|
{basins}

Recurrences take cells next to an attractor, in which solutions linger, for attractors of their own. A finer
grid has fewer of them and takes longer.
"""

if __name__ == "__main__":
    main()
