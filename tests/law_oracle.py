"""What certificates of piecewise-linear orbits state, decided by brute force in 60 digits; and false ones."""

from __future__ import annotations

import copy
from itertools import pairwise
from typing import Any

import mpmath as mp
import numpy as np
from mpmath import mpf

from tests.certificate_oracle import ball

DIGITS, SMALL, SAMPLES = 60, mpf("1e-25"), 60
NEAR = mpf("1e-30")


class LawTruth:
    """The law of a file in numbers of many digits, and its orbit by Newton's method."""

    def __init__(self, data: dict[str, Any]) -> None:
        law = data["equations"]
        names = {name: mpf(x) for name, x in data["params"].items()}
        names |= {f: getattr(mp, f) for f in ("sqrt", "sin", "cos", "tan", "exp", "log")}
        names |= {"pi": mp.pi, "Abs": abs}

        def number(text: Any) -> mpf:
            return mpf(eval(text, {"__builtins__": {}}, names))  # a file of this test's own making

        self.states, self.n, self.waves = law["states"], len(law["states"]), law["harmonics"]
        self.autonomous = law["frequency"] is None
        self.omega = mpf(0) if self.autonomous else number(law["frequency"])
        columns = [*self.states, "1", *(f"{f}({k})" for k in self.waves for f in ("cos", "sin"))]

        def row(entries: dict[str, Any]) -> list[mpf]:
            return [number(entries[c]) if c in entries else mpf(0) for c in columns]

        def rows(group: dict[str, Any]) -> mp.matrix:
            return mp.matrix([row(group[state]) for state in self.states])

        self.fields = {}
        for name, mode in law["modes"].items():
            field = mp.zeros(len(columns))
            field[: self.n, :] = rows(mode["field"])
            for j, k in enumerate(self.waves):
                at = self.n + 1 + 2 * j
                field[at, at + 1], field[at + 1, at] = -k * self.omega, k * self.omega
            self.fields[name] = field
        self.sides = {name: mode["inside"] for name, mode in law["modes"].items()}
        self.surfaces = {name: mp.matrix([row(e)]) for name, e in law["surfaces"].items()}
        self.maps = {name: rows(group) for name, group in law["maps"].items()}
        self.legs = [(m, e, law["transitions"][k]) for m, e, k in data["segments"]]
        self.count = len(self.legs)
        self.turn = mpf(0) if self.autonomous else data["periods"] * 2 * mp.pi / self.omega

    def extended(self, t: mpf, y: Any) -> mp.matrix:
        waves = [f(k * self.omega * t) for k in self.waves for f in (mp.cos, mp.sin)]
        return mp.matrix([*y, mpf(1), *waves])

    def joint(self, z: Any, i: int) -> tuple[mpf, list[mpf]]:
        m, at = self.n + 1, i % self.count * (self.n + 1)
        t = z[at] + (self.turn if i == self.count else 0)
        return (mpf(0) if self.autonomous and i == self.count else t), list(z[at + 1 : at + m])

    def begun(self, t: mpf, y: Any, i: int) -> mp.matrix:
        named, w = self.legs[i - 1][2]["map"], self.extended(t, y)
        return w if named is None else self.extended(t, self.maps[named] * w)

    def reached(self, i: int, t: mpf, y: Any, end: mpf) -> mp.matrix:
        return mp.expm(self.fields[self.legs[i][0]] * (end - t)) * self.begun(t, y, i)

    def residuals(self, i: int, t: mpf, y: Any, end: mpf, after: Any) -> list[mpf]:
        w = self.reached(i, t, y, end)
        met = self.surfaces[self.legs[i][1]] * self.extended(end, after)
        return [*(w[j] - after[j] for j in range(self.n)), met[0]]

    def newton(self, z: list[mpf]) -> list[mpf]:
        m = self.n + 1
        for _ in range(12):
            f, jacobian = mp.zeros(self.count * m, 1), mp.zeros(self.count * m)
            for i in range(self.count):
                (t, y), (end, after) = self.joint(z, i), self.joint(z, i + 1)
                base = self.residuals(i, t, y, end, after)
                ahead = (i + 1) % self.count
                moves = [(i * m + k, k) for k in range(m)]
                moves += [(ahead * m + k, m + k) for k in range(m)]
                for at, k in moves:
                    if self.autonomous and ahead == 0 and k == m:
                        continue
                    x = [t, *y, end, *after]
                    x[k] += SMALL
                    moved = self.residuals(i, x[0], x[1:m], x[m], x[m + 1 :])
                    for r in range(m):
                        jacobian[i * m + r, at] += (moved[r] - base[r]) / SMALL
                for r in range(m):
                    f[i * m + r] = base[r]
            change = mp.lu_solve(jacobian, f)
            z = [c - d for c, d in zip(z, change, strict=True)]
            if max(abs(d) for d in change) < mpf(10) ** -42:
                return z
        raise ValueError("Newton's method does not converge")

    def linked(self) -> bool:
        """Tell whether each segment ends with a transition that leads into the next one."""
        pairs = pairwise([*self.legs, self.legs[0]])
        return all(
            (one["from"], one["at"], one["to"]) == (m, e, after[0]) for (m, e, one), after in pairs
        )

    def admissible(self, z: list[mpf]) -> bool:
        for i, (mode, exit_, one) in enumerate(self.legs):
            (t, y), (end, after) = self.joint(z, i), self.joint(z, i + 1)
            if end <= t:
                return False
            w, field, inside = self.extended(end, after), self.fields[mode], self.sides[mode]
            begun = self.begun(end, after, (i + 1) % self.count)
            for sides, at in ((one["when"], w), (one["after"], begun)):
                if any(side * (self.surfaces[name] * at)[0] <= 0 for name, side in sides.items()):
                    return False
            if inside.get(exit_, 0) * (self.surfaces[exit_] * field * w)[0] >= 0:
                return False
            lasts, start = end - t, self.begun(t, y, i)
            step = mp.expm(field * (lasts / SAMPLES))
            near = [mp.expm(field * d) for d in (lasts * mpf("1e-9"), -lasts * mpf("1e-9"))]
            path = [near[0] * start, near[1] * w]
            for _ in range(SAMPLES - 1):
                start = step * start
                path.append(start)
            for w in path:
                for name, side in inside.items():
                    value = (self.surfaces[name] * w)[0]
                    if (side == 0 and abs(value) > NEAR) or (side and side * value <= 0):
                        return False
        return True

    def repeats(self, z: list[mpf]) -> bool:
        """Tell whether a part of the period is one."""
        first, y = self.joint(z, 0)
        for q in (q for q in range(2, self.count + 1) if self.count % q == 0):
            t, later = self.joint(z, self.count // q)
            shift = 0 if self.autonomous else abs(t - first - self.turn / q)
            if shift + sum(abs(a - b) for a, b in zip(y, later, strict=True)) < NEAR:
                return True
        return False

    def multipliers(self, z: list[mpf]) -> list[mp.mpc]:
        m, first = self.n + 1, int(self.autonomous)

        def turned(t: mpf, y: list[mpf]) -> list[mpf]:
            for i in range(self.count):
                end = self.joint(z, i + 1)[0] - self.joint(z, i)[0] + t
                mode, exit_, _ = self.legs[i]
                for _ in range(3):
                    w = self.reached(i, t, y, end)
                    rate = (self.surfaces[exit_] * self.fields[mode] * w)[0]
                    end -= (self.surfaces[exit_] * w)[0] / rate
                w = self.reached(i, t, y, end)
                t, y = end, [w[j] for j in range(self.n)]
            return [t, *y]

        t, y = self.joint(z, 0)
        base, columns = turned(t, y), []
        for k in range(first, m):
            x = [t, *y]
            x[k] += SMALL
            columns.append(
                [(a - b) / SMALL for a, b in zip(turned(x[0], x[1:]), base, strict=True)]
            )
        matrix = mp.matrix(columns).T[first:, :]
        if matrix.rows == 1:
            return [matrix[0, 0]][: self.n - first]
        found = sorted(mp.eig(matrix, left=False, right=False), key=lambda mu: -abs(mu))
        return found[: self.n - first]  # one more is 0: the surface of the joint


def false_law_statements(data: dict[str, Any]) -> list[str]:
    """Return what a file states that is not so, by brute force (uniqueness is not decided)."""
    with mp.workdps(DIGITS):
        truth = LawTruth(data)
        start = [mpf(c) for c in data["joints"]]
        try:
            z = truth.newton(start)
        except (ValueError, ZeroDivisionError):
            return ["exists"]
        wrong = [] if truth.linked() else ["transitions"]
        wrong += ["period"] if truth.repeats(z) else []
        radii = [mpf(r) for r in data["radius"]]
        if any(abs(a - b) > r for a, b, r in zip(z, start, radii, strict=True)):
            wrong.append("exists")
        for text, value in zip(data["enclosure"], z, strict=True):
            centre, radius = ball(text)
            if abs(value - centre) > radius + mpf(10) ** -40:
                wrong.append("enclosure")
        if "admissible" in data["statements"] and not truth.admissible(z):
            wrong.append("admissible")
        mu = truth.multipliers(z)
        inside = all(abs(c) < 1 for c in mu)
        if ("stable" in data["statements"]) != inside and {"stable", "unstable"} & {
            *data["statements"]
        }:
            wrong.append("stable")
        left = [*mu]
        for disc in data["multipliers"]:
            (re, r), (im, s) = ball(disc["re"]), ball(disc["im"])
            # differences of 1e-25 know a multiplier to about 1e-12 where two are close to each other
            slack = mpf(10) ** -10
            own = [
                c
                for c in left
                if abs(mp.re(c) - re) <= r + slack and abs(mp.im(c) - im) <= s + slack
            ]
            if not own:
                return [*wrong, "multipliers"]
            left.remove(own[0])
        return wrong


# ------------------------------------------------------------------------- false certificates


def mutated_law(data: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Return a certificate that states something else, by one to three changes."""
    found = copy.deepcopy(data)
    for _ in range(int(rng.integers(1, 4))):
        change = _CHANGES[int(rng.integers(len(_CHANGES)))]
        change(found, rng)
        if change in (_junk, _periods):  # others count with its numbers
            break
    return found


def _size(rng: np.random.Generator, low: float = -14, high: float = -1) -> float:
    return float(rng.choice([-1, 1]) * 10 ** rng.uniform(low, high))


def _joint(data: dict[str, Any], rng: np.random.Generator) -> None:
    i = int(rng.integers(len(data["joints"])))
    data["joints"][i] += data["radius"][i] * _size(rng, -1, 5)


def _radii(data: dict[str, Any], rng: np.random.Generator) -> None:
    factor = 10 ** rng.uniform(-9, 3)
    data["radius"] = [r * factor for r in data["radius"]]


def _ball(data: dict[str, Any], rng: np.random.Generator) -> None:
    k = int(rng.integers(len(data["enclosure"])))
    with mp.workdps(DIGITS):
        centre, radius = ball(data["enclosure"][k])
        data["enclosure"][k] = (
            f"{mp.nstr(centre + _size(rng, -28, 0), 45)} +/- {mp.nstr(radius, 5)}"
        )


def _disc(data: dict[str, Any], rng: np.random.Generator) -> None:
    if data["multipliers"]:
        disc = data["multipliers"][int(rng.integers(len(data["multipliers"])))]
        part = str(rng.choice(["re", "im"]))
        with mp.workdps(DIGITS):
            centre, radius = ball(disc[part])
            disc[part] = f"{mp.nstr(centre + _size(rng, -9, 0), 45)} +/- {mp.nstr(radius, 5)}"


def _other_side(data: dict[str, Any], rng: np.random.Generator) -> None:
    other = {"stable": "unstable", "unstable": "stable"}
    data["statements"] = [other.get(claim, claim) for claim in data["statements"]]
    if rng.uniform() < 0.7:
        data["multipliers"] = []


def _parameter(data: dict[str, Any], rng: np.random.Generator) -> None:
    data["params"][str(rng.choice(list(data["params"])))] += _size(rng)


def _wide(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Let the box be as wide as the change of the law that comes next."""
    data["radius"] = [1e-2 * (1 + abs(c)) * 10 ** rng.uniform(-4, 0) for c in data["joints"]]
    data["enclosure"] = [
        f"{c!r} +/- {r!r}" for c, r in zip(data["joints"], data["radius"], strict=True)
    ]
    data["multipliers"] = []
    data["statements"] = [c for c in data["statements"] if c != "unique"]


def _entry(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Change an entry of a field, a surface or a map."""
    law = data["equations"]
    rows = [row for mode in law["modes"].values() for row in mode["field"].values()]
    rows += [*law["surfaces"].values(), *(row for m in law["maps"].values() for row in m.values())]
    row = rows[int(rng.integers(len(rows)))]
    columns = [
        *law["states"],
        "1",
        *(f"{f}({k})" for k in law["harmonics"] for f in ("cos", "sin")),
    ]
    name = str(rng.choice(list(row) or columns) if rng.uniform() < 0.7 else rng.choice(columns))
    way = rng.uniform()
    if way < 0.2:
        row.pop(name, None)
    else:
        change = (
            f"+ {_size(rng)!r}" if way < 0.6 else f"* (1 + {_size(rng)!r})" if way < 0.8 else "* -1"
        )
        row[name] = f"({row.get(name, '0')}) {change}"
    if way > 0.3:
        _wide(data, rng)


def _sides(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Another domain, or another condition of a transition."""
    law = data["equations"]
    groups = [mode["inside"] for mode in law["modes"].values()]
    groups += [one[where] for one in law["transitions"] for where in ("when", "after")]
    group = groups[int(rng.integers(len(groups)))]
    if group and rng.uniform() < 0.6:
        group[str(rng.choice(list(group)))] *= -1
    elif group and rng.uniform() < 0.5:
        del group[str(rng.choice(list(group)))]
    else:
        group[str(rng.choice(list(law["surfaces"])))] = int(rng.choice([-1, 0, 1]))


def _transition(data: dict[str, Any], rng: np.random.Generator) -> None:
    law = data["equations"]
    one = law["transitions"][int(rng.integers(len(law["transitions"])))]
    what = str(rng.choice(["from", "at", "to", "map"]))
    choices = {"at": list(law["surfaces"]), "map": [None, *law["maps"]]}.get(
        what, list(law["modes"])
    )
    one[what] = choices[int(rng.integers(len(choices)))]


def _segment(data: dict[str, Any], rng: np.random.Generator) -> None:
    i, law = int(rng.integers(len(data["segments"]))), data["equations"]
    way, m = rng.uniform(), len(law["states"]) + 1
    if way < 0.4:
        names = [list(law["modes"]), list(law["surfaces"]), [*range(len(law["transitions"]))]]
        k = int(rng.integers(3))
        data["segments"][i][k] = names[k][int(rng.integers(len(names[k])))]
    elif way < 0.7 and len(data["segments"]) > 1:
        del data["segments"][i]
        for name in ("joints", "radius", "enclosure"):
            del data[name][m * i : m * i + m]
    else:  # from a later joint on: true with excitation, but for the time
        data["segments"] = data["segments"][1:] + data["segments"][:1]
        for name in ("joints", "radius", "enclosure"):
            data[name] = data[name][m:] + data[name][:m]


def several_turns(data: dict[str, Any], rng: np.random.Generator) -> None:
    """State several turns as one orbit."""
    count, m = int(rng.integers(2, 4)), len(data["equations"]["states"]) + 1
    omega = data["equations"]["frequency"]
    if omega is not None and not isinstance(data["params"].get(omega), float):
        return
    turn = 2 * np.pi * data["periods"] / data["params"][omega] if omega else -data["joints"][0]
    late = [k - (0 if omega else count - 1) for k in range(count)]
    data["joints"] = [
        c + k * turn * (j % m == 0) for k in late for j, c in enumerate(data["joints"])
    ]
    data["segments"] = data["segments"] * count
    data["periods"] = data["periods"] * count if omega else None
    data["radius"] = [max(r, 1e-10) for r in data["radius"]] * count
    data["enclosure"] = [f"{c!r} +/- 1e-9" for c in data["joints"]]
    data["multipliers"] = []


def _periods(data: dict[str, Any], rng: np.random.Generator) -> None:
    data["periods"] = None if rng.uniform() < 0.2 else int(rng.integers(-1, 4))


def _waves(data: dict[str, Any], rng: np.random.Generator) -> None:
    law = data["equations"]
    if rng.uniform() < 0.5 and law["frequency"]:
        law["frequency"] = f"{law['frequency']} * (1 + {_size(rng)!r})"
        _wide(data, rng)
    else:
        law["harmonics"] = [k + int(rng.integers(0, 2)) for k in law["harmonics"]]


def _less(data: dict[str, Any], rng: np.random.Generator) -> None:
    name = str(rng.choice(["multipliers", "statements"]))
    data[name] = data[name][: int(rng.integers(len(data[name]) + 1))]


def _junk(data: dict[str, Any], rng: np.random.Generator) -> None:
    junk = (float("nan"), float("inf"), 1e308, 5e-324, None, "nan", [], "1 +/- 1")
    name = str(rng.choice(["joints", "radius", "enclosure"]))
    data[name][int(rng.integers(len(data[name])))] = junk[int(rng.integers(len(junk)))]


_CHANGES = (
    *(
        _joint,
        _radii,
        _ball,
        _disc,
        _other_side,
        _parameter,
        _wide,
        _entry,
        _entry,
        _entry,
        _sides,
        _sides,
    ),
    *(_transition, _segment, several_turns, _periods, _waves, _less, _junk),
)
