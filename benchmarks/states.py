"""Time and error against the number of states: structures with a friction contact; docs/benchmarks-states.md.

``python benchmarks/states.py`` simulates chains, and a stiff beam, by contfric's closed form, by scipy with
events and, where it is installed, by heyoka, in one process and in turns. Errors are those of the last state
against matrix exponentials (scipy.linalg.expm) with events by Brent's method.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from origin import origin
from scipy.integrate import solve_ivp
from scipy.linalg import eigh, expm
from scipy.optimize import brentq

import contfric as cf

#: States of the chains; elements of the beam, and its damping as a share of its stiffness.
STATES, ELEMENTS, BEAM_DAMPING = (2, 4, 8, 12, 24, 48, 64), 6, 0.02
OMEGA, FORCE, KINETIC, STATIC, DAMPING = 0.4, 0.6, 0.2, 0.25, 0.03
PERIODS, ROUNDS, WANTED = 4, 3, 1e-9
PAGE = Path(__file__).resolve().parents[1] / "docs" / "benchmarks-states.md"
END = 2.0 * np.pi / OMEGA * PERIODS
#: A step of a mode: (mode, t, y) -> the time and state of its next event, at most END.
Step = Callable[[int, float, np.ndarray], tuple[float, np.ndarray]]


@dataclass(frozen=True)
class Structure:
    """Masses and springs with friction on one coordinate, under a force on another one."""

    name: str
    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    rubs: int
    pushed: int
    start: np.ndarray
    method: str = "DOP853"

    @cached_property
    def free(self) -> np.ndarray:
        """The matrix of the states with cos, sin and 1, without friction."""
        n, inverse = len(self.mass), np.linalg.inv(self.mass)
        found = np.zeros((2 * n + 3, 2 * n + 3))
        found[:n, n : 2 * n] = np.eye(n)
        found[n : 2 * n, :n] = -inverse @ self.stiffness
        found[n : 2 * n, n : 2 * n] = -inverse @ self.damping
        found[n : 2 * n, 2 * n] = FORCE * inverse[:, self.pushed]
        found[2 * n, 2 * n + 1], found[2 * n + 1, 2 * n] = -OMEGA, OMEGA
        return found

    @cached_property
    def matrices(self) -> dict[int, np.ndarray]:
        """The same of each direction of the slide, and for 0 where the contact sticks."""
        n, response = len(self.mass), np.linalg.inv(self.mass)[:, self.rubs]
        found = {mode: self.free.copy() for mode in (-1, 0, 1)}
        for mode in (-1, 1):
            found[mode][n : 2 * n, -1] = -mode * KINETIC * response
        held = self.free[n + self.rubs] / response[self.rubs]
        found[0][n : 2 * n] -= np.outer(response, held)
        return found

    def load(self, t: float, y: np.ndarray) -> float:
        """Return the force of the contact where it sticks."""
        n = len(self.mass)
        z = np.concatenate([y, [np.cos(OMEGA * t), np.sin(OMEGA * t), 1.0]])
        return -float(self.free[n + self.rubs] @ z) / np.linalg.inv(self.mass)[self.rubs, self.rubs]

    def height(self, mode: int, t: float, y: np.ndarray) -> float:
        """Return what is positive until the mode ends."""
        return (
            float(mode * y[len(self.mass) + self.rubs]) if mode else STATIC - abs(self.load(t, y))
        )

    def model(self) -> cf.Model:
        """Return it as a model."""
        rubs = {"kinetic": KINETIC, "static": STATIC, "velocity": f"v{self.rubs + 1}"}
        return cf.Mechanism(
            self.mass,
            self.damping,
            self.stiffness,
            contacts={"pad": {"kind": "friction", **rubs}},
            force={f"q{self.pushed + 1}": "F*cos(w*t)"},
            parameters={"w": OMEGA, "F": FORCE},
            period="2*pi/w",
            name=f"{self.name}-{len(self.mass)}",
        )


def stiffness_of(n: int) -> np.ndarray:
    """Return the stiffness of a chain that is held at its first end."""
    found = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    found[-1, -1] = 1.0
    return found


def chain(n: int) -> Structure:
    """Return a chain whose first mass rubs, and whose last one is pushed."""
    start = np.concatenate([np.ones(n), np.zeros(n)])
    return Structure("chain", np.eye(n), DAMPING * np.eye(n), stiffness_of(n), 0, n - 1, start)


def cantilever(elements: int) -> Structure:
    """Return a beam of finite elements of lowest frequency 1 that rubs at its tip, damped as it is stiff."""
    size, n = 1.0 / elements, 2 * elements + 2
    bends = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
    moves = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]])
    mass, stiffness = np.zeros((2, n, n))
    turns = np.outer(unit := np.array([1.0, size, 1.0, size]), unit)
    for i in range(0, n - 2, 2):
        mass[i : i + 4, i : i + 4] += size / 420.0 * turns * moves
        stiffness[i : i + 4, i : i + 4] += turns * bends / size**3
    mass, stiffness = mass[2:, 2:], stiffness[2:, 2:]  # clamped
    lowest = float(eigh(stiffness, mass, eigvals_only=True)[0])
    stiffness, mass = stiffness / 3.0, mass * lowest / 3.0  # a force of 1 bends the tip by 1
    tip = n - 4
    start = np.concatenate([np.linalg.solve(stiffness, np.eye(n - 2)[tip]), np.zeros(n - 2)])
    damping = BEAM_DAMPING * stiffness
    return Structure("beam", mass, damping, stiffness, tip, 2 * (elements // 2), start, "Radau")


def follow(structure: Structure, step: Step) -> np.ndarray:
    """Return the state at the end; modes are the direction of the slide, 0 if the contact sticks."""
    t, y, mode = 0.0, structure.start, 0
    while True:
        load = structure.load(t, y)
        if mode or abs(load) >= STATIC * (1.0 - 1e-12):
            mode = 0 if mode and abs(load) < STATIC else -int(np.sign(load))
        t, y = step(mode, t, y)
        if t >= END:
            return y
        y[len(structure.mass) + structure.rubs] = 0.0


def reference(structure: Structure) -> np.ndarray:
    """Return the state at the end by matrix exponentials."""
    n, short, matrices = len(structure.mass), 0.05, structure.matrices
    steps = {mode: expm(matrix * short) for mode, matrix in matrices.items()}

    def step(mode: int, t: float, y: np.ndarray) -> tuple[float, np.ndarray]:
        z = np.concatenate([y, [np.cos(OMEGA * t), np.sin(OMEGA * t), 1.0]])
        begun = False
        while True:
            after = steps[mode] @ z
            left = structure.height(mode, t + short, after[: 2 * n])
            if ((begun or mode == 0) and left < 0.0) or t + short >= END:

                def at(d: float, z: np.ndarray = z, t: float = t) -> float:
                    moved = expm(matrices[mode] * d) @ z
                    return structure.height(mode, t + d, moved[: 2 * n])

                over = left < 0.0 and (begun or mode == 0)
                d = brentq(at, 0.0, short, xtol=1e-15) if over else END - t
                d = min(d, END - t)
                return t + d, (expm(matrices[mode] * d) @ z)[: 2 * n]
            begun, t, z = begun or left > 0.0, t + short, after

    return follow(structure, step)


def by_scipy(structure: Structure, tolerance: float) -> np.ndarray:
    """Return the state at the end by an integrator of scipy with events."""
    size, method = len(structure.start), structure.method

    def step(mode: int, t: float, y: np.ndarray) -> tuple[float, np.ndarray]:
        whole = structure.matrices[mode][:size]
        matrix, wave, constant = whole[:, :size].copy(), whole[:, size].copy(), whole[:, -1].copy()

        def rates(t: float, y: np.ndarray) -> np.ndarray:
            return matrix @ y + (np.cos(OMEGA * t) * wave + constant)

        def ends(t: float, y: np.ndarray) -> float:
            return structure.height(mode, t, y)

        ends.terminal, ends.direction = True, -1  # type: ignore[attr-defined]
        found = solve_ivp(
            rates, (t, END), y, method, events=ends, rtol=tolerance, atol=tolerance,
            **({"jac": matrix} if method == "Radau" else {}),
        )  # fmt: skip
        return float(found.t[-1]), found.y[:, -1].copy()

    return follow(structure, step)


def heyoka_of(structure: Structure) -> Callable[[float], np.ndarray]:
    """Return the same of a chain by heyoka; its integrators are compiled here."""
    import heyoka as hy

    stiffness = structure.stiffness
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

        return follow(structure, step)

    return run


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


def row_of(structure: Structure) -> str:
    """Measure one structure."""
    model, exact = structure.model(), reference(structure)

    def ours() -> Any:
        return cf.simulate(model, {}, state=structure.start, periods=PERIODS)

    trajectory = ours()
    runs = {"scipy": lambda tolerance: by_scipy(structure, tolerance)}
    if structure.name == "chain":
        with contextlib.suppress(ImportError):
            runs["heyoka"] = heyoka_of(structure)
    good = {name: first_good(run, exact) for name, run in runs.items()}
    calls: dict[str, Callable[[], Any]] = {"contfric": ours}
    for name, run in runs.items():
        calls[name] = lambda run=run, name=name: run(good[name][0])
    took = least(calls)
    error = float(np.max(np.abs(np.asarray(trajectory.last[2]) - exact)))
    size = f"{'' if structure.name == 'chain' else structure.name + ', '}{len(exact)}"
    cells = [size, str(len(trajectory)), f"{took['contfric']:.2f}", f"{error:.0e}"]
    for name in ("scipy", "heyoka"):
        cells += [f"{took[name]:.2f}", f"{good[name][1]:.0e}"] if name in took else ["-", "-"]
    return "| " + " | ".join(cells) + f" | {took['scipy'] / took['contfric']:.0f} |"


def main() -> None:
    """Measure and write the page."""
    began = time.perf_counter()
    rows = [row_of(s) for s in (*(chain(size // 2) for size in STATES), cantilever(ELEMENTS))]
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
        "not installed. contfric has no tolerance here. Last row: a cantilever of "
        f"{ELEMENTS} finite elements, forced in the middle, that rubs at its tip; in units of its lowest "
        f"frequency the highest is 613, and with a damping of {BEAM_DAMPING} K the fastest decay 7461. scipy "
        "takes Radau with its Jacobian there; heyoka's steps are explicit.",
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
