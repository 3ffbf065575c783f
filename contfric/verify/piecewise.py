"""Orbits of piecewise-linear models, whose law the file states (:mod:`contfric.verify.law`).

An orbit is a zero of F(z), z the joints (t_i, y_i): segments lead from one to the next, on surfaces. With
C near the inverse of J = F', ``z - C F(z)`` contracts a box c + [-r, r] if ``|1 - C J| r + |C F(c)| < r``.
Flows are Taylor's series, with a bound of what is left out:

    |sum over k > p of (M tau)^k w / k!| <= (a tau)^(p + 1) / (p + 1)! exp(a tau) |w| ,    a = |M| .
"""

from __future__ import annotations

import json
from functools import cached_property
from math import ceil, log2, prod
from typing import Any

from flint import acb, acb_poly, arb, arb_mat, arb_poly, ctx, fmpq

from contfric.verify.file import BITS, CLAIMS, FORMAT, Answer
from contfric.verify.law import Law, Number, dot, in_span, is_kept, times
from contfric.verify.motion import Refused, Undecided, ball, see

PIECES, HALVINGS, TERMS = 20_000, 60, 24  # of a segment, of a piece, of a series on it
MOST_ORDER = 6  # of a zero
ENTRIES = {
    *("certificate", "format", "model", "params", "equations", "periods", "segments"),
    *("joints", "radius", "enclosure", "multipliers", "statements"),
}


def check_text(text: str) -> Answer:
    """Check the text of the certificate of an orbit of a piecewise-linear model."""
    try:
        data = json.loads(text)
        json.loads(text, object_pairs_hook=lambda p: see(len(dict(p)) == len(p), "names come once"))
        known = data["certificate"] == "orbit" and data["format"] == FORMAT
        see(known, f"it is a certificate of an orbit, of format {FORMAT}")
        see(set(data) == ENTRIES, "it states nothing else")
        why = ""
        for bits in BITS[1:]:
            with ctx.workprec(bits):
                try:
                    return Answer(True, "", tuple(_check(data)), bits)
                except (Undecided, ZeroDivisionError) as error:
                    why = str(error)
        raise Refused(f"not decided with {BITS[-1]} bits: {why}")
    except Exception as error:
        return Answer(False, str(error) if isinstance(error, Refused) else f"damaged: {error!r}")


def _check(data: Any) -> list[str]:
    claims: list[str] = data["statements"]
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
    discs_stated = data["multipliers"][:]
    stated = [acb(ball(d["re"]), ball(d["im"])) for d in discs_stated if len(d) == 2]
    if discs_stated:
        see(len(stated) == len(discs_stated) == size, "it has all multipliers")
        for disc in [*discs(found), *[acb(0)] * (size - found.degree())]:
            own = [k for k, s in enumerate(stated) if s.contains(disc)]
            see(own != [], "multipliers are in their discs", False)
            del stated[own[0]]
    count = len(chain.law.modes)
    where = f"in the law of {count} mode{'s' if count > 1 else ''} that it states"
    return [*claims, *["multipliers"] * bool(discs_stated), where]


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

    def series(self, rows: list[list[Number]], w: arb_mat, reach: arb) -> list[tuple[Any, arb]]:
        """Return Taylor's coefficients of g exp(M tau) w of rows g, and bounds of what is left, by powers."""
        terms, at, scales = [w], arb_mat([[arb(c) for c in g] for g in rows]), self.scales
        for k in range(1, TERMS + 1):
            terms.append(self.matrix * terms[-1] * (arb(1) / k))
        size = max((abs(c) / k for c, k in zip(w.entries(), scales, strict=True)), key=arb.upper)
        growth = (self.bound * reach).exp() * self.bound ** (TERMS + 1) / arb(TERMS + 2).gamma()
        values = at * arb_mat([term.entries() for term in terms]).transpose()
        weights = [
            sum((abs(c) * k for c, k in zip(g, scales, strict=True)), arb(0)) for g in at.tolist()
        ]
        return [
            (v, growth * size.upper() * a) for v, a in zip(values.tolist(), weights, strict=True)
        ]


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
        """Return what vanishes for a solution, its Jacobian, and each segment's derivatives."""
        values, rows, moves, n, m = list[arb](), list[list[arb]](), list[Any](), self.n, self.m
        for i, (mode, exit_, _) in enumerate(self.legs):
            field, surface = self.fields[mode], self.law.surfaces[exit_]
            w, rate, by = self.start(z, i)
            flow = field.flow(self.duration(z, i))
            end, (after, late) = flow * w, self.extended(z, i + 1)
            speed, by_time, by_state = field.matrix * end, flow * rate, flow * by
            ahead = (i + 1) % self.count * m
            timed = int(not self.autonomous or ahead > 0)  # else the last joint has time 0
            own = [[by_time[j, 0] - speed[j, 0], *by_state.tolist()[j][:n]] for j in range(n)]
            own += [[arb(0)] * m]
            then = [[speed[j, 0], *(arb(-int(j == k)) for k in range(n))] for j in range(n)]
            then += [[dot(surface, late), *(arb(c) for c in surface[:n])]]
            for at_start, (by_t, *by_y) in zip(own, then, strict=True):
                row = [arb(0)] * (self.count * m)
                row[i * m : i * m + m] = at_start
                for k, c in enumerate([by_t * timed, *by_y]):
                    row[ahead + k] += c
                rows.append(row)
            values += [*(end[j, 0] - after[j, 0] for j in range(n)), dot(surface, after)]
            moves.append((arb_mat(own[:n]), speed, then[n]))
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
        z, least = [arb(c.mid()) for c in printed], arb(2) ** (-5 * ctx.prec // 6)
        inverse = self.equations(z)[1].mid().inv().mid()
        for _ in range(20):
            f = arb_mat([[arb(c.mid())] for c in self.equations(z)[0]])
            step = (inverse * f).entries()
            z = [arb((c - d).mid()) for c, d in zip(z, step, strict=True)]
            if max((abs(d) for d in step), key=float) < least:
                break
        for power in (5 * ctx.prec // 6, 2 * ctx.prec // 3):
            radii = [(1 + abs(c)).upper() * arb(2) ** -power for c in z]
            if self.contracts(z, radii):
                return [arb(c, r.upper()) for c, r in zip(z, radii, strict=True)]
        raise Undecided("one orbit in a box")

    def is_least(self, z: list[arb]) -> bool:
        """Tell whether the orbit does not repeat within its period: the law forces each joint."""
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
        """Rows that vanish at the end of each segment: its surface, and what its mode keeps."""
        found = [[self.law.surfaces[exit_]] for _, exit_, _ in self.legs]
        for i in [*range(self.count)] * 2:
            for row in self.law.surfaces.values():
                kept = is_kept(row, self.law.modes[self.legs[i][0]]) and not in_span(row, found[i])
                if kept and self.vanishes_at_start(row, i, found):
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
        surfaces = self.law.surfaces
        for i, (mode, exit_, one) in enumerate(self.legs):
            what, duration, inside = f"segment {i + 1}", self.duration(z, i), self.law.sides[mode]
            see(duration, f"{what} lasts")
            end, begun = self.extended(z, i + 1)[0], self.start(z, (i + 1) % self.count)[0]
            asked = [(name, side, end) for name, side in one["when"].items()]
            asked += [(name, side, begun) for name, side in one["after"].items()]
            for name, side, state in asked:
                see(side and side * dot(surfaces[name], state), f"{what} leads on so, at {name}")
            speed = dot(surfaces[exit_], self.fields[mode].matrix * end)
            see(-inside[exit_] * speed, f"{what} meets its surface transversally")
            for name in (name for name, side in inside.items() if side == 0):
                kept = is_kept(surfaces[name], self.law.modes[mode])
                see(kept and self.vanishes_at_start(surfaces[name], i), f"{what} rests", False)
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
        rows = [[side * c for c in self.law.surfaces[name]] for name, side in signs.items()]
        for k in range(pieces if rows else 0):
            last = k + 1 == pieces
            series = field.series(rows, end if last else w, step)
            for name, (coefficients, left) in zip(signs, series, strict=True):
                at_end = last and name == exit_
                order = self.order(self.law.surfaces[name], i, last) if at_end or k == 0 else 0
                found = [c * (-1) ** (j * last) for j, c in enumerate(coefficients)][order:]
                what = f"segment {i + 1}: {name} is not met inside"
                is_positive(arb_poly(found), step, left * step ** (TERMS + 1 - order), what)
            w = flow * w

    # ------------------------------------------------------------------------ multipliers

    def characteristic(self, z: list[arb]) -> arb_poly:
        """Return the characteristic polynomial of a Poincare map, less zeros of what vanishes there."""
        m, n, moves, first = self.m, self.n, self.equations(z)[2], int(self.autonomous)
        at, total = max(range(self.count), key=lambda i: len(self.zeros[i])), arb_mat(m, m, 1)
        for i in [*range(at + 1, self.count), *range(at + 1)]:
            own, speed, (late, *slope) = moves[i]
            rate = late + sum((c * speed[j, 0] for j, c in enumerate(slope)), arb(0))
            see(abs(rate), "a surface is met transversally", False)
            time = arb_mat([slope]) * own * (-1 / rate)
            state = own + arb_mat([[speed[j, 0]] for j in range(n)]) * time
            total = arb_mat([time.entries(), *state.tolist()]) * total
        independent, exact = [self.zeros[at][0][:n]], True
        for row in (row[:n] for row in self.zeros[at]):
            exact = exact and all(isinstance(c, fmpq) for c in row)
            if exact and not in_span(row, independent):
                independent.append(row)
        part = arb_mat([row[first:] for row in total.tolist()[first:]])
        return arb_poly(part.charpoly().coeffs()[len(independent) :])


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
    """Return a disc about each zero, joined where they meet: radii m |p(c_i)| / prod |c_i - c_j| (Smith)."""
    m, roots, radii = poly.degree(), list[acb](), list[arb]()
    a = [poly[k] / poly[m] for k in range(m + 1)]
    monic, exact = acb_poly(a), acb_poly([c.mid() for c in a])
    scale = 2 * max([float(abs(c)) ** (1 / (m - k)) for k, c in enumerate(a[:-1])], default=1) or 1
    roots = [acb(scale) * acb(0.4, 0.9) ** k for k in range(m)]

    def ratio(p: acb_poly, k: int) -> acb:
        others = (roots[k] - c for j, c in enumerate(roots) if j != k)
        return p(roots[k]) / prod(others, start=acb(1))

    for _ in range(40 * m):  # Durand, Kerner
        moved = arb(0)
        for k, c in enumerate(roots):
            roots[k] = (c - ratio(exact, k).mid()).mid()
            moved = moved.max(abs(roots[k] - c) / scale)
        if moved < arb(2) ** (-2 * ctx.prec // 3):
            break
    radii = [(m * abs(ratio(monic, k))).upper() for k in range(m)]
    found = [acb(arb(c.real, r), arb(c.imag, r)) for c, r in zip(roots, radii, strict=True)]
    for k in [*range(m)] * m:
        for other in found:
            found[k] = found[k].union(other) if found[k].overlaps(other) else found[k]
    return found
