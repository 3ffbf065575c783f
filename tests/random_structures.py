"""Random structures with contacts, and their solutions stepped from event to event without contfric.

The stepping knows the equations of motion and what each contact does: Runge-Kutta steps (DOP853), a hundred
and twenty a period, in which events are bracketed. Contacts at rest are solved for together.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq

import contfric as cf

KINDS = ["friction", "friction", "static", "fading", "normal", "jenkins", "impact", "spring"]
SHARES = [0.15, 0.1, 0.15, 0.15, 0.15, 0.12, 0.08, 0.1]
Force = Callable[[float, np.ndarray], float]


def formula(text: str, n: int, params: Mapping[str, float]) -> Force:
    """Return an expression of time and state as a function."""
    text = re.sub(r"\bq(\d+)", lambda m: f"y[{int(m[1]) - 1}]", text)
    text = re.sub(r"\bv(\d+)", lambda m: f"y[{n + int(m[1]) - 1}]", text)
    names = {"cos": math.cos, "sin": math.sin, "abs": abs, **params}
    return eval(f"lambda t, y: {text}", names)  # type: ignore[no-any-return]


@dataclass
class Contact:
    """One contact: its direction, numbers and laws, and the index of its stretch."""

    kind: str
    along: np.ndarray
    declared: dict[str, Any]
    belt: float = 0.0
    gap: float = 0.0
    stretch: int = -1
    laws: dict[str, Force] = field(default_factory=dict)


class Stepped:
    """A structure as its equations of motion; modes are lists of a letter for each contact."""

    def __init__(self, matrices: Any, force: dict[str, str], contacts: list[Contact], params: Any):
        self.M, self.C, self.K = matrices
        self.n, self.inverse, self.contacts = len(self.M), np.linalg.inv(self.M), contacts
        self.period = 2.0 * math.pi / params["Omega"]
        self.force = [(int(q[1:]) - 1, formula(f, self.n, params)) for q, f in force.items()]
        self.size = 2 * self.n
        for c in contacts:
            for law in ("kinetic", "static", "limit"):
                if law in c.declared:
                    c.laws[law] = formula(str(c.declared[law]), self.n, params)
            c.laws.setdefault("static", c.laws.get("kinetic", lambda t, y: 0.0))
            if c.kind == "jenkins":
                c.stretch, self.size = self.size, self.size + 1
        self.rubbing = [i for i, c in enumerate(contacts) if c.kind == "friction"]

    def speed(self, c: Contact, y: np.ndarray) -> float:
        return float(c.along @ y[self.n : 2 * self.n]) - c.belt

    def opening(self, c: Contact, y: np.ndarray) -> float:
        return c.gap + float(c.along @ y[: self.n])

    def acceleration(
        self, t: float, y: np.ndarray, modes: list[str]
    ) -> tuple[Any, dict[int, float]]:
        """Return accelerations, and the forces of contacts that stick."""
        pull = -self.C @ y[self.n : 2 * self.n] - self.K @ y[: self.n]
        for i, f in self.force:
            pull[i] += f(t, y)
        stuck = [i for i in self.rubbing if modes[i] == "s"]
        for c, mode in zip(self.contacts, modes, strict=True):
            if c.kind == "spring" and mode == "c":
                pull = pull - c.declared["stiffness"] * self.opening(c, y) * c.along
            elif c.kind == "jenkins":
                pull = pull - c.declared["stiffness"] * y[c.stretch] * c.along
            elif c.kind == "friction" and mode != "s":
                pull = pull - {"p": 1.0, "n": -1.0}[mode] * c.laws["kinetic"](t, y) * c.along
        free = self.inverse @ pull
        if not stuck:
            return free, {}
        W = np.array([self.contacts[i].along for i in stuck])
        held = np.linalg.solve(W @ self.inverse @ W.T, -(W @ free))
        return free + self.inverse @ W.T @ held, dict(zip(stuck, -held, strict=True))

    def rates(self, t: float, y: np.ndarray, modes: list[str]) -> np.ndarray:
        out = np.zeros(self.size)
        out[: self.n], (out[self.n : 2 * self.n], _) = (
            y[self.n : 2 * self.n],
            self.acceleration(t, y, modes),
        )
        for c, mode in zip(self.contacts, modes, strict=True):
            if c.kind == "jenkins" and mode == "s":
                out[c.stretch] = self.speed(c, y)
        return out

    def released(self, t: float, y: np.ndarray, modes: list[str], first: int = -1) -> list[str]:
        """Return what friction that sticks does: the contact farthest beyond its limit is released first."""
        modes = modes.copy()
        resting = [i for i in self.rubbing if modes[i] == "s"]
        for _ in resting:
            _, loads = self.acceleration(t, y, modes)
            beyond = {i: abs(u) - self.contacts[i].laws["static"](t, y) for i, u in loads.items()}
            beyond.update({first: math.inf} if first in beyond else {})
            worst = max(beyond, key=lambda i: beyond[i], default=-1)
            if worst < 0 or beyond[worst] <= 1e-11:
                break
            modes[worst] = "p" if loads[worst] > 0.0 else "n"
        return modes

    def begun(self, t: float, y: np.ndarray) -> list[str]:
        """Return the modes of a state in which nothing rests; the stretches are within their limits."""
        moves = ["p" if self.speed(c, y) > 0.0 else "n" for c in self.contacts]
        kinds = {"jenkins": "s", "impact": "-"}
        return [
            ("c" if self.opening(c, y) < 0.0 else "o")
            if c.kind == "spring"
            else kinds.get(c.kind, move)
            for c, move in zip(self.contacts, moves, strict=True)
        ]

    def events(self, modes: list[str]) -> list[tuple[int, str, Force]]:
        """Return what ends the modes: functions that fall below zero there."""
        found: list[tuple[int, str, Force]] = []
        for i, (c, mode) in enumerate(zip(self.contacts, modes, strict=True)):
            sense = 1.0 if mode in ("p", "o", "-") else -1.0
            if c.kind in ("spring", "impact"):
                found.append((i, "gap", lambda t, y, c=c, s=sense: s * self.opening(c, y)))
            elif mode != "s":
                found.append((i, "stop", lambda t, y, c=c, s=sense: s * self.speed(c, y)))
            for way in (1.0, -1.0) if mode == "s" else ():

                def margin(
                    t: float, y: np.ndarray, c: Any = c, i: int = i, way: float = way
                ) -> float:
                    if c.kind == "jenkins":
                        return c.laws["limit"](t, y) - way * c.declared["stiffness"] * y[c.stretch]
                    return c.laws["static"](t, y) - way * self.acceleration(t, y, modes)[1][i]

                found.append((i, "p" if way > 0.0 else "n", margin))
        return found

    def leg(self, t: float, y: np.ndarray, end: float, modes: list[str]) -> Any:
        """Return time and state at which the modes end, and what ends them."""
        solver = DOP853(
            lambda t, y: self.rates(t, y, modes), t, y, end, rtol=1e-12, atol=1e-13,
            max_step=self.period / 120,
        )  # fmt: skip
        events = self.events(modes)
        open_ = [f(t, y) > 1e-12 for *_, f in events]  # others begin on their surface, and leave it
        while solver.status == "running":
            solver.step()
            inside = solver.dense_output()
            times, hits = np.linspace(solver.t_old, solver.t, 4), []
            for a, b in pairwise(times):
                for e, (_, _, f) in enumerate(events):
                    if open_[e] and f(b, inside(b)) < 0.0:
                        met = brentq(lambda s, f=f, at=inside: f(s, at(s)), a, b, xtol=1e-15)
                        hits.append((met, e))
                    open_[e] = open_[e] or f(b, inside(b)) > 1e-12
                if hits:
                    at, e = min(hits)
                    return at, inside(at), events[e][:2]
        return solver.t, solver.y, None

    def run(self, t: float, y: np.ndarray, end: float, modes: list[str]) -> tuple[np.ndarray, int]:
        """Return the state at the end, and how many events there were."""
        count = 0
        while True:
            t, y, what = self.leg(t, y, end, modes)
            if what is None:
                return y, count
            (i, how), c, modes, count = what, self.contacts[what[0]], modes.copy(), count + 1
            moved = self.inverse @ c.along / (c.along @ self.inverse @ c.along)
            if c.kind == "spring":
                modes[i] = "c" if modes[i] == "o" else "o"
            elif c.kind == "jenkins":
                modes[i] = "s" if how == "stop" else how
            elif c.kind == "impact":
                y = y.copy()
                y[self.n : 2 * self.n] -= (
                    (1.0 + c.declared["restitution"]) * self.speed(c, y) * moved
                )
                for j, other in enumerate(self.contacts):
                    if other.kind == "friction" and abs(self.speed(other, y)) > 1e-12:
                        modes[j] = "p" if self.speed(other, y) > 0.0 else "n"
                    turned = self.speed(other, y) * {"p": 1.0, "n": -1.0}.get(modes[j], 0.0) < 0.0
                    if other.kind == "jenkins" and turned:
                        modes[j] = "s"
            elif how == "stop":
                y = y.copy()
                y[self.n : 2 * self.n] -= self.speed(c, y) * moved
                modes[i] = "s"
                modes = self.released(t, y, modes)
            else:
                modes = self.released(t, y, modes, i)


def linear(along: np.ndarray, letter: str) -> str:
    return " + ".join(f"({w})*{letter}{a + 1}" for a, w in enumerate(along) if w)


def drawn_contact(
    rng: np.random.Generator, kind: str, along: np.ndarray, j: int, params: Any
) -> Contact:
    """Return a contact of a kind along a direction."""
    if kind == "jenkins":
        stiffness, limit = (
            round(float(rng.uniform(*ends)), 3) for ends in ((0.3, 2.0), (0.1, 0.4))
        )
        given = {"displacement": linear(along, "q"), "stiffness": stiffness, "limit": limit}
        return Contact("jenkins", along, {"kind": "jenkins", **given})
    if kind in ("impact", "spring"):
        along = along * rng.choice([-1, 1])
        gap, e, k = (
            round(float(rng.uniform(*ends)), 3) for ends in ((0.1, 0.8), (0.4, 0.9), (0.5, 8))
        )
        law = {"restitution": e} if kind == "impact" else {"stiffness": k}
        given = {"kind": kind, "gap": f"{gap} + {linear(along, 'q')}", **law}
        return Contact(kind, along, given, gap=gap)
    belt = round(float(rng.uniform(-0.5, 0.5)), 3) if rng.random() < 0.4 else 0.0
    velocity = linear(along, "v") + (f" - ({belt})" if belt else "")
    params[f"S{j}"] = round(float(rng.uniform(0.08, 0.4)), 3)
    given = {"kind": "friction", "velocity": velocity, "kinetic": f"S{j}"}
    more = f"{rng.uniform(1.05, 1.5):.2f}*"
    if kind == "static":
        given["static"] = f"{more}S{j}"
    elif kind == "fading":
        given["kinetic"] = f"S{j}/(1 + {rng.uniform(0.3, 1.5):.2f}*abs({velocity}))"
        given["static"] = f"S{j}"
    elif kind == "normal":
        varying = f"(1 + {rng.uniform(0.2, 0.7):.2f}*cos(Omega*t + {rng.uniform(0, 6):.2f}))"
        given["kinetic"] = f"S{j}*{varying}"
        if rng.random() < 0.5:
            given["static"] = f"{more}S{j}*{varying}"
    return Contact("friction", along, given, belt=belt)


def drawn(seed: int, fading: bool = False) -> tuple[Any, Stepped, np.ndarray]:
    """Return a model (a function: it may be refused), its equations, and a state in which nothing rests.

    Forces of friction that fade with the speed are integrated, which takes longer.
    """
    rng = np.random.default_rng(seed)
    n, k = int(rng.integers(2, 7)), int(rng.integers(1, 5))
    root = rng.normal(size=(n, n))
    stiffness = 0.3 * root @ root.T / n + np.diag(rng.uniform(0.5, 1.5, n))
    mass = np.diag(rng.uniform(0.5, 2.0, n))
    damping = rng.uniform(0.02, 0.15) * (stiffness if rng.random() < 0.5 else np.eye(n))
    params = {"Omega": round(float(rng.uniform(0.5, 1.7)), 4)}
    force = {}
    for i in range(n):
        if i == 0 or rng.random() < 0.4:
            a, b, c = rng.normal(size=3).round(3) * (1.0, 1.0, 0.4 * (rng.random() < 0.4))
            force[f"q{i + 1}"] = f"{a}*cos(Omega*t) + {b}*sin(Omega*t) + {c}*cos(3*Omega*t)"
    contacts, places = [], rng.permutation(n)
    for j, name in enumerate(rng.choice(KINDS, k, p=SHARES)):
        kind = "static" if name == "fading" and not fading else str(name)
        along = np.eye(n)[places[j % n]]
        if rng.random() < 0.25:
            along = along - np.eye(n)[places[(j + 1) % n]]
        contacts.append(drawn_contact(rng, kind, along, j + 1, params))
    matrices = tuple(np.round(A, 4) for A in (mass, damping, stiffness))
    stepped = Stepped(matrices, force, contacts, params)
    state = np.zeros(stepped.size)
    state[n : 2 * n] = 0.4 * rng.normal(size=n)

    def model() -> cf.Model:
        declared = {f"c{j + 1}": c.declared for j, c in enumerate(contacts)}
        return cf.Mechanism(
            *matrices, contacts=declared, force=force, parameters=params, period="2*pi/Omega",
            name=f"random-{seed}",
        )  # fmt: skip

    return model, stepped, state
