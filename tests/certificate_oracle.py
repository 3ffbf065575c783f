"""What a certificate file states, decided in 60 digits by brute force; and ways to falsify it.

The motion is integrated by Taylor's series of the equation of motion (mpmath), with no closed form; the
stops are found by Newton's method with differences; inequalities are sampled, multipliers are differences.
None of it is shared with the prover (exponentials in balls) or with the checker (closed forms in balls).
"""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from flint import arb, arb_poly, ctx
from mpmath import mp, mpf

DIGITS = 60
#: Bits of the sums of Taylor's series.
BITS = 230
#: Terms and longest step of Taylor's series: 0.5^70 / 70! is far below 60 digits, and so for 3 Omega = 6.
TERMS, STEP = 70, 0.5
#: Differences for derivatives.
SMALL = mpf(10) ** -25
SAMPLES = 60
#: Segments of the model.
PAIRS = [["slide+", "v"], ["slide-", "v"], ["stick", "F+"], ["stick", "F-"]]


def _mpf(x: arb) -> mpf:
    mantissa, exponent = x.mid().man_exp()
    return mp.ldexp(mpf(int(mantissa)), int(exponent))


class Truth:
    """The parameters and segments of a file in 60 digits."""

    def __init__(self, data: dict[str, Any]) -> None:
        with mp.workdps(DIGITS):
            p = {name: mpf(value) for name, value in data["params"].items()}
            self.omega, self.s, self.s0, self.h, self.zeta = (
                p[k] for k in ("Omega", "S", "S0", "h", "zeta")
            )
            self.half = bool(data["half"])
            self.turn = data["periods"] * mp.pi * (1 if self.half else 2) / self.omega
        self.segments = [tuple(row) for row in data["segments"]]

    def force(self, t: mpf, order: int = 0) -> mpf:
        shift = order * mp.pi / 2
        first = self.omega**order * mp.cos(self.omega * t + shift)
        return first + self.h * (3 * self.omega) ** order * mp.cos(3 * self.omega * t + shift)

    def step(self, sign: int, t: mpf, x: mpf, v: mpf, tau: mpf) -> tuple[mpf, mpf]:
        """One Taylor step, its sums by flint, which is fifty times faster than mpmath."""
        with ctx.workprec(BITS):
            waves = []
            for amplitude, w in ((mpf(1), self.omega), (self.h, 3 * self.omega)):
                sine, cosine = (arb(w) * arb(t)).sin_cos()
                waves.append((arb(w), (cosine, -sine, -cosine, sine), arb(amplitude)))
            c, damping, factor = [arb(x), arb(v)], 2 * arb(self.zeta), [a for *_, a in waves]
            for k in range(TERMS):
                force = sum(
                    (f * wave[k % 4] for f, (_, wave, _) in zip(factor, waves, strict=True)), arb(0)
                )
                force -= sign * arb(self.s) if k == 0 else 0
                c.append((force - c[k] - damping * (k + 1) * c[k + 1]) / ((k + 1) * (k + 2)))
                factor = [f * w / (k + 1) for f, (w, *_) in zip(factor, waves, strict=True)]
            whole = arb_poly(c)
            return _mpf(whole(arb(tau))), _mpf(whole.derivative()(arb(tau)))

    def slide(self, sign: int, t: mpf, x: mpf, tau: mpf) -> tuple[mpf, mpf, list[mpf]]:
        """Displacement and velocity after a slide, and the velocities on the way."""
        count = max(1, int(mp.ceil(abs(tau) / STEP)))
        v, passed = mpf(0), []
        for _ in range(count):
            x, v = self.step(sign, t, x, v, tau / count)
            t += tau / count
            passed.append(v)
        return x, v, passed[:-1]

    def residuals(self, i: int, t: mpf, x: mpf, end: mpf, y: mpf) -> list[mpf]:
        mode, exit_ = self.segments[i]
        if mode == "stick":
            return [x - y, y - self.force(end) - (1 if exit_ == "F+" else -1) * self.s0]
        reached, v, _ = self.slide(1 if mode == "slide+" else -1, t, x, end - t)
        return [reached - y, v]

    def joint(self, z: list[mpf], i: int) -> tuple[mpf, mpf]:
        if i < len(self.segments):
            return z[2 * i], z[2 * i + 1]
        return z[0] + self.turn, -z[1] if self.half else z[1]

    def newton(self, z: list[mpf], steps: int = 6) -> list[mpf]:
        n = len(self.segments)
        for _ in range(steps):
            f, jacobian = mp.matrix(2 * n, 1), mp.zeros(2 * n)
            for i in range(n):
                args = [*self.joint(z, i), *self.joint(z, i + 1)]
                base = self.residuals(i, *args)
                for k, r in enumerate(base):
                    f[2 * i + k] = r
                for a in range(4):
                    moved = [c + (SMALL if b == a else 0) for b, c in enumerate(args)]
                    wrap = i + 1 == n and a >= 2
                    at = (2 * i + a) % (2 * n)
                    factor = -1 if wrap and a == 3 and self.half else 1
                    for k, r in enumerate(self.residuals(i, *moved)):
                        jacobian[2 * i + k, at] += factor * (r - base[k]) / SMALL
            change = mp.lu_solve(jacobian, f)
            z = [c - d for c, d in zip(z, change, strict=True)]
            if max(abs(d) for d in change) < mpf(10) ** -45:
                return z
        raise ValueError("Newton's method does not converge")

    def admissible(self, z: list[mpf]) -> bool:
        n = len(self.segments)
        for i, (mode, exit_) in enumerate(self.segments):
            (t, x), (end, y) = self.joint(z, i), self.joint(z, i + 1)
            after = self.segments[(i + 1) % n][0]
            if self.half and i + 1 == n:
                after = {"slide+": "slide-", "slide-": "slide+"}.get(after, after)
            if end <= t:
                return False
            if mode == "stick":
                inner = [t + (end - t) * k / SAMPLES for k in range(SAMPLES)]
                out = 1 if exit_ == "F+" else -1
                if any(abs(x - self.force(s)) >= self.s0 for s in inner):
                    return False
                if -out * self.force(end, 1) <= 0 or after != ("slide-" if out > 0 else "slide+"):
                    return False
                continue
            sign = 1 if mode == "slide+" else -1
            _, _, passed = self.slide(sign, t, x, end - t)
            near = [
                self.slide(sign, t, x, (end - t) * s)[1] for s in (mpf("1e-9"), 1 - mpf("1e-9"))
            ]
            if any(sign * v <= 0 for v in [*passed, *near]):
                return False
            load = y - self.force(end)
            if after == "stick" and not abs(load) < self.s0:
                return False
            if after != "stick" and (after == mode or (load > 0) != (after == "slide-")):
                return False
            if after != "stick" and not abs(load) > self.s0:
                return False
        return True

    def repeats(self, z: list[mpf], periods: int) -> bool:
        """Tell whether a part of the period is one: its first joint comes again after it."""
        n, sign = len(self.segments), -1 if self.half else 1
        for q in (q for q in range(2, periods + 1) if periods % q == 0 == n % q):
            t, x = self.joint(z, n // q)
            if abs(t - z[0] - self.turn / q) + abs(x - sign * z[1]) < mpf(10) ** -30:
                return True
        return False

    def advance(self, t: mpf, x: mpf, ends: list[mpf]) -> tuple[mpf, mpf]:
        """Follow the segments from a start, with the ends nearby."""
        for i, (mode, _) in enumerate(self.segments):
            end = ends[i]
            for _ in range(6):
                if mode == "stick":
                    value, slope, y = self.residuals(i, t, x, end, x)[1], -self.force(end, 1), x
                else:
                    sign = 1 if mode == "slide+" else -1
                    y, value, _ = self.slide(sign, t, x, end - t)
                    slope = self.force(end) - y - 2 * self.zeta * value - sign * self.s
                end -= value / slope
            if mode != "stick":
                y = self.slide(1 if mode == "slide+" else -1, t, x, end - t)[0]
            t, x = end, y
        return t - self.turn, -x if self.half else x

    def multipliers(self, z: list[mpf]) -> list[mp.mpc]:
        ends = [self.joint(z, i + 1)[0] for i in range(len(self.segments))]
        base = self.advance(z[0], z[1], ends)
        columns = [self.advance(z[0] + SMALL, z[1], ends), self.advance(z[0], z[1] + SMALL, ends)]
        m = [[(c[k] - base[k]) / SMALL for c in columns] for k in range(2)]
        trace, det = m[0][0] + m[1][1], m[0][0] * m[1][1] - m[0][1] * m[1][0]
        root = mp.sqrt(trace**2 / 4 - det)
        return [trace / 2 + root, trace / 2 - root]


def ball(text: str) -> tuple[mpf, mpf]:
    """Return centre and radius of a ball's text."""
    centre, _, radius = text.partition("+/-")
    return mpf(centre.strip() or 0), mpf(radius.strip())


def false_statements(data: dict[str, Any]) -> list[str]:
    """Return what a file states that is not so, by brute force (uniqueness is not decided)."""
    with mp.workdps(DIGITS):
        truth = Truth(data)
        start = [mpf(c) for c in data["joints"]]
        try:
            z = truth.newton(start)
        except (ValueError, ZeroDivisionError):
            return ["exists"]
        wrong = ["period"] if truth.repeats(z, data["periods"]) else []
        radii = [mpf(r) for r in data["radius"]]
        if any(abs(a - b) > r for a, b, r in zip(z, start, radii, strict=True)):
            wrong.append("exists")
        for text, value in zip(data["enclosure"], z, strict=False):  # it may state less
            centre, radius = ball(text)
            if abs(value - centre) > radius + mpf(10) ** -40:
                wrong.append("enclosure")
        claims = data["statements"]
        if "admissible" in claims and not truth.admissible(z):
            wrong.append("admissible")
        mu = truth.multipliers(z)
        inside = all(abs(m) < 1 for m in mu)
        if ("stable" in claims and not inside) or ("unstable" in claims and inside):
            wrong.append("stable")
        return wrong + _discs(data["multipliers"], mu)


def _discs(stated: list[dict[str, str]], mu: list[mp.mpc]) -> list[str]:
    def inside(disc: dict[str, str], m: mp.mpc) -> bool:
        parts = (ball(disc["re"]), mp.re(m)), (ball(disc["im"]), mp.im(m))
        # differences of 1e-25 know a multiplier to about 1e-22
        return all(abs(value - c) <= r + mpf(10) ** -18 for (c, r), value in parts)

    if not stated:
        return []
    orders = (mu, mu[::-1])
    fits = any(all(inside(d, m) for d, m in zip(stated, order, strict=True)) for order in orders)
    return [] if fits else ["multipliers"]


# ------------------------------------------------------------------------- false certificates


def mutated(data: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Return a certificate that states something else, by one to three changes."""
    found = copy.deepcopy(data)
    for _ in range(int(rng.integers(1, 4))):
        change = _CHANGES[int(rng.integers(len(_CHANGES)))]
        change(found, rng)
        if change in (_ball_for_a_parameter, _no_number):  # others count with its numbers
            break
    return found


def _move_joint(data: dict[str, Any], rng: np.random.Generator) -> None:
    i = int(rng.integers(len(data["joints"])))
    data["joints"][i] += rng.choice([-1, 1]) * data["radius"][i] * 10 ** rng.uniform(-1, 6)


def _shrink(data: dict[str, Any], rng: np.random.Generator) -> None:
    factor = 10 ** rng.uniform(-9, 3)
    data["radius"] = [r * factor for r in data["radius"]]


def _moved(text: str, rng: np.random.Generator, least: float) -> str:
    with mp.workdps(DIGITS):
        centre, radius = ball(text)
        return f"{mp.nstr(centre + mpf(10) ** rng.uniform(least, 0), 45)} +/- {mp.nstr(radius, 5)}"


def _move_ball(data: dict[str, Any], rng: np.random.Generator) -> None:
    if data["enclosure"]:
        k = int(rng.integers(len(data["enclosure"])))
        data["enclosure"][k] = _moved(data["enclosure"][k], rng, -28)


def _move_disc(data: dict[str, Any], rng: np.random.Generator) -> None:
    if data["multipliers"]:
        disc = data["multipliers"][int(rng.integers(len(data["multipliers"])))]
        part = str(rng.choice(["re", "im"]))
        disc[part] = _moved(disc[part], rng, -17)


def _other_side(data: dict[str, Any], rng: np.random.Generator) -> None:
    other = {"stable": "unstable", "unstable": "stable"}
    data["statements"] = [other.get(claim, claim) for claim in data["statements"]]


def _other_params(data: dict[str, Any], rng: np.random.Generator) -> None:
    name = str(rng.choice(list(data["params"])))
    data["params"][name] += rng.choice([-1, 1]) * 10 ** rng.uniform(-14, -1)


def _other_segment(data: dict[str, Any], rng: np.random.Generator) -> None:
    i = int(rng.integers(len(data["segments"])))
    if rng.uniform() < 0.5 or len(data["segments"]) == 1:
        data["segments"][i] = [*PAIRS[int(rng.integers(4))]]
        return
    del data["segments"][i]
    for name in ("joints", "radius", "enclosure"):
        del data[name][2 * i : 2 * i + 2]


def _turned(data: dict[str, Any], rng: np.random.Generator) -> None:
    data["segments"] = data["segments"][1:] + data["segments"][:1]
    for name in ("joints", "radius", "enclosure"):
        data[name] = data[name][2:] + data[name][:2]


def other_turn(data: dict[str, Any], rng: np.random.Generator) -> None:
    if rng.uniform() < 0.5:
        data["half"] = not data["half"]
    else:
        data["periods"] += 1


def copied(data: dict[str, Any], count: int) -> dict[str, Any]:
    """Return a certificate of the same orbit, as one of several times its period (odd for a half)."""
    found = copy.deepcopy(data)
    turn = data["periods"] * np.pi * (1 if data["half"] else 2) / data["params"]["Omega"]
    sides = [-1 if data["half"] and k % 2 else 1 for k in range(count)]
    mirror = {"slide+": "slide-", "slide-": "slide+", "F+": "F-", "F-": "F+"}
    found["periods"] *= count
    found["segments"] = [
        [mirror.get(c, c) if side < 0 else c for c in row]
        for side in sides
        for row in data["segments"]
    ]
    found["joints"] = [
        side * c if i % 2 else c + k * turn
        for k, side in enumerate(sides)
        for i, c in enumerate(data["joints"])
    ]
    found["radius"] = [max(r, 1e-11) for r in data["radius"]] * count
    found["enclosure"] = [f"{float(c)!r} +/- 1e-10" for c in found["joints"]]
    found["multipliers"] = []
    return found


def _copied(data: dict[str, Any], rng: np.random.Generator) -> None:
    data.update(copied(data, 3 if data["half"] else int(rng.integers(2, 4))))


def _ball_for_a_parameter(data: dict[str, Any], rng: np.random.Generator) -> None:
    """State it for all values of a parameter in a ball."""
    name = str(rng.choice(list(data["params"])))
    data["params"][name] = f"{data['params'][name]!r} +/- {10.0 ** rng.uniform(-30, -3)!r}"


def _no_number(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Put what is no number, or none that can be meant, in the place of one."""
    junk = (float("nan"), float("inf"), -float("inf"), 1e308, 5e-324, 0, -1e-10, True, None, "nan")
    names = ("joints", "radius", "enclosure", "params")
    name = str(rng.choice([name for name in names if data[name]]))
    where = list(data[name]) if name == "params" else range(len(data[name]))
    data[name][where[int(rng.integers(len(where)))]] = junk[int(rng.integers(len(junk)))]


def _inverted(data: dict[str, Any], rng: np.random.Generator) -> None:
    """State the other stability, with multipliers that agree: their inverses."""
    _other_side(data, rng)
    with mp.workdps(DIGITS):
        for disc in data["multipliers"]:
            (re, r), (im, _) = ball(disc["re"]), ball(disc["im"])
            if re or im:
                other = 1 / mp.mpc(re, im)
                disc["re"] = f"{mp.nstr(other.real, 40)} +/- {mp.nstr(r, 5)}"
                disc["im"] = f"{mp.nstr(other.imag, 40)} +/- {mp.nstr(r, 5)}"


def _mirrored(data: dict[str, Any], rng: np.random.Generator) -> None:
    """The other orbit of a symmetric pair, half a period later; or a part of that is forgotten."""
    mirror = {"slide+": "slide-", "slide-": "slide+", "F+": "F-", "F-": "F+"}
    forgotten = str(rng.choice(["nothing", "time", "segments", "half of the joints"]))
    if forgotten != "segments":
        data["segments"] = [[mirror.get(c, c) for c in row] for row in data["segments"]]
    later = 0.0 if forgotten == "time" else np.pi / data["params"]["Omega"]
    count = len(data["joints"]) // (2 if forgotten == "half of the joints" else 1)
    data["joints"][:count] = [
        -c if k % 2 else c + later for k, c in enumerate(data["joints"][:count])
    ]
    data["radius"] = [max(r, 1e-11) for r in data["radius"]]
    data["enclosure"] = [f"{float(c)!r} +/- 1e-10" for c in data["joints"]]


def _later(data: dict[str, Any], rng: np.random.Generator) -> None:
    """The same orbit some periods later, or a part of one."""
    turn = 2 * np.pi / data["params"]["Omega"] * float(rng.choice([-1, 1, 0.5, rng.uniform()]))
    data["joints"] = [c if k % 2 else c + turn for k, c in enumerate(data["joints"])]
    data["radius"] = [max(r, 1e-11) for r in data["radius"]]
    data["enclosure"] = [f"{float(c)!r} +/- 1e-10" for c in data["joints"]]


def _one_more(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Cut a segment in two, or put one of no length between two."""
    i = int(rng.integers(len(data["segments"])))
    own = data["segments"][i]
    data["segments"].insert(i, own if rng.uniform() < 0.5 else [*PAIRS[int(rng.integers(4))]])
    here = data["joints"][2 * i :][:2]
    there = data["joints"][2 * i + 2 :][:2] or here
    share = float(rng.choice([0.0, 1e-9, 0.5]))
    between = [a + share * (b - a) for a, b in zip(here, there, strict=True)]
    data["joints"][2 * i + 2 : 2 * i + 2] = between
    data["radius"][2 * i + 2 : 2 * i + 2] = [1e-6, 1e-6]
    data["enclosure"][2 * i + 2 : 2 * i + 2] = [f"{float(c)!r} +/- 1e-5" for c in between]


def _backwards(data: dict[str, Any], rng: np.random.Generator) -> None:
    """The motion in the other direction of time: forces are cosines, friction and damping are not so."""
    data["segments"] = [
        [{"slide+": "slide-", "slide-": "slide+"}.get(c, c) for c in row]
        for row in data["segments"]
    ][::-1]
    pairs = list(zip(data["joints"][::2], data["joints"][1::2], strict=True))[::-1]
    data["joints"] = [c for t, x in pairs for c in (-t, x)]
    data["params"]["zeta"] *= -1
    data["enclosure"] = [f"{float(c)!r} +/- 1e-10" for c in data["joints"]]


def _exchanged(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Exchange two numbers of one kind."""
    name = str(rng.choice(["joints", "radius", "enclosure", "multipliers", "segments"]))
    if len(data[name]) > 1:
        i, k = (int(c) for c in rng.choice(len(data[name]), 2, replace=False))
        data[name][i], data[name][k] = data[name][k], data[name][i]


def _less(data: dict[str, Any], rng: np.random.Generator) -> None:
    """State less: which is true as long as the rest is."""
    name = str(rng.choice(["enclosure", "multipliers", "statements"]))
    data[name] = data[name][: int(rng.integers(len(data[name]) + 1))]


_CHANGES = (
    *(_mirrored, _later, _one_more, _backwards, _exchanged, _less),
    *(_move_joint, _shrink, _move_ball, _move_disc, _other_side, _other_params, _other_segment),
    *(_turned, other_turn, _copied, _ball_for_a_parameter, _no_number, _inverted),
)
