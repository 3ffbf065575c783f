"""All zeros of the load, the velocity and their rates along a segment, in fifty digits.

Each of these is a solution of the same oscillator under another force, so that the windows of
:mod:`first_root` hold for all of them. A harmonic ``Re(e^{i p})`` of the force f becomes ``Re(c e^{i p})``:

====== =========================== ============================
 name   quantity q                  factor c at the frequency w
====== =========================== ============================
``v``   v                           1
``a``   v'                          i w
``u``   u + s S  (level too)        -2 zeta - i w
``du``  u' = v - f'                 w^2 - 2 i zeta w
====== =========================== ============================

because the windows are those of a q with ``q'' + 2 zeta q' + q`` the rate of the force. At rest the load
is ``x - f``: there f takes a level, and f' (factor ``i w``) is zero.
"""

from __future__ import annotations

from flint import arb
from motion import leading_zeros
from reference import Law, Phase, Slide, first_zero, working_precision

#: The quantity that vanishes at the extrema of another.
RATE = {"v": "a", "u": "du"}


def turned(law: Law, phase: Phase, name: str) -> list[arb]:
    """Return the phase numbers of the force after a quantity."""
    numbers: list[arb] = []
    for k in (0, 2):
        c, s = phase[k], phase[k + 1]
        w = law.omega * (1 + k)
        z = 2 * law.zeta
        real, imaginary = {
            "v": (arb(1), arb(0)),
            "a": (arb(0), w),
            "u": (-z, -w),
            "du": (w * w, -z * w),
        }[name]
        numbers += [real * c - imaginary * s, real * s + imaginary * c]
    return numbers


class OfSlide:
    """A quantity along a slide, less a level."""

    def __init__(self, slide: Slide, name: str, level: float = 0.0) -> None:
        self.slide, self.name, self.law = slide, name, slide.law
        self.windows, self.s = slide.windows, 1
        self.target = arb(level)
        self.level = self.target + slide.friction if name == "u" else self.target

    def rates(self, d: arb) -> tuple[list[arb], Phase]:
        """Return the quantity (less its level), three derivatives, and the phase."""
        law, at = self.law, self.slide.state(d)
        f, f1, f2, f3 = law.force(at.phase)
        a, j = at.rates
        if d == 0:
            a = self.slide.a0
        j2 = f2 - 2 * law.zeta * j - a
        every = {
            "v": [at.v, a, j],
            "a": [a, j, j2],
            "u": [at.x - f - self.target, at.v - f1, a - f2],
            "du": [at.v - f1, a - f2, j - f3],
        }
        return every[self.name], at.phase

    def numbers(self, d: arb) -> tuple[list[arb], arb]:
        (q, q1, _), phase = self.rates(d)
        value = q + self.level if self.name == "u" else q
        return [value, q1, *turned(self.law, phase, self.name)], self.level

    def halley(self, d: arb) -> tuple[arb, arb, arb]:
        q, q1, q2 = self.rates(d)[0]
        return q, q1, q2


class OfRest:
    """The force at rest less a level (``u``: the load takes it), or its rate (``du``)."""

    def __init__(self, law: Law, t0: arb, x0: arb, name: str, level: float = 0.0) -> None:
        self.law, self.t0, self.name = law, t0, name
        self.windows, self.s = (law.stick_windows, law.short_stick_windows), 1
        self.level = x0 - arb(level) if name == "u" else arb(0)

    def numbers(self, d: arb) -> tuple[list[arb], arb]:
        phase = self.law.phase(self.t0 + d)
        return turned(self.law, phase, "v" if self.name == "u" else "a"), self.level

    def halley(self, d: arb) -> tuple[arb, arb, arb]:
        f = self.law.force(self.law.phase(self.t0 + d))
        first = 0 if self.name == "u" else 1
        return f[first] - self.level, f[first + 1], f[first + 2]


Quantity = OfSlide | OfRest


def zeros(quantity: Quantity, on: bool, longest: float) -> list[arb]:
    """Return all zeros after the start within a duration; one at the start itself (``on``) does not count.

    Raises
    ------
    Undecided
        If the working precision does not tell how many there are.
    """
    found: list[arb] = []
    with working_precision(quantity.law.bits):
        d, order = arb(0), 0
        while True:
            rates = quantity.halley(d)
            if d == 0:  # a zero at the start is one that is said to be there, or one of all digits
                order = max(int(on), leading_zeros(*rates))
            quantity.s = 1 if rates[min(order, 2)] > 0 else -1
            root = first_zero(_Started(quantity, d, order), order, longest, d)
            if root is None or float(root) > longest:
                return found
            found.append(root)
            d, order = root, 1


class _Started:
    """A quantity that is exactly zero where a search starts (order 1): its value there is rounding."""

    def __init__(self, quantity: Quantity, start: arb, order: int) -> None:
        self.quantity, self.start, self.order = quantity, start, order
        self.s, self.windows, self.halley = quantity.s, quantity.windows, quantity.halley

    def numbers(self, d: arb) -> tuple[list[arb], arb]:
        z, level = self.quantity.numbers(d)
        if self.order and d is self.start and isinstance(self.quantity, OfSlide):
            z[0] = self.quantity.level
        return z, level
