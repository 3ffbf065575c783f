r"""The equations of the chain of segments in balls, with first and second derivatives.

The unknowns are the joints ``z_i = (t_i, y_i)``, i = 0 .. N - 1; ``z_N`` is the closure of z_0,
``(t_0 + turn T, K y_0)``, or ``(0, K y_0)`` without excitation. With ``d = t_{i+1} - t_i``,
``w_i = (y_i, 1, cos, sin ...)`` (:mod:`contfric.models.balls.model`) and ``E = exp(M d)`` the equations are

    (E w_i)_y - y_{i+1} = 0,        g w_{i+1} = 0       (g the row of the exit surface),

and for a hold (a delayed release) the condition at its start in the place of the second one. After a reset R
the segment starts at ``R w_i``. From ``dE/dd = M E`` and ``a = W phi_t + I phi_y``, W the derivative of w_i
by time, a disturbance phi of the joints changes the first by

    L = E a + M E w_i (phi_t' - phi_t) - phi_y' ,

whose derivatives are written down below; those by a parameter p come from the exponential of the block
matrix ``[[M, M_p], [0, M]] d``, whose upper right block is dE/dp (C. F. Van Loan, IEEE Trans. Automat.
Control 23 (1978) 395-404).
"""

from __future__ import annotations

from dataclasses import dataclass

from flint import arb, arb_mat

from contfric.bvp.holds import holds_of
from contfric.bvp.system import System
from contfric.certify.equations.kept import Kept, keep_residual, keep_rows
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector, column, zeros


@dataclass(frozen=True)
class Segments:
    """What the chain of a system consists of.

    Attributes
    ----------
    modes : mode of each segment
    exits : surface that each segment ends on; empty for a hold
    pins : condition at the start of each hold: a surface, or (mode, surface) whose rate vanishes; else None
    resets : surface of the reset that each segment begins after; empty without one
    closure : state matrix of the closure, whole numbers or floats
    turn : duration of a turn in periods of the excitation; 0 without excitation
    kept : what it keeps, in the place of one equation each
    images : surfaces and those that they are after half a turn, of a half problem
    """

    modes: tuple[str, ...]
    exits: tuple[str, ...]
    pins: tuple[str | tuple[str, str] | None, ...]
    resets: tuple[str, ...]
    closure: tuple[tuple[float, ...], ...]
    turn: float
    kept: tuple[Kept, ...] = ()
    images: tuple[tuple[str, str], ...] = ()

    @property
    def count(self) -> int:
        """Number of segments of one turn."""
        return len(self.modes)

    @property
    def states(self) -> int:
        """Number of states."""
        return len(self.closure)


def segments_of(system: System) -> Segments:
    """Return the chain of a system, with names in the place of its indices."""
    model, layout = system.model, system.layout
    held = {hold.segment: hold for hold in holds_of(model, system.itinerary)}
    # a hold without a pin of its own begins where the rate of the surface before it vanishes
    pins = (
        (held[i].pin or system.itinerary[i - 1]) if i in held else None
        for i in range(system.segments)
    )
    names = [s.name for s in model.surfaces]
    return Segments(
        tuple(mode for mode, _ in system.itinerary),
        tuple("" if i in held else exit_ for i, (_, exit_) in enumerate(system.itinerary)),
        tuple(pins),
        tuple(names[r] if r >= 0 else "" for r in layout.resets),
        tuple(tuple(float(c) for c in row) for row in layout.closure),
        float(layout.turn),
        images=tuple(model.symmetry.surfaces.items()) if system.half and model.symmetry else (),
    )


@dataclass(frozen=True, eq=False)
class Move:
    """One segment: its start w (after a reset), what follows from it, and derivatives.

    Attributes
    ----------
    field : the matrix M of the mode, (D, D)
    start, by_time : the start w, and its derivative by time, (D, 1)
    reset : matrix of the reset before it; None without one
    flow : exp(M d), (D, D)
    end, speed : exp(M d) w, and M times it, (D, 1)
    """

    field: arb_mat
    start: arb_mat
    by_time: arb_mat
    reset: arb_mat | None
    flow: arb_mat
    end: arb_mat
    speed: arb_mat


def block_exponential(terms: list[arb_mat], duration: arb, states: int) -> list[arb_mat]:
    """Return Taylor's coefficients by the parameter of exp(M d) from those of M.

    Mostly the harmonics depend neither on the states nor, in phases, on the parameter: then the coefficients
    of M have rows of states only, and so have those of the flow. Of all blocks but the last one the states
    are enough.

    Parameters
    ----------
    terms : M, M_p, M_pp / 2, ...
    states : how many of the rows are states
    """
    size, count = terms[0].nrows(), len(terms)
    n = states if _moves_states_only(terms, states) else size
    last, whole = n * (count - 1), zeros(n * (count - 1) + size, n * (count - 1) + size)
    for k in range(count):
        for j in range(k, count):
            rows, columns = (n, size)[k + 1 == count], (n, size)[j + 1 == count]
            for a in range(rows):
                for b in range(columns):
                    whole[k * n + a][j * n + b] = terms[j - k][a, b]
    flow = (arb_mat(whole) * duration).exp().tolist()
    found = [arb_mat([row[last:] for row in flow[last:]])]
    for k in range(count - 2, -1, -1):
        rest = zeros(size - n, size)
        found.append(arb_mat([row[last:] for row in flow[k * n : (k + 1) * n]] + rest))
    return found


def _moves_states_only(terms: list[arb_mat], states: int) -> bool:
    """Tell whether states do not drive the other rows, and only rows of states depend on the parameter."""
    first, *others = (term.tolist()[states:] for term in terms)
    driven = any(not x.is_zero() for row in first for x in row[:states])
    return not driven and all(x.is_zero() for rows in others for row in rows for x in row)


class Chain:
    """The equations of a chain at a model in balls."""

    def __init__(self, segments: Segments, model: BallModel) -> None:
        self.segments, self.model = segments, model
        self.n = segments.states
        self.m = self.n + 1
        self.size = segments.count * self.m
        self._moves: dict[int, tuple[list[Vector], Move]] = {}

    def joints(self, x: Vector) -> list[Vector]:
        """Return joints 0 .. N from the unknowns, the last one by the closure."""
        z = [x[i * self.m : (i + 1) * self.m] for i in range(self.segments.count)]
        return [*z, self._closed(z[0])]

    def _closed(self, first: Vector) -> Vector:
        turn = self.segments.turn
        time = first[0] + arb(turn) * self.model.period if turn != 0.0 else arb(0)
        return [time, *self.closed_change(first)[1:]]

    def closed_change(self, first: Vector) -> Vector:
        """Return the closure of a disturbance of the first joint."""
        lines = [zip(row, first[1:], strict=True) for row in self.segments.closure]
        state = [sum((arb(c) * y for c, y in pairs), arb(0)) for pairs in lines]
        return [first[0] if self.segments.turn != 0.0 else arb(0), *state]

    def move(self, i: int, z: list[Vector]) -> Move:
        """Return segment i of the chain with joints z; that of the last ones asked for is kept."""
        known = self._moves.get(i)
        if known is None or known[0] is not z:
            known = self._moves[i] = z, self._move(i, z)
        return known[1]

    def _move(self, i: int, z: list[Vector]) -> Move:
        model, named = self.model, self.segments.resets[i]
        t, y = z[i][0], z[i][1:]
        start, by_time = column(model.extended(t, y)), column(model.by_time(t, 1))
        reset = model.resets[named] if named else None
        if reset is not None:
            start, by_time = reset * start, reset * by_time
        field = model.fields[self.segments.modes[i]]
        flow = (field * self.duration(i, z)).exp()
        end = flow * start
        return Move(field, start, by_time, reset, flow, end, field * end)

    def duration(self, i: int, z: list[Vector]) -> arb:
        """Return the duration of segment i."""
        return z[i + 1][0] - z[i][0]

    def times_by(self, at: int, change: Vector) -> arb:
        """Return how the time of a joint changes with the unknowns and the parameter."""
        if at < self.segments.count:
            return change[at * self.m]
        if self.segments.turn == 0.0:
            return arb(0)
        assert self.model.slopes is not None
        return change[0] + arb(self.segments.turn) * self.model.slopes.period * change[-1]

    def residual(self, x: Vector) -> Vector:
        """Return the residuals of :meth:`linearised`."""
        z, found = self.joints(x), list[arb]()
        for i in range(self.segments.count):
            end = self.move(i, z).end
            found += [end[j, 0] - z[i + 1][1 + j] for j in range(self.n)]
            at, row, _ = self.condition(i)
            found.append((row * column(self.model.extended(z[at][0], z[at][1:])))[0, 0])
        return keep_residual(self.segments.kept, found, x)

    # ------------------------------------------------------------------ first derivatives

    def linearised(self, x: Vector, sigma: int = 1) -> tuple[Vector, list[Vector]]:
        """Return residuals and the rows of their Jacobian; the last column is the parameter, if one is free.

        Parameters
        ----------
        sigma : 1 or -1
            Factor of the closure in the Jacobian: -1 for a disturbance that changes sign after a turn.
        """
        z, model = self.joints(x), self.model
        residual: Vector = []
        rows = zeros(self.size, self.size + (model.slopes is not None))
        for i in range(self.segments.count):
            move, first = self.move(i, z), i * self.m
            self._flow_rows(i, move, rows[first : first + self.n], sigma)
            residual += [move.end[j, 0] - z[i + 1][1 + j] for j in range(self.n)]
            self._by_parameter(i, z, move, rows[first : first + self.n])
            value, rows[first + self.n] = self.observed(z, *self.condition(i), sigma)
            residual.append(value)
        return keep_residual(self.segments.kept, residual, x), keep_rows(self.segments.kept, rows)

    def observed(
        self, z: list[Vector], at: int, row: arb_mat, slope: arb_mat | None, sigma: int = 1
    ) -> tuple[arb, Vector]:
        """Return an observable at a joint, and its derivatives by the unknowns and the parameter.

        Parameters
        ----------
        row, slope : the observable, and its derivative by the parameter if one is free
        """
        model = self.model
        t, w = z[at][0], column(model.extended(z[at][0], z[at][1:]))
        found = [arb(0)] * (self.size + (model.slopes is not None))
        by_time = (row * column(model.by_time(t, 1)))[0, 0]
        self._add(found, at, [by_time, *(row[0, k] for k in range(self.n))], sigma)
        if slope is not None:
            found[-1] += (slope * w + row * column(model.by_parameter(t, 0)))[0, 0]
        return (row * w)[0, 0], found

    def observed_within(
        self, z: list[Vector], i: int, after: arb, row: arb_mat, slope: arb_mat
    ) -> tuple[arb, Vector, arb]:
        """Return an observable some time after the start of segment i, with its derivatives.

        They are those by the unknowns and the parameter, and by that time.
        """
        move = self.move(i, z)
        flow = (move.field * after).exp()
        end, found = flow * move.start, [arb(0)] * (self.size + 1)
        by_state = flow if move.reset is None else flow * move.reset
        on_state = row * by_state
        by_time = (row * flow * move.by_time)[0, 0]
        self._add(found, i, [by_time, *(on_state[0, k] for k in range(self.n))], 1)
        _, by_parameter, start = self._slope_of(i, z[i], after, move)
        change = by_parameter * move.start + flow * start
        found[-1] += (slope * end + row * change)[0, 0]
        return (row * end)[0, 0], found, (row * move.field * end)[0, 0]

    def condition(self, i: int) -> tuple[int, arb_mat, arb_mat | None]:
        """Return the last equation of a segment: at which joint which row vanishes, and its slope."""
        pin, model = self.segments.pins[i], self.model
        name = pin if isinstance(pin, str) else pin[1] if pin else self.segments.exits[i]
        row, slopes = model.surfaces[name], model.slopes
        slope = slopes.surfaces[name] if slopes else None
        if isinstance(pin, tuple):  # the rate along the mode before
            field = model.fields[pin[0]]
            if slopes is not None and slope is not None:
                slope = slope * field + row * slopes.fields[pin[0]]
            row = row * field
        return (i if pin else i + 1), row, slope

    def _add(self, row: Vector, joint: int, values: Vector, sigma: int) -> None:
        """Add derivatives by a joint to a row; those by the last one go to the first one."""
        if joint < self.segments.count:
            for k, value in enumerate(values):
                row[joint * self.m + k] += value
            return
        turn, closure = self.segments.turn, self.segments.closure
        if turn != 0.0:
            row[0] += sigma * values[0]
            if self.model.slopes is not None:
                row[-1] += values[0] * arb(turn) * self.model.slopes.period
        for k in range(self.n):
            for j in range(self.n):
                row[1 + k] += sigma * arb(closure[j][k]) * values[1 + j]

    def _flow_rows(self, i: int, move: Move, rows: list[Vector], sigma: int) -> None:
        n = self.n
        late = move.flow * move.by_time - move.speed
        by_state = move.flow if move.reset is None else move.flow * move.reset
        for j in range(n):
            own = [late[j, 0], *(by_state[j, k] for k in range(n))]
            self._add(rows[j], i, own, sigma)
            other = [move.speed[j, 0], *(arb(-1 if k == j else 0) for k in range(n))]
            self._add(rows[j], i + 1, other, sigma)

    def _slope_of(
        self, i: int, joint: Vector, duration: arb, move: Move
    ) -> tuple[arb_mat, arb_mat, arb_mat]:
        """Return the derivatives by the parameter of M, of exp(M d) at fixed d, and of the start."""
        model = self.model
        assert model.slopes is not None
        mode = self.segments.modes[i]
        slope = model.slopes.fields[mode]
        if all(x.is_zero() for x in slope.entries()):  # rest, in phases
            flow = slope
        else:
            flow = block_exponential([model.fields[mode], slope], duration, self.n)[1]
        start = column(model.by_parameter(joint[0], 0))
        if move.reset is not None:
            before = column(model.extended(joint[0], joint[1:]))
            start = move.reset * start + model.slopes.resets[self.segments.resets[i]] * before
        return slope, flow, start

    def _by_parameter(self, i: int, z: list[Vector], move: Move, rows: list[Vector]) -> None:
        if self.model.slopes is None:
            return
        _, flow, start = self._slope_of(i, z[i], self.duration(i, z), move)
        change = flow * move.start + move.flow * start
        for j in range(self.n):
            rows[j][-1] += change[j, 0]

    # ------------------------------------------------------------------ second derivatives

    def bent(
        self, x: Vector, phi: Vector, sigma: int, turned: Vector | None = None
    ) -> list[Vector]:
        """Return the derivative of ``J_sigma(x) phi`` by unknowns and parameter, phi held fixed.

        Parameters
        ----------
        turned : the disturbance of the last joint, where it is another one than sigma times the closure of
            phi
        """
        z = self.joints(x)
        step = [phi[i * self.m : (i + 1) * self.m] for i in range(self.segments.count)]
        step.append(turned or [sigma * c for c in self.closed_change(step[0])])
        rows = zeros(self.size, self.size + 1)
        for i in range(self.segments.count):
            first = i * self.m
            self._bent_flow(i, z, step, rows[first : first + self.n])
            at, row, slope = self.condition(i)
            t, change = z[at][0], step[at]
            last, model = rows[first + self.n], self.model
            twice = (row * column(model.by_time(t, 2)))[0, 0] * change[0]
            self._add(last, at, [twice, *[arb(0)] * self.n], 1)
            assert slope is not None
            disturbed = column(self._disturbed(t, change))
            mixed = column([change[0] * c for c in model.by_parameter(t, 1)])
            last[-1] += (slope * disturbed + row * mixed)[0, 0]
        return keep_rows(self.segments.kept, rows, 2)

    def _disturbed(self, t: arb, change: Vector) -> Vector:
        """Return what a disturbance of a joint changes in the extended state."""
        found = [change[0] * c for c in self.model.by_time(t, 1)]
        for k in range(self.n):
            found[k] += change[1 + k]
        return found

    def _bent_flow(self, i: int, z: list[Vector], step: list[Vector], rows: list[Vector]) -> None:
        """Write the derivatives of L of the module's text."""
        move, model, t = self.move(i, z), self.model, z[i][0]
        late, delta = step[i][0], step[i + 1][0] - step[i][0]
        a, again = column(self._disturbed(t, step[i])), column(model.by_time(t, 2))
        slope, flow, start = self._slope_of(i, z[i], self.duration(i, z), move)
        mixed, state = column([late * c for c in model.by_parameter(t, 1)]), move.flow
        if move.reset is not None:
            assert model.slopes is not None
            mixed = move.reset * mixed + model.slopes.resets[self.segments.resets[i]] * a
            a, again, state = move.reset * a, move.reset * again, move.flow * move.reset
        later = move.field * (move.flow * a) + move.field * move.speed * delta  # dL/dd
        early = move.flow * again * late  # dL/dt at fixed d
        early = early + move.field * (move.flow * move.by_time) * delta
        by_state = move.field * state * delta
        own = slope * move.end + move.field * (flow * move.start + move.flow * start)
        by_parameter = flow * a + move.flow * mixed + own * delta
        for j in range(self.n):
            own_row = [early[j, 0] - later[j, 0], *(by_state[j, k] for k in range(self.n))]
            self._add(rows[j], i, own_row, 1)
            self._add(rows[j], i + 1, [later[j, 0], *[arb(0)] * self.n], 1)
            rows[j][-1] += by_parameter[j, 0]
