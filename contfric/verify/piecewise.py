"""Orbits of piecewise-linear models: the file states the law of its model, and an orbit of it.

The law is a hybrid automaton. In a mode ``w' = M w`` holds, w = (y, 1, cos(k omega t), sin(k omega t), ...), as
long as some surfaces, rows ``g w``, are on the sides that it names. Where one of them is met, a transition
leads on: to another mode, or by a map of y. Entries are formulas of the parameters, so that they are
known to as many digits as are asked for, and exactly where they are rational.

An orbit is a zero of F(z), z the joints (t_i, y_i): each segment leads from a joint to the next one, on its surface.
With C near the inverse of the Jacobian J, ``z - C F(z)`` contracts a box of half-widths r about c into itself if
``|1 - C J| r + |C F(c)| < r``. Flows are sums of Taylor with a bound of what is left out:

    |sum over k > p of (M tau)^k w / k!| <= (a tau)^(p + 1) / (p + 1)! exp(a tau) |w| ,    a = |M| .
"""

from __future__ import annotations

import ast
import json
from functools import cached_property
from math import ceil, log2, prod
from typing import Any

from flint import acb, arb, arb_mat, arb_poly, ctx, fmpq

from contfric.verify.file import BITS, CLAIMS, FORMAT, Answer
from contfric.verify.motion import Refused, Undecided, ball, see

PIECES, HALVINGS, TERMS = 20_000, 60, 24  # of a segment, of a piece, of a series on it
MOST_ORDER, LARGEST_POWER = 6, 64
ENTRIES = {
    *("certificate", "format", "model", "params", "equations", "periods", "segments"),
    *("joints", "radius", "enclosure", "multipliers", "statements"),
}
FUNCTIONS = ("sin", "cos", "tan", "exp", "log", "sinh", "cosh", "tanh", "atan", "asin", "acos")
Number = Any  # an exact fraction, or a ball


def check_text(text: str) -> Answer:
    """Check the text of the certificate of an orbit of a piecewise-linear model."""
    try:
        data = json.loads(text)
        json.loads(text, object_pairs_hook=lambda p: see(len(dict(p)) == len(p), "names come once"))
        known = data["certificate"] == "orbit" and data["format"] == FORMAT
        see(known, f"it is a certificate of an orbit, of format {FORMAT}")
        see(set(data) == ENTRIES, "it states nothing else")
        why = ""
        for bits in BITS:
            with ctx.workprec(bits):
                try:
                    return Answer(True, "", tuple(_check(data)), bits)
                except (Undecided, ZeroDivisionError) as error:
                    why = str(error)
        raise Refused(f"not decided with {BITS[-1]} bits: {why}")
    except Exception as error:
        return Answer(False, str(error) if isinstance(error, Refused) else f"damaged: {error!r}")


def _check(data: Any) -> list[str]:
    claims = data["statements"]
    see(claims == ["exists", *(c for c in CLAIMS if c in claims)], "it states what an orbit is")
    chain = Chain(Law(data["equations"], data["params"]), data["segments"][:], data["periods"])
    printed, radii = ([ball(c - 0) for c in data[name][:]] for name in ("joints", "radius"))
    see(len(printed) == len(radii) == chain.count * (chain.n + 1), "it has all joints")
    see(all(r >= 0 for r in radii), "half-widths are not negative")
    z = chain.near(printed)
    for c, at, r in zip(z, printed, radii, strict=True):
        see(r - abs(c - at), "it lies in the box around the printed joints")
    for text, c in zip(data["enclosure"][:], z, strict=True):
        see(ball(text).contains(c), "its ball holds it", False)
    see(chain.is_least(z), "no part of its period is one", False)
    if "unique" in claims:
        see(chain.contracts(printed, radii), "no other orbit is in the box", False)
    if "admissible" in claims:
        chain.check_admissible(z)
    found, size = chain.characteristic(z), chain.n - chain.autonomous
    if "stable" in claims or "unstable" in claims:
        see(("stable" in claims) != ("unstable" in claims), "it is stable or not")
        see(is_inside(found) == ("stable" in claims), "multipliers are on that side of the circle")
    stated = [acb(ball(d["re"]), ball(d["im"])) for d in data["multipliers"][:] if len(d) == 2]
    if data["multipliers"]:
        see(len(stated) == len(data["multipliers"]) == size, "it has all multipliers")
        hold = [*discs(found), *[acb(0)] * (size - found.degree())]
        for disc in hold:
            own = [k for k, s in enumerate(stated) if s.contains(disc)]
            see(own != [], "multipliers are in their discs", False)
            del stated[own[0]]
    return (
        claims
        + ["multipliers"] * bool(data["multipliers"])
        + [f"in the stated law of {len(chain.law.modes)} modes"]
    )


# ------------------------------------------------------------------------------------------- the law


def value(text: Any, names: dict[str, Number]) -> Number:
    """Return the value of a formula: a fraction if it is one, else a ball."""
    if type(text) in (int, float):
        return fraction(text)
    see(isinstance(text, str) and len(text) < 10_000, "entries are formulas")

    def of(node: ast.expr) -> Number:
        match node:
            case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
                return fraction(number)
            case ast.Name(id="pi") if "pi" not in names:
                return arb.pi()
            case ast.Name(id=name) if name in names:
                return names[name]
            case ast.UnaryOp(op=ast.USub(), operand=x):
                return -of(x)
            case ast.BinOp(left=x, op=ast.Add(), right=y):
                return of(x) + of(y)
            case ast.BinOp(left=x, op=ast.Sub(), right=y):
                return of(x) - of(y)
            case ast.BinOp(left=x, op=ast.Mult(), right=y):
                return of(x) * of(y)
            case ast.BinOp(left=x, op=ast.Div(), right=y):
                return of(x) / of(y)
            case ast.BinOp(left=x, op=ast.Pow(), right=y):
                return power(of(x), of(y))
            case ast.Call(func=ast.Name(id="sqrt"), args=[x], keywords=[]):
                return power(of(x), fmpq(1, 2))
            case ast.Call(func=ast.Name(id="Abs"), args=[x], keywords=[]):
                return abs(of(x))
            case ast.Call(func=ast.Name(id=name), args=[x], keywords=[]) if name in FUNCTIONS:
                return getattr(arb(of(x)), name)()
        raise Refused(f"{ast.unparse(node)[:40]!r} is no formula of the parameters")

    return of(ast.parse(text, mode="eval").body)


def fraction(number: float) -> fmpq:
    """Return a number of a file, exactly."""
    return fmpq(*number.as_integer_ratio())


def power(x: Number, exponent: Number) -> Number:
    """Return a power with an exponent that is a whole number or a half of one."""
    see(isinstance(exponent, fmpq) and exponent.q in (1, 2), "exponents are whole or half numbers")
    see(abs(exponent) <= LARGEST_POWER, "exponents are small")
    return x ** int(exponent) if exponent.q == 1 else arb(x).sqrt() ** int(exponent.p)


def is_zero(x: Number) -> bool:
    """Tell whether a number is exactly zero."""
    return x == 0 if isinstance(x, fmpq) else bool(x.is_zero())


def times(row: list[Number], matrix: list[list[Number]]) -> list[Number]:
    """Return a row times a matrix, exact where they are."""
    pairs = [(c, other) for c, other in zip(row, matrix, strict=True) if not is_zero(c)]
    return [
        sum((c * o[j] for c, o in pairs if not is_zero(o[j])), fmpq(0))
        for j in range(len(matrix[0]))
    ]


def in_span(row: list[Number], others: list[list[Number]]) -> bool:
    """Tell whether a row is a combination of others, exactly."""
    others, left = [list(other) for other in others], list(row)
    while others:
        own = others.pop()
        pivot = next((j for j, c in enumerate(own) if not is_zero(c)), None)
        if pivot is None or (isinstance(own[pivot], arb) and 0 in own[pivot]):
            continue
        for other in (*others, left):
            factor = other[pivot] / own[pivot]
            other[:] = [
                c if is_zero(o) or is_zero(factor) else c - factor * o
                for c, o in zip(other, own, strict=True)
            ]
            other[pivot] = fmpq(0)
    return all(is_zero(c) for c in left)


class Law:
    """The law of a file: fields, surfaces and maps as rows of the extended state, and transitions."""

    def __init__(self, data: Any, params: Any) -> None:
        entries = {"states", "frequency", "harmonics", "modes", "surfaces", "maps", "transitions"}
        see(set(data) == entries, "a law has no other entries")
        names = {name: fraction(number) for name, number in params.items()}
        self.states, self.harmonics = data["states"][:], data["harmonics"][:]
        self.n, whole = len(self.states), all(type(k) is int and k > 0 for k in self.harmonics)
        see(
            whole and len(set(self.harmonics)) == len(self.harmonics), "harmonics are whole numbers"
        )
        self.autonomous = data["frequency"] is None
        see(not (self.autonomous and self.harmonics), "harmonics have a frequency")
        self.omega = fmpq(1) if self.autonomous else value(data["frequency"], names)
        see(arb(self.omega), "the frequency is positive", False)
        self.columns = [
            *self.states,
            "1",
            *(f"{f}({k})" for k in self.harmonics for f in ("cos", "sin")),
        ]
        see(
            len(set(self.columns)) == len(self.columns) and self.n > 0,
            "states have their own names",
        )
        self.size = len(self.columns)
        waves = [[fmpq(0)] * self.size for _ in range(self.size - self.n)]
        for j, k in enumerate(self.harmonics):
            waves[1 + 2 * j][self.n + 2 + 2 * j] = -k * self.omega
            waves[2 + 2 * j][self.n + 1 + 2 * j] = k * self.omega
        still = [
            [fmpq(int(j == self.n + k)) for j in range(self.size)]
            for k in range(self.size - self.n)
        ]

        def row(entries: Any) -> list[Number]:
            see(set(entries) <= set(self.columns), "rows are of the states and harmonics")
            return [value(entries.get(name, 0), names) for name in self.columns]

        def matrix(rows: Any, rest: list[list[Number]]) -> list[list[Number]]:
            see(list(rows) == self.states, "there is a row for each state")
            return [*map(row, rows.values()), *rest]

        self.surfaces = {name: row(entries) for name, entries in data["surfaces"].items()}
        self.modes = {name: matrix(mode["field"], waves) for name, mode in data["modes"].items()}
        self.sides = {name: sides(mode["inside"]) for name, mode in data["modes"].items()}
        see(all(len(mode) == 2 for mode in data["modes"].values()), "a mode states nothing else")
        self.maps = {name: matrix(rows, still) for name, rows in data["maps"].items()}
        self.transitions = data["transitions"][:]
        for one in self.transitions:
            see(
                set(one) == {"from", "at", "when", "map", "after", "to"},
                "a transition has no other entries",
            )
            sides(one["when"]), sides(one["after"])


def sides(given: Any) -> dict[str, int]:
    """Return sides of surfaces."""
    see(all(type(side) is int and side in (-1, 0, 1) for side in given.values()), "sides are signs")
    return dict(given)


def dot(row: list[Number], w: arb_mat) -> arb:
    """Return a surface's value at an extended state."""
    return sum((arb(c) * w[j, 0] for j, c in enumerate(row) if not is_zero(c)), arb(0))


class Field:
    """The matrix M of a mode, with a scale of each entry of the state, in which |M| is small."""

    def __init__(self, rows: list[list[Number]]) -> None:
        self.rows, size = rows, len(rows)
        self.matrix = arb_mat([[arb(c) for c in row] for row in rows])
        sizes = [[float(abs(arb(c)).upper()) for c in row] for row in rows]
        logs = [0] * size
        for j in [*range(size)] * 20:  # powers of two that make rows as large as columns
            others = [k for k in range(size) if k != j]
            own = sum(sizes[j][k] * 2.0 ** (logs[k] - logs[j]) for k in others)
            on_it = sum(sizes[k][j] * 2.0 ** (logs[j] - logs[k]) for k in others)
            if own > 0 and own + on_it < 1e300:
                logs[j] += round(log2(own / max(on_it, own / 4)) / 2)
        self.scales = [arb(2) ** k for k in logs]
        scaled = [
            sum((abs(c) * k for c, k in zip(row, self.scales, strict=True)), arb(0)) / scale
            for row, scale in zip(self.matrix.tolist(), self.scales, strict=True)
        ]
        self.bound = max((c.upper() for c in scaled), key=float)

    def rest(self, share: arb, count: int) -> arb:
        """Return a bound of exp(M tau) less its first terms, |M tau| being at most the share."""
        return (share ** (count + 1) / arb(count + 2).gamma() * share.exp()).upper()

    def flow(self, duration: arb) -> arb_mat:
        """Return exp(M d): Taylor's series of a part of d, squared."""
        size, reach = len(self.scales), (self.bound * abs(duration)).upper()
        see(arb(PIECES) - reach, "a mode is not too stiff", False)
        squares = max(0, ceil(log2(max(float(reach), 1e-9))) + 4)
        step, share = self.matrix * (duration / 2**squares), (reach / 2**squares).upper()
        found = term = arb_mat(size, size, 1)
        count = 0
        while not self.rest(share, count) < arb(2) ** (-ctx.prec - 8):
            count += 1
            term = term * step * (arb(1) / count)
            found = found + term
        left = self.rest(share, count)
        off = [arb(0, (left * a / b).upper()) for a in self.scales for b in self.scales]
        found = found + arb_mat(size, size, off)
        for _ in range(squares):
            found = found * found
        return found

    def series(self, row: list[Number], terms: list[arb_mat], reach: arb) -> tuple[arb_poly, arb]:
        """Return g exp(M tau) w in powers of tau, and a bound by tau^(p + 1) of what is left, |tau| in reach."""
        w = zip(terms[0].entries(), self.scales, strict=True)
        size = max(((abs(c) / k).upper() for c, k in w), key=float)
        weight = sum((abs(arb(c)) * k for c, k in zip(row, self.scales, strict=True)), arb(0))
        growth = (self.bound * reach).exp() * self.bound ** (TERMS + 1) / arb(TERMS + 2).gamma()
        return arb_poly([dot(row, term) for term in terms]), (growth * size * weight).upper()

    def terms(self, w: arb_mat) -> list[arb_mat]:
        """Return Taylor's coefficients of exp(M tau) w."""
        found = [w]
        for k in range(1, TERMS + 1):
            found.append(self.matrix * found[-1] * (arb(1) / k))
        return found


# ---------------------------------------------------------------------------------------- the orbit


class Chain:
    """The segments of an orbit in a law, and its equations; joints are (t, y), one after the other."""

    def __init__(self, law: Law, segments: list[Any], periods: Any) -> None:
        self.law, self.n, self.count = law, law.n, len(segments)
        self.m, self.autonomous = law.n + 1, law.autonomous
        possible = periods is None if self.autonomous else type(periods) is int and periods > 0
        see(possible and self.count > 0, "it is periodic")
        self.turn = arb(0) if self.autonomous else periods * 2 * arb.pi() / arb(law.omega)
        self.legs = [(mode, exit_, law.transitions[k]) for mode, exit_, k in segments]
        for i, (mode, exit_, one) in enumerate(self.legs):
            after = self.legs[(i + 1) % self.count][0]
            led = (one["from"], one["at"], one["to"]) == (mode, exit_, after)
            see(led, f"segment {i + 1} ends with a transition of the law")
            see(law.sides[mode].get(exit_, 0) != 0, f"segment {i + 1} ends where its mode does")
        self.fields = {mode: Field(law.modes[mode]) for mode, _, _ in self.legs}

    # ------------------------------------------------------------------------ equations

    def extended(self, z: list[arb], i: int) -> tuple[arb_mat, arb_mat]:
        """Return the extended state at a joint, and its derivative by time, y held fixed."""
        t = z[i % self.count * self.m] + (self.turn if i == self.count else 0)
        at = i % self.count * self.m
        w, rate = [*z[at + 1 : at + self.m], arb(1)], [arb(0)] * (self.n + 1)
        for k in self.law.harmonics:
            frequency = k * arb(self.law.omega)
            sine, cosine = (frequency * t).sin_cos()
            w, rate = [*w, cosine, sine], [*rate, -frequency * sine, frequency * cosine]
        return arb_mat([[c] for c in w]), arb_mat([[c] for c in rate])

    def duration(self, z: list[arb], i: int) -> arb:
        """Return how long segment i lasts; that of the last one without excitation ends at time 0."""
        if i + 1 < self.count:
            return z[(i + 1) * self.m] - z[i * self.m]
        return (arb(0) if self.autonomous else z[0] + self.turn) - z[i * self.m]

    def start(self, z: list[arb], i: int) -> tuple[arb_mat, arb_mat, arb_mat]:
        """Return the extended state after the map before segment i, its rate by t, and that map."""
        (w, rate), named = self.extended(z, i), self.legs[i - 1][2]["map"]
        size = self.law.size
        if named is None:
            return w, rate, arb_mat(size, size, 1)
        by = arb_mat([[arb(c) for c in row] for row in self.law.maps[named]])
        return by * w, by * rate, by

    def equations(self, z: list[arb]) -> tuple[list[arb], arb_mat, list[Any]]:
        """Return what vanishes for a solution, its Jacobian, and what each segment does to disturbances."""
        values, rows, moves, n, m = list[arb](), list[list[arb]](), list[Any](), self.n, self.m
        for i, (mode, exit_, _) in enumerate(self.legs):
            field, surface = self.fields[mode], self.law.surfaces[exit_]
            w, rate, by = self.start(z, i)
            flow = field.flow(self.duration(z, i))
            end, (after, late) = flow * w, self.extended(z, i + 1)
            speed, by_time, by_state = field.matrix * end, flow * rate, flow * by
            ahead = (i + 1) % self.count
            timed = not self.autonomous or ahead  # else the last joint has time 0
            for j in range(n):
                row = [arb(0)] * (self.count * m)
                row[i * m] += by_time[j, 0] - speed[j, 0]
                for k in range(n):
                    row[i * m + 1 + k] += by_state[j, k]
                row[ahead * m + 1 + j] -= 1
                row[ahead * m] += speed[j, 0] if timed else 0
                values.append(end[j, 0] - after[j, 0])
                rows.append(row)
            row = [arb(0)] * (self.count * m)
            row[ahead * m] += dot(surface, late) if timed else 0
            for k in range(n):
                row[ahead * m + 1 + k] += arb(surface[k])
            values.append(dot(surface, after))
            rows.append(row)
            moves.append((by_time, speed, by_state, late))
        return values, arb_mat(rows), moves

    def contracts(self, centre: list[arb], radii: list[arb]) -> bool:
        """Tell whether a box is shown to hold exactly one solution."""
        box = [arb(c.mid(), r.upper()) for c, r in zip(centre, radii, strict=True)]
        jacobian = self.equations(box)[1]
        inverse = jacobian.mid().inv().mid()
        moved = inverse * arb_mat([[f] for f in self.equations([arb(c.mid()) for c in centre])[0]])
        size = len(box)
        gap = arb_mat(size, size, 1) - inverse * jacobian
        for i in range(size):
            spread = sum((abs(gap[i, j]) * radii[j].upper() for j in range(size)), arb(0))
            if not spread + abs(moved[i, 0]) < radii[i].lower():
                return False
        return True

    def near(self, printed: list[arb]) -> list[arb]:
        """Return balls that hold exactly one solution, next to printed joints."""
        z, least = [arb(c.mid()) for c in printed], arb(2) ** (-ctx.prec // 2)
        for _ in range(12):
            f, jacobian, _ = self.equations(z)
            step = jacobian.mid().inv().mid() * arb_mat([[arb(c.mid())] for c in f])
            z = [arb((c - d).mid()) for c, d in zip(z, step.entries(), strict=True)]
            if max((abs(d) for d in step.entries()), key=float) < least:
                break
        for power in (5 * ctx.prec // 6, 2 * ctx.prec // 3):
            radii = [(1 + abs(c)).upper() * arb(2) ** -power for c in z]
            if self.contracts(z, radii):
                return [arb(c, r.upper()) for c, r in zip(z, radii, strict=True)]
        raise Undecided("one orbit in a box")

    def is_least(self, z: list[arb]) -> bool:
        """Tell whether the orbit does not repeat within its period: every joint is one that the law forces."""
        for parts in (q for q in range(2, self.count + 1) if self.count % q == 0):
            at = self.count // parts * self.m
            apart = any(not (z[at + 1 + j] - z[1 + j]).contains(0) for j in range(self.n))
            later = z[at] - z[0] - self.turn / parts
            if not (apart or (not self.autonomous and not later.contains(0))):
                return False
        return True

    # ------------------------------------------------------------------------ the law

    @cached_property
    def zeros(self) -> list[list[list[Number]]]:
        """Rows that vanish at the end of each segment: its surface, and what its mode keeps from its start."""
        found = [[self.law.surfaces[exit_]] for _, exit_, _ in self.legs]
        for i in [*range(self.count)] * 2:
            for row in self.law.surfaces.values():
                kept = is_kept(row, self.law.modes[self.legs[i][0]])
                if (
                    kept
                    and in_span(row, found[i]) is False
                    and self.vanishes_at_start(row, i, found)
                ):
                    found[i].append(row)
        return found

    def vanishes_at_start(self, row: list[Number], i: int, zeros: Any = None) -> bool:
        """Tell whether a row vanishes at the start of a segment, by what vanishes at its joint."""
        named = self.legs[i - 1][2]["map"]
        before = row if named is None else times(row, self.law.maps[named])
        return in_span(before, (zeros or self.zeros)[i - 1])

    def order(self, row: list[Number], i: int, at_end: bool) -> int:
        """Return how many derivatives of a surface vanish at an end of a segment, exactly."""
        for k in range(MOST_ORDER):
            met = in_span(row, self.zeros[i]) if at_end else self.vanishes_at_start(row, i)
            if not met:
                return k
            row = times(row, self.law.modes[self.legs[i][0]])
        raise Undecided(f"segment {i + 1} leaves a surface")

    def check_admissible(self, z: list[arb]) -> None:
        """See that the law is obeyed at every instant."""
        for i, (mode, exit_, one) in enumerate(self.legs):
            what, duration, inside = f"segment {i + 1}", self.duration(z, i), self.law.sides[mode]
            see(duration, f"{what} lasts")
            end, begun = self.extended(z, i + 1)[0], self.start(z, (i + 1) % self.count)[0]
            for name, side in one["when"].items():
                see(
                    side and side * dot(self.law.surfaces[name], end), f"{what} leads on so: {name}"
                )
            for name, side in one["after"].items():
                met = side * dot(self.law.surfaces[name], begun)
                see(side and met, f"{what} is mapped so: {name}")
            field, surfaces = self.fields[mode], self.law.surfaces
            speed = dot(surfaces[exit_], field.matrix * end)
            see(-inside[exit_] * speed, f"{what} meets its surface transversally")
            for name, side in inside.items():
                if side:
                    continue
                kept = is_kept(surfaces[name], field.rows)
                see(
                    kept and self.vanishes_at_start(surfaces[name], i),
                    f"{what} rests on {name}",
                    False,
                )
            signs = {name: side for name, side in inside.items() if side}
            self.check_inside(i, signs, duration, (self.start(z, i)[0], end))

    def check_inside(self, i: int, signs: dict[str, int], duration: arb, ends: Any) -> None:
        """See that surfaces are not met inside of a segment, on pieces on which |M tau| < 1."""
        mode, exit_, _ = self.legs[i]
        field, (w, end) = self.fields[mode], ends
        pieces = max(2, ceil(float((field.bound * duration).upper())))
        see(arb(PIECES) - pieces, "a mode is not too stiff", False)
        step = (duration / pieces).upper()
        see(duration - (pieces - 1) * step, "a segment is known well", False)
        flow = field.flow(arb(step.mid()))
        for k in range(pieces):
            terms = field.terms(w if k + 1 < pieces else end)
            for name, side in signs.items():
                row, first, last = self.law.surfaces[name], k == 0, k + 1 == pieces
                order = self.order(row, i, last) if first or (last and name == exit_) else 0
                poly, left = field.series([side * c for c in row], terms, step)
                coefficients = [c * (-1) ** (j * last) for j, c in enumerate(poly.coeffs())]
                found = arb_poly(coefficients[order:])
                left = left * step ** (TERMS + 1 - order)
                is_positive(found, step, left, f"segment {i + 1}: {name} is not met inside")
            w = flow * w

    # ------------------------------------------------------------------------ multipliers

    def characteristic(self, z: list[arb]) -> arb_poly:
        """Return the characteristic polynomial of a Poincare map, on the rows that vanish at its joint."""
        m, moves = self.m, self.equations(z)[2]
        at, total = max(range(self.count), key=lambda i: len(self.zeros[i])), arb_mat(m, m, 1)
        for i in [*range(at + 1, self.count), *range(at + 1)]:
            by_time, speed, by_state, late = moves[i]
            surface = self.law.surfaces[self.legs[i][1]]
            own = arb_mat(
                [
                    [by_time[j, 0] - speed[j, 0], *(by_state[j, k] for k in range(self.n))]
                    for j in range(self.n)
                ]
            )
            rate = dot(surface, late) + sum(
                (arb(surface[j]) * speed[j, 0] for j in range(self.n)), arb(0)
            )
            see(abs(rate), "a surface is met transversally", False)
            time = arb_mat([[arb(surface[j]) for j in range(self.n)]]) * own * (-1 / rate)
            state = own + arb_mat([[speed[j, 0]] for j in range(self.n)]) * time
            total = arb_mat([time.entries(), *state.tolist()]) * total
        late, first = self.extended(z, at + 1)[1], int(self.autonomous)
        rows = [[dot(row, late), *(arb(c) for c in row[: self.n])] for row in self.zeros[at]]
        basis = [[arb(int(j == k)) for k in range(first, m)] for j in range(first, m)]
        free = list(range(m - first))
        for row in (row[first:] for row in rows):  # which gives one coordinate by the others
            size = range(len(free))
            factors = [
                sum((c * b[f] for c, b in zip(row, basis, strict=True)), arb(0)) for f in size
            ]
            pivot = max(size, key=lambda f: float(abs(factors[f]).lower()))
            if not abs(factors[pivot]) > 0:
                continue
            for b in basis:
                share = b[pivot] / factors[pivot]
                b[:] = [
                    c - share * f
                    for k, (c, f) in enumerate(zip(b, factors, strict=True))
                    if k != pivot
                ]
            del free[pivot]
        if not free:
            return arb_poly([1])
        part = arb_mat([row[first:] for row in total.tolist()[first:]]) * arb_mat(basis)
        return arb_mat([part.tolist()[k] for k in free]).charpoly()


def is_kept(row: list[Number], matrix: list[list[Number]]) -> bool:
    """Tell whether a surface's value does not change in a mode, exactly."""
    return all(is_zero(c) for c in times(row, matrix))


def is_positive(poly: arb_poly, end: arb, left: arb, what: str) -> None:
    """See that a polynomial, but for a remainder, is positive from 0 to an end."""
    waiting = [(0, 0)]
    for level, index in waiting:  # which grows
        middle, half = end * (2 * index + 1) / 2 ** (level + 1), end / 2 ** (level + 1)
        found = poly(arb_poly([middle, 1]))(arb(0, half.upper())) + arb(0, left.upper())
        see(not found < 0, what)
        if not found > 0:
            see(level < HALVINGS and len(waiting) < PIECES, what, False)
            waiting += [(level + 1, 2 * index), (level + 1, 2 * index + 1)]


def is_inside(poly: arb_poly) -> bool:
    """Tell whether all zeros lie inside of the unit circle, or one outside (Schur, Cohn)."""
    a = [poly[k] for k in range(poly.degree() + 1)]
    while len(a) > 1:
        first, last = abs(a[0]), abs(a[-1])
        if first > last:  # the product of the zeros is larger than 1
            return False
        see(last - first, "on which side of the circle multipliers are", False)
        a = [(a[-1] * c - a[0] * d) / a[-1] for c, d in zip(a, a[::-1], strict=True)][1:]
    return True


def discs(poly: arb_poly) -> list[acb]:
    """Return a disc about each zero: of radius m |p(c_i)| / prod |c_i - c_j|, joined where they meet (Smith)."""
    m = poly.degree()
    a = [poly[k] / poly[m] for k in range(m + 1)]
    monic = [acb(c.mid()) for c in a]
    scale = (
        2 * max([float(abs(c)) ** (1 / (m - k)) for k, c in enumerate(a[:-1])], default=0) or 1.0
    )
    zeros = [acb(scale) * acb(0.4, 0.9) ** k for k in range(m)]

    def at(c: acb, given: list[Any]) -> acb:
        return sum((x * c**k for k, x in enumerate(given)), acb(0))

    for _ in range(4 * ctx.prec.bit_length() + 40 * m):
        for k, c in enumerate(zeros):
            others = prod((c - d for j, d in enumerate(zeros) if j != k), start=acb(1))
            step = (at(c, monic) / others).mid() if others != 0 else acb(0)
            zeros[k] = (c - step).mid() if step.is_finite() else c
    radii = []
    for k, c in enumerate(zeros):
        others = prod((abs(c - d) for j, d in enumerate(zeros) if j != k), start=arb(1))
        radii.append((m * abs(at(c, a)) / others).upper())
    found = [acb(arb(c.real, r), arb(c.imag, r)) for c, r in zip(zeros, radii, strict=True)]
    for _ in found:
        for k, disc in enumerate(found):
            for other in found:
                if disc.overlaps(other):
                    found[k] = disc = disc.union(other)
    return found
