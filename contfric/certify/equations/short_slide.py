r"""The equations of a chain in which a slide between two rests may have no length.

A hold is left with the acceleration a, and the slide that follows lasts d. Its end, v = 0, has the root d = 0
for every a: where the root of the branch comes to it, the chain is singular. With g the row of the velocity,
M the field of the slide, w where it starts (g w = 0) and

    phi_k(X) = (phi_{k-1}(X) - 1 / (k - 1)!) / X,    phi_0(X) = exp(X),    phi_k' = phi_k - k phi_{k+1}

the velocity is ``v(d) = d g phi_1(d M) M w``, so that ``g phi_1(d M) M w = 0`` has the root of the branch
only. What a slide leads by is, with that, ``d^3 g M (phi_3 - phi_2 / 2)(d M) M w`` times the rate of a state
by v: all that the orbit after it knows of it is of third order in d. Where the slide ends in a touch,
v' = 0, too: the derivative of ``v(d) / d`` by d, ``g M (phi_1 - phi_2)(d M) M w``, is to vanish in its place.

With these in the place of its equations the chain is regular at d = 0 (but for the parameter, whose rate is
of the order d^2 there, of d where the slide ends in a touch); for d > 0 both have the same solutions. What
rests is to stand still, and the velocity to be a state.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from flint import arb, arb_mat

from contfric.bvp.system import System
from contfric.certify.equations.chain import Chain, Segments
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector, column, zeros

#: The largest k of phi_k.
_MOST = 4


@dataclass(frozen=True)
class Form:
    """The number ``g M^power psi(d M) M w``, psi a sum of phi_1 .. phi_4 with some weights."""

    power: int
    weights: tuple[float, float, float, float]

    @property
    def derivative(self) -> Form:
        """Return its derivative by d."""
        before = (0.0, *self.weights)
        found = [c - k * before[k] for k, c in enumerate(self.weights)]
        return Form(self.power + 1, (found[0], found[1], found[2], found[3]))


#: v(d) / d, its derivative, and by how much the slide leads, over d^3.
DIVIDED = Form(0, (1, 0, 0, 0))
STEEPNESS = DIVIDED.derivative
LEAD = Form(1, (0, -0.5, 1, 0))


@dataclass(frozen=True)
class ShortSlide:
    """Which slide of a chain may have no length.

    Attributes
    ----------
    segment : its number
    state : which state is its velocity
    touches : whether it ends in a touch, after which a hold follows
    sign : of its velocity
    """

    segment: int
    state: int
    touches: bool
    sign: int

    @property
    def holds(self) -> tuple[int, ...]:
        """The holds next to it."""
        return (self.segment - 1, self.segment + 1) if self.touches else (self.segment - 1,)


def short_slide(system: System, segments: Segments, model: BallModel, i: int) -> ShortSlide | None:
    """Return segment i as a slide that may have no length, if it is one between a hold and another rest."""
    if not 0 < i < segments.count - 1 or segments.kept or segments.turn == 0.0:
        return None
    mode, exit_, pin = segments.modes[i], segments.exits[i], segments.pins[i + 1]
    left = {(h.segment, h.departs, h.leaves) for h in system.holds}
    if (i - 1, mode, exit_) not in left or any(segments.resets[i - 1 : i + 2]):
        return None
    if segments.pins[i] or (pin and (pin != (mode, exit_) or (i + 1, mode, exit_) not in left)):
        return None
    row = model.rows[exit_]
    at = next((k for k in range(model.states) if row[k] == 1), None)
    sign = int(system.layout.exit_signs[i - 1])
    surfaces = [s.name for s in system.model.surfaces]
    ends = (0,) if pin else (-sign,)
    inside = [s for k, surface, s in system.layout.interior if (k, surfaces[surface]) == (i, exit_)]
    if not inside and system.layout.exit_signs[i]:
        inside = [-int(system.layout.exit_signs[i])]
    if at is None or not sign or inside != [sign] or system.layout.exit_signs[i] not in ends:
        return None
    return ShortSlide(i, at, bool(pin), sign)


def stands_between(segments: Segments, model: BallModel, place: ShortSlide) -> bool:
    """Tell whether the matrices of a model are as the module's text asks for: exactly, at all parameters."""
    i, n, q = place.segment, model.states, place.state
    row, slopes = model.rows[segments.exits[i]], model.slopes
    if slopes is None or not all(x == int(k == q) for k, x in enumerate(row)):
        return False
    if not all(x.is_zero() for x in slopes.surfaces[segments.exits[i]].entries()):
        return False
    for own in (model, slopes):
        for rest in (segments.modes[i - 1], segments.modes[i + 1]):
            states = own.fields[rest].tolist()[:n]
            if not all(x.is_zero() for line in states for x in line):
                return False
        for k, line in enumerate(own.fields[segments.modes[i]].tolist()[:n]):
            if k != q and not all(x.is_zero() for at, x in enumerate(line) if at != q):
                return False
    return True


class ShortSlideChain(Chain):
    """The chain with these equations, at a model in balls and for some joints (z, p).

    Attributes
    ----------
    place : the slide
    """

    def __init__(
        self, segments: Segments, model: BallModel, place: ShortSlide, x: Vector, length: arb
    ) -> None:
        super().__init__(segments, model)
        self.place, self.x, self.length = place, x, length
        self.z = self.joints(x[:-1])
        self.at = self.z[place.segment]
        self.field = model.fields[segments.modes[place.segment]]
        self.start = column(model.extended(self.at[0], self.at[1:]))

    @cached_property
    def _phi(self) -> list[tuple[arb_mat, arb_mat]]:
        """phi_1(d M) .. phi_4(d M), each with its derivative by the parameter."""
        size, blocks = self.field.nrows(), _MOST + 1
        slopes = self.model.slopes
        assert slopes is not None
        by = slopes.fields[self.segments.modes[self.place.segment]] * self.length
        whole, own = blocks * size, self.field * self.length
        table = zeros(2 * whole, 2 * whole)
        for half in (0, whole):
            for a in range(size):
                table[half + a][half : half + size] = own.tolist()[a]
                for k in range(_MOST):
                    table[half + k * size + a][half + (k + 1) * size + a] = arb(1)
        for a in range(size):
            table[a][whole : whole + size] = by.tolist()[a]
        found = arb_mat(table).exp().tolist()[:size]
        starts = range(size, whole, size)
        return [
            tuple(arb_mat([row[at : at + size] for row in found]) for at in (k, whole + k))
            for k in starts
        ]

    def matrix(self, form: Form) -> tuple[arb_mat, arb_mat]:
        """Return ``M^power psi(d M) M`` of a form, and its derivative by the parameter."""
        slopes = self.model.slopes
        assert slopes is not None
        size = self.field.nrows()
        value, slope = arb_mat(size, size), arb_mat(size, size)
        for weight, (phi, by) in zip(form.weights, self._phi, strict=True):
            value, slope = value + phi * arb(weight), slope + by * arb(weight)
        field = self.field, slopes.fields[self.segments.modes[self.place.segment]]
        for _ in range(form.power):
            value, slope = field[0] * value, field[1] * value + field[0] * slope
        return value * field[0], slope * field[0] + value * field[1]

    def value(self, form: Form) -> arb:
        """Return a form's number."""
        return (self.matrix(form)[0] * self.start)[self.place.state, 0]

    def derivatives(self, form: Form) -> tuple[arb, arb, Vector, arb]:
        """Return those of a form by the time of its start, by d, by the states there, and by p."""
        model, q, t = self.model, self.place.state, self.at[0]
        matrix, slope = self.matrix(form)
        by_time = (matrix * column(model.by_time(t, 1)))[q, 0]
        by_p = (slope * self.start + matrix * column(model.by_parameter(t, 0)))[q, 0]
        return by_time, self.value(form.derivative), [matrix[q, k] for k in range(self.n)], by_p

    def _row(self, form: Form) -> Vector:
        by_time, by_length, by_state, by_p = self.derivatives(form)
        row, i = [arb(0)] * (self.size + 1), self.place.segment
        self._add(row, i, [by_time - by_length, *by_state], 1)
        row[(i + 1) * self.m] += by_length
        row[-1] += by_p
        return row

    def regular(self) -> tuple[Vector, list[Vector]]:
        """Return the residuals of the chain with these equations and the rows of their Jacobian."""
        residual, rows = self.linearised(self.x[:-1])
        i, q, m = self.place.segment, self.place.state, self.m
        for s in (i - 1, i, i + 1):
            for k in range(self.n):
                at = s * m + k
                residual[at], rows[at] = self._kept(s, k)
                if s == i and k != q:
                    value, row = self._lead(k)
                    residual[at] += value
                    rows[at] = [a + b for a, b in zip(rows[at], row, strict=True)]
        ends = [(i, DIVIDED), (i + 1, STEEPNESS)] if self.place.touches else [(i, DIVIDED)]
        for s, form in ends:
            residual[s * m + self.n], rows[s * m + self.n] = self.value(form), self._row(form)
        return residual, rows

    def _kept(self, s: int, k: int) -> tuple[arb, Vector]:
        """Return that a state is the same at both ends of a segment."""
        row, unit = [arb(0)] * (self.size + 1), [arb(int(j == k + 1)) for j in range(self.m)]
        self._add(row, s, unit, 1)
        self._add(row, s + 1, [-c for c in unit], 1)
        return self.z[s][1 + k] - self.z[s + 1][1 + k], row

    def _lead(self, k: int) -> tuple[arb, Vector]:
        """Return by how much the slide changes a state."""
        model, q, i, d = self.model, self.place.state, self.place.segment, self.length
        assert model.slopes is not None
        rate = self.field[k, q]
        rate_by = model.slopes.fields[self.segments.modes[i]][k, q]
        lead, cube = self.value(LEAD), d * d * d
        row = [rate * cube * x for x in self._row(LEAD)]
        by_length = 3 * d * d * rate * lead
        row[i * self.m] -= by_length
        row[(i + 1) * self.m] += by_length
        row[-1] += cube * rate_by * lead
        return cube * rate * lead, row

    # ------------------------------------------------------------------ along d

    @property
    def order(self) -> int:
        """With which power of d all unknowns change but the times of the slide."""
        return 1 if self.place.touches else 2

    @property
    def order_at_end(self) -> int:
        """The derivative of the acceleration that has a sign where the hold before the slide ends."""
        return 2 if self.place.touches else 1

    def scaled(self, rows: list[Vector]) -> list[Vector] | None:
        """Return the equations of the rates by d: those of all but the two times divided by ``d^order``.

        Equations that know nothing of the two times are as they are, the others divided by powers of d, too;
        None if one of the first knows of them.
        """
        i, m, n = self.place.segment, self.m, self.n
        times, found = (i * m, (i + 1) * m), [list(row) for row in rows]
        d, own = self.length, dict[int, Vector]()
        own[i * m + n] = self._scaled_end(rows[i * m + n])
        if self.place.touches:
            at = (i + 1) * m + n
            own[at] = [x if k in times else d * x for k, x in enumerate(rows[at])]
        for k in range(n):
            if k != self.place.state:
                own[i * m + k] = self._scaled_lead(rows[i * m + k], k)
        for r in range(len(found)):
            if r in own:
                found[r] = own[r]
            elif not all(found[r][at].is_zero() for at in times):
                return None
        last = [arb(0)] * (self.size + 1)
        last[times[0]], last[times[1]] = arb(-1), arb(1)
        return [*found, last]

    def _scaled_end(self, row: Vector) -> Vector:
        """Return the derivative of v(d) / d = 0; over d where its own derivative by d is 0, after a touch.

        The derivative by the start at the same d is ``g phi_1 M (M w - a)``, a at the velocity; by both
        equations ``a = - d^2 kappa`` and it is ``d kappa (1 + d (g phi_1 M)_v)``, kappa as below.
        """
        i, m, d, q = self.place.segment, self.m, self.length, self.place.state
        times = i * m, (i + 1) * m
        if not self.place.touches:
            return [x if k in times else d * d * x for k, x in enumerate(row)]
        found = list(row)
        found[times[1]] = arb(0)
        found[times[0]] = self.value(ACCELERATION) * (1 + d * self.matrix(DIVIDED)[0][q, q])
        return found

    def _scaled_lead(self, row: Vector, k: int) -> Vector:
        i, m, q, d, order = self.place.segment, self.m, self.place.state, self.length, self.order
        rate, found = self.field[k, q], list(row)
        by_time, by_length, _, _ = self.derivatives(LEAD)
        power = d if order == 2 else d * d  # d^(3 - order)
        before = arb(1) if order == 2 else d  # d^(2 - order)
        by_length = rate * (3 * before * self.value(LEAD) + power * by_length)
        found[i * m], found[(i + 1) * m] = rate * power * by_time - by_length, by_length
        return found


#: Of a slide that ends in a touch: kappa, with the acceleration - d^2 kappa where it starts; lambda, with
#: g M M w = - 2 d lambda there; and what that grows by up to its end, over d.
ACCELERATION = Form(2, (0, -1, 2, 0))
FALL = Form(2, (0, 1, -1, 0))
GROWTH = Form(2, (1, 0, 0, 0))
