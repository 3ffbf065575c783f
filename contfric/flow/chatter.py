r"""Chatter: infinitely many impacts in finite time, and the contact that they lead to, compiled.

A mass that is pressed to a wall bounces lower and lower. Its impacts come ever faster and end at a time
``t*``, in a state ``y*`` that rests on the wall; there it stays until the force of the wall vanishes. All of
that is one segment: its mode moves by the field of contact, and begins at the state after an impact. From
``(t_0, y_0)`` the map of one flight and one impact is iterated, ``(t_n, y_n) -> (t_{n+1}, y_{n+1})``; then

    phi(t_0, y_0, d) = contact(t*, y*, d - (t* - t_0)),

also for durations d that end before ``t*``, so that Newton's method has a smooth function.

*The limit.* The map has a line of fixed points, at the speeds v = 0, with multiplier e (the restitution)
across it; so all impacts of one chatter lie on one smooth curve ``(t, y) = z(v)`` that ends in
``z(0) = (t*, y*)`` [1]_. It is found by extrapolation of the polynomial through the impacts with speeds v_i
(each at most half of the one before) to v = 0. The last two extrapolations differ by about their error; they
go on until that is rounding in the time and in all states (a state that follows quickly needs slower impacts
than the time does). No impact is needed at which rounding counts, whose share in the time of a flight is
eps / v. Where impacts pass the surface (a block that rocks) flights lie on both sides of it in turn, by two
fields: the map of two flights has that line of fixed points, with multiplier e^2, and every second impact is
on its curve.

*Derivatives* are those of the polynomial's value where its nodes move: ``sum_i w_i (dz_i - z'(v_i) dv_i)``
with Lagrange's weights w_i at 0. Those of the nodes are products of the derivatives of flights and resets.

.. [1] A. B. Nordmark, P. T. Piiroinen, Simulation and stability analysis of impacting systems with complete
   chattering, Nonlinear Dynamics 58 (2009) 85-106, who take a first-order map near the limit in its place.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contfric.compiled import allocating_helper, helper
from contfric.flow.integration.variations import FloatArray
from contfric.flow.layouts import FLOW, SECOND
from contfric.handle import TABLE, HandleType

#: By modes: the flight between the impacts (-1: no mode of chatter), observable of the gap, surface of the
#: wall, side of it on which flights are, observable of the acceleration that is positive where it is left;
#: the flight on the other side where impacts pass the surface (-1: they do not), and its acceleration.
TABLES = ("flights", "gaps", "walls", "sides", "lifts", "others", "other_lifts")
LAYOUT = {**FLOW, **SECOND, **dict.fromkeys(TABLES, TABLE)}
CHATTERING = HandleType("chattering", LAYOUT)

#: Impacts that the polynomial goes through: with speeds halved from one to the next its error falls by more
#: than a hundred for each.
_NODES = 8
#: A node has at most this share of the speed of the one before: nearer ones would cancel each other.
SHARE = 0.5
#: Extrapolations that differ by less than this, relative to the size of time and states, have rounding left.
_EXACT = 4e-16
#: What the rounding of a state is in that of the time: each flight and impact rounds it some times, and the
#: weights of the nodes add up to about three.
_STATES = 16.0
#: Where they differ by more than this the impacts converge to nothing.
_CLOSE = 1e-8
#: Impacts after which there is no limit: with a restitution of 0.99 speeds fall by a thousand in 700.
MOST_IMPACTS = 10_000
#: Impacts of which one is faster than this times the one before, after they had become slow, are not one
#: chatter: the wall, or a force, has thrown the mass off.
FASTER = 2.0
#: A speed below this share of that of the first impact, and of 1, is rest.
_REST = 1e-14
#: A flight longer than this many periods (or units of time) is not one between impacts of chatter; and where
#: impacts have not come to rest in so many periods of an excitation, a mass is thrown about (10,000 of them,
#: followed after each of its impacts, took a second).
LONGEST = 64.0


@helper
def weights_at_rest(speeds, count, weights):  # type: ignore[no-untyped-def]
    """Write Lagrange's weights at 0 of the nodes."""
    for i in range(count):
        weights[i] = 1.0
        for j in range(count):
            if j != i:
                weights[i] *= speeds[j] / (speeds[j] - speeds[i])


@helper
def extrapolated(nodes, count, weights, k):  # type: ignore[no-untyped-def]
    """Return component k of the polynomial through the nodes at 0."""
    total = 0.0
    for i in range(count):
        total += weights[i] * (nodes[i, k] - nodes[count - 1, k])
    return nodes[count - 1, k] + total


@helper
def difference(nodes, count, unit):  # type: ignore[no-untyped-def]
    """Return how much the first node matters at 0: the largest share of the size of the time or a state.

    Polynomials with and without it differ by ``[z_0, ..., z_m] prod_{i > 0} (-v_i)``, a divided difference.
    """
    speeds, largest = nodes.speeds, 0.0
    for i in range(count):
        nodes.weights[i] = 1.0
        for j in range(count):
            if j > 0:
                nodes.weights[i] *= -speeds[j]
            if j != i:
                nodes.weights[i] /= speeds[i] - speeds[j]
    for q in range(nodes.values.shape[1]):
        last, total = nodes.values[count - 1, q], 0.0
        for i in range(count - 1):
            total += nodes.weights[i] * (nodes.values[i, q] - last)
        size = unit + abs(last) if q == 0 else _STATES * (1.0 + abs(last))
        largest = max(largest, abs(total) / size)
    return largest


@helper
def slope_at_node(speeds, nodes, count, i, k):  # type: ignore[no-untyped-def]
    """Return the derivative of component k of the polynomial at node i (barycentric formula)."""
    total = 0.0
    for j in range(count):
        if j == i:
            continue
        ratio = 1.0  # of the barycentric weights of j and i
        for m in range(count):
            if m != i:
                ratio *= speeds[i] - speeds[m]
            if m != j:
                ratio /= speeds[j] - speeds[m]
        total += ratio * (nodes[j, k] - nodes[i, k]) / (speeds[j] - speeds[i])
    return -total


@helper
def flight_at(motion, mode, t, y, p, none, empty):  # type: ignore[no-untyped-def]
    """Return (flight, side) of a state after an impact, or in flight just after one."""
    side = motion.sides[mode]
    if (
        motion.others[mode] < 0
        or side * motion.rate(motion.flights[mode], motion.gaps[mode], t, y, p, none, empty) >= 0.0
    ):
        return motion.flights[mode], side
    return motion.others[mode], -side


@helper
def lift_side(motion, mode, c):  # type: ignore[no-untyped-def]
    """Return the side to which the wall is left where an observable is its acceleration; 0 of another one."""
    if c == motion.lifts[mode]:
        return motion.sides[mode]
    return -motion.sides[mode] if c == motion.other_lifts[mode] else 0


@helper
def is_left(motion, mode, t, y, p, none, empty):  # type: ignore[no-untyped-def]
    """Tell whether the wall does not press a state that rests on it."""
    side = motion.sides[mode]
    if side * motion.observe(motion.lifts[mode], t, y, p, none, empty) > 0.0:
        return True
    other = motion.other_lifts[mode]
    return other >= 0 and -side * motion.observe(other, t, y, p, none, empty) > 0.0


@allocating_helper
def fly(motion, mode, t, y, p, which, slopes):  # type: ignore[no-untyped-def]
    """Advance (t, y), just after an impact, to just after the next; return the time between, or -1.

    ``slopes`` (1 + n, 1 + n + k), the derivatives of (t, y), are advanced as well, if there are any.
    """
    n, k = y.shape[0], which.shape[0]
    c, wall = motion.gaps[mode], motion.walls[mode]
    none, empty, nothing = np.empty(0, dtype=np.int64), np.empty(0), np.empty((0, 0))
    flight, _ = flight_at(motion, mode, t, y, p, none, empty)
    level, before = motion.level(wall, p, none, empty), np.empty(n)
    unit = motion.period(p, none, empty)
    within = LONGEST * (unit if unit > 0.0 else 1.0)
    tau = motion.hit(flight, c, level, True, t, y, within, p, before)
    if not tau > 0.0:
        return -1.0
    if slopes.shape[0] == 0:
        motion.reset(wall, t + tau, before, p, none, y, nothing)
        return tau
    jac, grad, by = np.empty((n, 2 + n + k)), np.empty(1 + n + k), np.empty(k)
    motion.flow(flight, t, y, tau, p, which, before, jac)
    motion.observe(c, t + tau, before, p, which, grad)
    motion.level(wall, p, which, by)
    rate = grad[0]
    for i in range(n):
        rate += grad[1 + i] * jac[i, 1 + n]
    ends = np.empty((1 + n, slopes.shape[1]))
    for j in range(slopes.shape[1]):
        moved = grad[0] * slopes[0, j]
        if j > n:
            moved += grad[j] - by[j - 1 - n]
        for i in range(n):
            ends[1 + i, j] = jac[i, 0] * slopes[0, j] + (jac[i, j + 1] if j > n else 0.0)
            for a in range(n):
                ends[1 + i, j] += jac[i, 1 + a] * slopes[1 + a, j]
            moved += grad[1 + i] * ends[1 + i, j]
        later = -moved / rate
        ends[0, j] = slopes[0, j] + later
        for i in range(n):
            ends[1 + i, j] += jac[i, 1 + n] * later
    bounced = np.empty((n, 1 + n + k))
    motion.reset(wall, t + tau, before, p, which, y, bounced)
    for j in range(slopes.shape[1]):
        slopes[0, j] = ends[0, j]
        for i in range(n):
            slopes[1 + i, j] = bounced[i, 0] * ends[0, j] + (bounced[i, j] if j > n else 0.0)
            for a in range(n):
                slopes[1 + i, j] += bounced[i, 1 + a] * ends[1 + a, j]
    return tau


@allocating_helper
def refine_limit(motion, mode, limit, p):  # type: ignore[no-untyped-def]
    """Take what is left of the gap's rate out of a limit, along the change that an impact makes."""
    flight, c, y = motion.flights[mode], motion.gaps[mode], limit[1:]
    none, empty, nothing = np.empty(0, dtype=np.int64), np.empty(0), np.empty((0, 0))
    image = np.empty(y.shape[0])
    motion.reset(motion.walls[mode], limit[0], y, p, none, image, nothing)
    here = motion.rate(flight, c, limit[0], y, p, none, empty)
    change = here - motion.rate(flight, c, limit[0], image, p, none, empty)
    if change != 0.0:
        for i in range(y.shape[0]):
            y[i] += here / change * (image[i] - y[i])


class Nodes(NamedTuple):
    """Impacts through which a polynomial in their speed is extrapolated to rest.

    Attributes
    ----------
    speeds, values : of each, and its time and state, shapes (count,) and (count, 1 + n)
    speeds_by, values_by : their derivatives by the start, shapes (count, width) and (count, 1 + n, width)
    weights : of the extrapolation, shape (count,)
    """

    speeds: FloatArray
    values: FloatArray
    speeds_by: FloatArray
    values_by: FloatArray
    weights: FloatArray


@allocating_helper
def keep_node(nodes, count, v, t, y, slopes, side, grad):  # type: ignore[no-untyped-def]
    """Keep an impact (speed v, time t, state y after it) as the next node; return their number."""
    most, n, width = nodes.speeds.shape[0], y.shape[0], nodes.speeds_by.shape[1]
    if count == most:
        for i in range(most - 1):
            nodes.speeds[i], nodes.values[i] = nodes.speeds[i + 1], nodes.values[i + 1]
            nodes.speeds_by[i], nodes.values_by[i] = nodes.speeds_by[i + 1], nodes.values_by[i + 1]
        count -= 1
    nodes.speeds[count], nodes.values[count, 0], nodes.values[count, 1:] = v, t, y
    speed_by = nodes.speeds_by[count]
    for j in range(width):
        speed_by[j] = side * grad[0] * slopes[0, j]
        if j > n:
            speed_by[j] += side * grad[j]
        for i in range(n):
            speed_by[j] += side * grad[1 + i] * slopes[1 + i, j]
    if width > 0:
        nodes.values_by[count] = slopes
    return count + 1


@helper
def write_limit(nodes, count, limit, jac):  # type: ignore[no-untyped-def]
    """Write the extrapolated limit, with its derivatives where there is space for them."""
    weights_at_rest(nodes.speeds, count, nodes.weights)
    for q in range(limit.shape[0]):
        limit[q] = extrapolated(nodes.values, count, nodes.weights, q)
    for q in range(jac.shape[0]):
        jac[q, :] = 0.0
        for i in range(count):
            slope = slope_at_node(nodes.speeds, nodes.values, count, i, q)
            for j in range(jac.shape[1]):
                change = nodes.values_by[i, q, j] - slope * nodes.speeds_by[i, j]
                jac[q, j] += nodes.weights[i] * change


@allocating_helper
def limit_of(motion, mode, t0, y0, p, which, limit, jac):  # type: ignore[no-untyped-def]
    """Write the limit (t*, y*) of the impacts that follow one of them; return its error, or -1.

    ``jac`` (1 + n, 1 + n + k), if it has space: its derivatives by t0, y0 and the parameters.
    """
    n, k = y0.shape[0], which.shape[0]
    width, rows = (1 + n + k, 1 + n) if jac.shape[0] > 0 else (0, 0)
    t, y, grad = t0, y0.copy(), np.empty(width)
    slopes = np.zeros((rows, width))
    for i in range(rows):
        slopes[i, i] = 1.0
    nodes = Nodes(
        np.empty(_NODES),
        np.empty((_NODES, 1 + n)),
        np.zeros((_NODES, width)),
        np.zeros((_NODES, rows, width)),
        np.empty(_NODES),
    )
    none, empty, speeds = which[:0], grad[:0], nodes.speeds
    c, node_side, period = motion.gaps[mode], 0, motion.period(p, which[:0], grad[:0])
    unit, longest = (period, LONGEST * period) if period > 0.0 else (1.0, np.inf)
    count, highest, last, found, before = 0, 0.0, np.inf, False, np.inf
    for _ in range(MOST_IMPACTS):
        flight, side = flight_at(motion, mode, t, y, p, none, empty)
        v = side * motion.rate(flight, c, t, y, p, which, grad)
        thrown = v > FASTER * before and before < SHARE * highest
        highest = max(highest, abs(v))
        if not v > _REST * max(1.0, highest):  # without restitution at once
            limit[0], limit[1:] = t, y
            for i in range(rows):
                jac[i, :] = slopes[i, :]
            return 0.0 if v > -1e-6 * max(1.0, highest) else -1.0
        if thrown or t - t0 > longest:
            break
        before = v
        if count > 0 and v > speeds[count - 1]:
            count, last = 0, np.inf  # the polynomial begins anew
        if count == 0:
            node_side = side
        if count == 0 or (side == node_side and v <= SHARE * speeds[count - 1]):
            count = keep_node(nodes, count, v, t, y, slopes, side, grad)
            if count > 2:
                error = difference(nodes, count, min(unit, 1.0))
                rounding = error >= last and last <= _CLOSE
                last = error
                if error <= _EXACT or rounding:
                    found = True
                    break
        tau = fly(motion, mode, t, y, p, which, slopes)
        if not tau > 0.0:
            break
        t += tau
    if not found:
        return -1.0
    write_limit(nodes, count, limit, jac)
    refine_limit(motion, mode, limit, p)
    return last
