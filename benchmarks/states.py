"""Time and error against the number of states: a chain with one friction contact; docs/benchmarks-states.md.

``python benchmarks/states.py`` simulates each chain by contfric's closed form, by scipy's DOP853 with events
and, where it is installed, by heyoka, in one process and in turns. Errors are those of the last state against
matrix exponentials (scipy.linalg.expm) with events by Brent's method.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from origin import origin
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

import contfric as cf

STATES = (2, 4, 8, 12, 24, 48, 64)
OMEGA, FORCE, KINETIC, STATIC, DAMPING = 0.4, 0.6, 0.2, 0.25, 0.03
PERIODS, ROUNDS, WANTED = 4, 3, 1e-9
PAGE = Path(__file__).resolve().parents[1] / "docs" / "benchmarks-states.md"
END = 2.0 * np.pi / OMEGA * PERIODS
#: A step of a mode: (mode, t, y) -> the time and state of its next event, at most END.
Step = Callable[[int, float, np.ndarray], tuple[float, np.ndarray]]


def stiffness_of(n: int) -> np.ndarray:
    """Return the stiffness of a chain that is held at its first end."""
    found = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    found[-1, -1] = 1.0
    return found


def follow(stiffness: np.ndarray, step: Step) -> np.ndarray:
    """Return the state at the end; modes are the direction of the slide of the first mass, 0 if it sticks."""
    n = len(stiffness)
    t, y, mode = 0.0, np.concatenate([np.ones(n), np.zeros(n)]), 0
    while True:
        load = float(stiffness[0] @ y[:n] + DAMPING * y[n]) - (FORCE * np.cos(OMEGA * t)) * (n == 1)
        if mode or abs(load) >= STATIC * (1.0 - 1e-12):
            mode = 0 if mode and abs(load) < STATIC else -int(np.sign(load))
        t, y = step(mode, t, y)
        if t >= END:
            return y
        y[n] = 0.0


def matrix_of(stiffness: np.ndarray, mode: int) -> np.ndarray:
    """Return the matrix of the states with cos, sin and 1."""
    n = len(stiffness)
    found = np.zeros((2 * n + 3, 2 * n + 3))
    found[:n, n : 2 * n] = np.eye(n)
    found[n : 2 * n, :n], found[n : 2 * n, n : 2 * n] = -stiffness, -DAMPING * np.eye(n)
    found[2 * n - 1, 2 * n] = FORCE
    found[n, -1] = -mode * KINETIC
    found[2 * n, 2 * n + 1], found[2 * n + 1, 2 * n] = -OMEGA, OMEGA
    if mode == 0:
        found[n] = 0.0
    return found


def height(stiffness: np.ndarray, mode: int, t: float, y: np.ndarray) -> float:
    """Return what is positive until the mode ends."""
    n = len(stiffness)
    if mode:
        return float(mode * y[n])
    return STATIC - abs(float(stiffness[0] @ y[:n]) - FORCE * np.cos(OMEGA * t) * (n == 1))


def reference(stiffness: np.ndarray) -> np.ndarray:
    """Return the state at the end by matrix exponentials."""
    n, short = len(stiffness), 0.05
    matrices = {mode: matrix_of(stiffness, mode) for mode in (-1, 0, 1)}
    steps = {mode: expm(matrix * short) for mode, matrix in matrices.items()}

    def step(mode: int, t: float, y: np.ndarray) -> tuple[float, np.ndarray]:
        z = np.concatenate([y, [np.cos(OMEGA * t), np.sin(OMEGA * t), 1.0]])
        begun = False
        while True:
            after = steps[mode] @ z
            left = height(stiffness, mode, t + short, after)
            if ((begun or mode == 0) and left < 0.0) or t + short >= END:

                def at(d: float, z: np.ndarray = z, t: float = t) -> float:
                    moved = expm(matrices[mode] * d) @ z
                    return height(stiffness, mode, t + d, moved)

                over = left < 0.0 and (begun or mode == 0)
                d = brentq(at, 0.0, short, xtol=1e-15) if over else END - t
                d = min(d, END - t)
                return t + d, (expm(matrices[mode] * d) @ z)[: 2 * n]
            begun, t, z = begun or left > 0.0, t + short, after

    return follow(stiffness, step)


def by_scipy(stiffness: np.ndarray, tolerance: float) -> np.ndarray:
    """Return the state at the end by DOP853 with events."""
    n = len(stiffness)

    def step(mode: int, t: float, y: np.ndarray) -> tuple[float, np.ndarray]:
        def rates(t: float, y: np.ndarray) -> np.ndarray:
            a = -stiffness @ y[:n] - DAMPING * y[n:]
            a[-1] += FORCE * np.cos(OMEGA * t)
            a[0] = a[0] - mode * KINETIC if mode else 0.0
            return np.concatenate([y[n:], a])

        def ends(t: float, y: np.ndarray) -> float:
            return height(stiffness, mode, t, y)

        ends.terminal, ends.direction = True, -1  # type: ignore[attr-defined]
        found = solve_ivp(rates, (t, END), y, "DOP853", events=ends, rtol=tolerance, atol=tolerance)
        return float(found.t[-1]), found.y[:, -1].copy()

    return follow(stiffness, step)


def heyoka_of(stiffness: np.ndarray) -> Callable[[float], np.ndarray]:
    """Return the same by heyoka; its integrators are compiled here."""
    import heyoka as hy

    n, compiled = len(stiffness), {}
    q, v = hy.make_vars(*[f"q{i}" for i in range(n)]), hy.make_vars(*[f"v{i}" for i in range(n)])
    q, v = (list(x) if isinstance(x, (list, tuple)) else [x] for x in (q, v))

    def integrator(mode: int, tolerance: float) -> Any:
        pulls = [
            hy.sum([-float(k) * q[j] for j, k in enumerate(row) if k] + [-DAMPING * v[i]])
            for i, row in enumerate(stiffness)
        ]
        excitation = FORCE * hy.cos(OMEGA * hy.time)
        pulls[-1] = pulls[-1] + excitation
        load = hy.sum([float(k) * q[j] for j, k in enumerate(stiffness[0]) if k])
        load = load - excitation if n == 1 else load
        pulls[0] = pulls[0] - mode * KINETIC if mode else hy.expression(0.0)
        falls = {"direction": hy.event_direction.negative}
        ends = [mode * v[0]] if mode else [STATIC - load, STATIC + load]
        return hy.taylor_adaptive(
            [*zip(q, v, strict=True), *zip(v, pulls, strict=True)],
            [0.0] * (2 * n),
            tol=tolerance,
            t_events=[hy.t_event(end, **falls) for end in ends],
            compact_mode=n > 6,
        )

    def run(tolerance: float) -> np.ndarray:
        def step(mode: int, t: float, y: np.ndarray) -> tuple[float, np.ndarray]:
            if (mode, tolerance) not in compiled:
                compiled[mode, tolerance] = integrator(mode, tolerance)
            own = compiled[mode, tolerance]
            own.reset_cooldowns()
            own.time, own.state[:] = t, y
            own.propagate_until(END)
            return float(own.time), own.state.copy()

        return follow(stiffness, step)

    return run


def chain(n: int) -> cf.Model:
    """Return the chain as a model."""
    rubs = {"kind": "friction", "velocity": "v1", "kinetic": KINETIC, "static": STATIC}
    return cf.Mechanism(
        np.eye(n),
        DAMPING * np.eye(n),
        stiffness_of(n),
        contacts={"pad": rubs},
        force={f"q{n}": "F*cos(w*t)"},
        parameters={"w": OMEGA, "F": FORCE},
        period="2*pi/w",
        name=f"chain-{n}",
    )


def least(calls: dict[str, Callable[[], Any]]) -> dict[str, float]:
    """Return the least milliseconds of each call, in turns."""
    found = dict.fromkeys(calls, np.inf)
    for _ in range(ROUNDS):
        for name, call in calls.items():
            start = time.perf_counter()
            call()
            found[name] = min(found[name], 1e3 * (time.perf_counter() - start))
    return found


def first_good(run: Callable[[float], np.ndarray], exact: np.ndarray) -> tuple[float, float]:
    """Return the loosest tolerance whose error is the one wanted, and that error."""
    for tolerance in 10.0 ** -np.arange(7.0, 14.0):
        error = float(np.max(np.abs(run(tolerance) - exact)))
        if error <= WANTED:
            break
    return float(tolerance), error


def row_of(size: int) -> str:
    """Measure one chain."""
    n = size // 2
    stiffness, model = stiffness_of(n), chain(n)
    exact = reference(stiffness)
    start = np.concatenate([np.ones(n), np.zeros(n)])

    def ours() -> Any:
        return cf.simulate(model, {}, state=start, periods=PERIODS)

    trajectory = ours()
    runs = {"scipy": lambda tolerance: by_scipy(stiffness, tolerance)}
    with contextlib.suppress(ImportError):
        runs["heyoka"] = heyoka_of(stiffness)
    good = {name: first_good(run, exact) for name, run in runs.items()}
    calls: dict[str, Callable[[], Any]] = {"contfric": ours}
    for name, run in runs.items():
        calls[name] = lambda run=run, name=name: run(good[name][0])
    took = least(calls)
    error = float(np.max(np.abs(np.asarray(trajectory.last[2]) - exact)))
    cells = [str(size), str(len(trajectory)), f"{took['contfric']:.2f}", f"{error:.0e}"]
    for name in ("scipy", "heyoka"):
        cells += [f"{took[name]:.2f}", f"{good[name][1]:.0e}"] if name in took else ["-", "-"]
    return "| " + " | ".join(cells) + f" | {took['scipy'] / took['contfric']:.0f} |"


def main() -> None:
    """Measure and write the page."""
    began = time.perf_counter()
    rows = [row_of(size) for size in STATES]
    square = np.random.default_rng(1).normal(size=(200, 200))
    yard = least({"yard": lambda: np.linalg.eigvals(square)})["yard"]
    lines = [
        "# Number of states",
        "",
        f"Written by `make bench` (`benchmarks/states.py`, {time.perf_counter() - began:.0f} s): {origin()}; "
        f"`eigvals` of 200 rows {yard:.0f} ms.",
        "",
        "A chain of masses on springs, forced at its free end; the first mass rubs (S = 0.2, S0 = 0.25). "
        f"{PERIODS} periods of the excitation with every stick and slip, no derivatives. Milliseconds, the "
        f"least of {ROUNDS} rounds in turns, in one process; the error is that of the last state, against "
        "matrix exponentials with events by Brent's method. scipy (DOP853 with events) and heyoka have the "
        f"loosest tolerance whose error is at most {WANTED:.0e}, and are compiled or warm before; a dash: "
        "not installed. contfric has no tolerance here.",
        "",
        "| states | events | contfric | error | scipy | error | heyoka | error | scipy over contfric |",
        "|---|---|---|---|---|---|---|---|---|",
        *rows,
        "",
        "heyoka compiles each mode of each size for itself (not counted), and needs the modes typed as the "
        "script does; contfric's simulation works from tables, and its first roots are certified. Errors of "
        "contfric are rounding, amplified by the events.",
    ]
    _, heading, others = PAGE.read_text(encoding="utf-8").partition(
        "\n## "
    )  # parts of other scripts
    PAGE.write_text("\n".join([*lines, heading + others]).rstrip() + "\n", encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
