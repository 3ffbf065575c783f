"""The exact tangent map of the event-driven flow, joint by joint, compiled.

A joint is a point ``z = (t, y)`` where one segment ends on a surface and the next one starts. With the
flow ``phi(t_0, y_0, d)`` of the segment's mode and the surface ``g(t, y) = 0`` that it ends on, the next
joint ``(t_1, y_1)`` solves::

    y_1 = phi(t_0, y_0, t_1 - t_0),      g(t_1, y_1) = 0.

A perturbation ``(dt_0, dy_0)`` of the joint therefore becomes (implicit function theorem; phi_t, phi_y
and phi_d are the derivatives of phi)::

    a = (phi_t - phi_d) dt_0 + phi_y dy_0,       rate = g_t + g_y . phi_d,
    dt_1 = -(g_y . a) / rate,                    dy_1 = a + phi_d dt_1.

The next segment starts where this one ends, so nothing has to be added at a switch: in the coordinates
of the joint, time among them, the map is the product over the segments. (At a fixed time the same
perturbation is ``dy - f dt`` with f the field before or after the switch; the difference of the two is
the saltation matrix of P. C. Mueller, Chaos, Solitons & Fractals 5 (1995) 1671-1681, which is contained
here.) The direction of the flow, ``(1, f)``, is mapped to zero: n directions are left of 1 + n.

A reset R after the joint maps the perturbation once more, ``(dt, R_t dt + R_y dy)``: the tangent map of an
impact, with its saltation. The time of an autonomous model is no coordinate: a shift in time is mapped to
itself, with the exponent 0, and moves no state. It is left out (dt = 0), and n - 1 directions are left.

A stick forgets the velocity and passes fewer directions than a slide: the rank of the mode says how many.
``docs/lyapunov.md`` has the derivation at length, and what happens at jumps of the return map.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray, IntArray
from contfric.compiled import allocating_helper, helper
from contfric.flow.without import SINGLY
from contfric.simulation.coming_to_rest import still_bounced
from contfric.simulation.march import (
    CHATTER,
    HELD,
    HOLD_PERIODS,
    IMPOSSIBLE,
    INFINITE,
    QUIET,
    SLIDE_PERIODS,
    TOO_LARGE,
    StateWorkspace,
    copy_state,
    first_met,
    impacts_left,
    sides_after,
    whole_turns,
)
from contfric.simulation.met_together import mode_together
from contfric.simulation.sides import mode_after
from contfric.simulation.walls import (
    MOST_AT_ONCE,
    NO_FLIGHT,
    NO_TIME,
    is_crossed,
    is_pressed,
    lying_on,
    walls_of,
)

#: A transit has come to the next joint; otherwise it ended as a simulation does (HELD, IMPOSSIBLE,
#: INFINITE, QUIET, CHATTER), or the integration broke down.
ARRIVED, BROKEN = 0, 10
#: Halvings in the search of the place where the integration breaks down. A motion that has grown there by
#: this factor grows without bound in a finite time (as 1/(time left) it has grown by 1e12), and one that
#: is larger than this has grown already: levels of size 1 are rounding compared with it.
_HALVINGS, _ESCAPES, _HUGE = 40, 1e6, 1e10
#: Share of other states in a perturbation of one: not seen in its growth, and far above rounding.
_OTHERS = 1e-6
#: What a transit knows of events: how many in a row followed each other at once; what the model has; whether
#: an impact was among them; 1 + the wall that was met last, if impacts go on alike since; how many impacts to
#: come are known not to lead to rest.
EVENTS = 5
IN_A_ROW, MODEL, STRUCK, BOUNCED, LEFT = range(EVENTS)
#: What a model has, added: no excitation, walls (resets), a clock.
AUTONOMOUS, WALLS, CLOCK = 1, 2, 4


class Transit(NamedTuple):
    """A state on its way from joint to joint, with the derivative of the last segment.

    Attributes
    ----------
    y, start : state, and start (t, y) of the segment, shapes (n,) and (1 + n,)
    jac, grad : derivatives of the segment's flow and of the observable at its end
    end, image : workspace for a state and for the image of a perturbation, shape (n,)
    events : what is known of events, by ``IN_A_ROW`` and so on, shape (EVENTS,)
    ahead, meets : duration of the next segment and the surface that ends it, where they are known beforehand,
        with the state there and the derivatives; else SINGLY as the surface; shapes (1,)
    """

    y: FloatArray
    start: FloatArray
    jac: FloatArray
    grad: FloatArray
    end: FloatArray
    image: FloatArray
    events: IntArray
    ahead: FloatArray
    meets: IntArray


@helper
def set_model(transit, tables, timeless, ticks):  # type: ignore[no-untyped-def]
    """Say what a model has; ``ticks`` is the time from tick to tick of its clock, 0 without one."""
    has = WALLS * walls_of(tables)
    has += AUTONOMOUS if timeless else 0
    transit.events[MODEL] = has + (CLOCK if ticks > 0.0 else 0)


@helper
def forget_events(transit):  # type: ignore[no-untyped-def]
    """Forget the events of another solution."""
    transit.events[IN_A_ROW] = transit.events[STRUCK] = 0
    transit.events[BOUNCED] = transit.events[LEFT] = 0


@helper
def is_autonomous(transit):  # type: ignore[no-untyped-def]
    """Return whether the model has no excitation."""
    return transit.events[MODEL] & AUTONOMOUS != 0


@helper
def any_time(transit):  # type: ignore[no-untyped-def]
    """Return whether any time may pass until a motion returns: it has neither excitation nor a clock."""
    return transit.events[MODEL] & (AUTONOMOUS + CLOCK) == AUTONOMOUS


@allocating_helper
def new_transit(n):  # type: ignore[no-untyped-def]
    """Return the workspace for a transit of n states."""
    return Transit(
        np.empty(n),
        np.empty(1 + n),
        np.empty((n, 2 + n)),
        np.empty(1 + n),
        np.empty(n),
        np.empty(n),
        np.zeros(EVENTS, dtype=np.int64),
        np.zeros(1),
        np.full(1, SINGLY),
    )


@allocating_helper
def state_workspace(n):  # type: ignore[no-untyped-def]
    """Return the workspace that the search of first hits needs."""
    none, empty, nothing = np.empty(0, dtype=np.int64), np.empty(0), np.empty((0, 0))
    return StateWorkspace(none, empty, nothing, np.empty(n), np.empty(n), np.empty(1 + n))


@helper
def after_wall(functions, tables, mode, surface, following, t, p, period, transit, workspace):  # type: ignore[no-untyped-def]
    """Return (whether a wall is pressed from now on, mode that follows the impact: chatter if it rests)."""
    y, before = transit.y, workspace.after
    pressed = is_pressed(
        functions, tables, mode, surface, following, t, before, y, p, period, workspace
    )
    chatter = tables.chatters[following, surface]
    if chatter < 0:
        return pressed, following
    left = 0
    if not pressed:
        known = transit.events[BOUNCED], transit.events[LEFT]
        copy_state(before, transit.end)
        left = impacts_left(functions, tables, chatter, surface, t, y, p, period, known, workspace)
        copy_state(transit.end, before)
    transit.events[LEFT] = left
    if left == 0:
        return False, chatter
    return pressed, following


@helper
def to_joint(functions, tables, mode, on, t, p, period, transit, workspace):  # type: ignore[no-untyped-def]
    """Go on to the next joint; a surface that is only touched is passed.

    Returns
    -------
    tuple
        (outcome, surface, mode that follows, duration, periods completed, phase).
    """
    y = transit.y
    transit.start[0] = t
    for j in range(y.shape[0]):
        transit.start[1 + j] = y[j]
    duration, turns = 0.0, 0
    at_most = NO_FLIGHT if transit.events[MODEL] & WALLS != 0 else NO_TIME
    longest = (HOLD_PERIODS if tables.sliding[mode] == 1 else SLIDE_PERIODS) * period
    for k in range(tables.flights.shape[0]):
        if tables.flights[k] >= 0:  # after a wall it may begin at rest on a section
            on |= lying_on(functions, tables, t, y, p, workspace)
            break
    while True:
        tau, surface = transit.ahead[0], transit.meets[0]
        if surface == SINGLY:
            tau, surface = first_met(
                functions, tables, mode, on, t, y, p, longest, period, workspace
            )
        if surface < 0:
            held = tables.sliding[mode] != 0
            return HELD if held else QUIET, surface, mode, duration, turns, t
        copy_state(workspace.after, y)
        t, duration = t + tau, duration + tau
        more, t = whole_turns(t, period)
        turns += more
        for j in range(y.shape[0]):
            if not abs(y[j]) < TOO_LARGE:
                why = CHATTER  # flights too short to be resolved
                if transit.events[STRUCK] == 0 or transit.events[IN_A_ROW] == 0:
                    why = too_large(functions, mode, duration, p, transit, workspace)
                return why, surface, mode, duration, turns, t
        reset = tables.bounds[mode, surface] == 2
        transit.events[IN_A_ROW] = transit.events[IN_A_ROW] + 1 if tau <= at_most * period else 0
        struck = reset or (transit.events[STRUCK] != 0 and transit.events[IN_A_ROW] > 0)
        transit.events[STRUCK] = 1 if struck else 0
        if transit.events[IN_A_ROW] > MOST_AT_ONCE:
            return CHATTER if struck else IMPOSSIBLE, surface, mode, duration, turns, t
        if reset:  # the state before it stays where the hit has left it
            functions.reset(surface, t, workspace.after, p, workspace.none, y, workspace.nothing)
        code = sides_after(functions, tables, mode, surface, t, y, p, period, workspace)
        following = mode_after(tables, mode, surface, code)
        if following == -1 and not reset:
            following = mode_together(functions, tables, mode, surface, code, t, y, p, workspace)
        if following >= 0:
            pressed = False
            if reset:
                pressed, following = after_wall(
                    functions, tables, mode, surface, following, t, p, period, transit, workspace
                )
            alike = still_bounced(tables, mode, following, transit.events[BOUNCED])
            transit.events[BOUNCED] = 1 + surface if reset else alike
            why = CHATTER if pressed else ARRIVED
            return why, surface, following, duration, turns, t
        if reset or is_crossed(functions, tables, mode, surface, t, y, p, period, workspace):
            return IMPOSSIBLE, surface, mode, duration, turns, t
        on = 1 << surface
        transit.meets[0] = SINGLY  # from here on it was not asked for


@helper
def too_large(functions, mode, duration, p, transit, workspace):  # type: ignore[no-untyped-def]
    """Tell a solution that diverged, also in a finite time, from one that breaks off."""
    y, start, size = transit.y, transit.start, 0.0
    for j in range(y.shape[0]):
        if abs(y[j]) >= TOO_LARGE:
            return INFINITE
        size = max(size, abs(start[1 + j]))
    low, high, last = 0.0, 1.0, size
    for _ in range(_HALVINGS):
        middle, finite, here = 0.5 * (low + high), True, 0.0
        time = middle * duration
        functions.flow(
            mode, start[0], start[1:], time, p, workspace.none, transit.end, workspace.nothing
        )
        for j in range(y.shape[0]):
            finite = finite and abs(transit.end[j]) < TOO_LARGE
            here = max(here, abs(transit.end[j]))
        if finite:
            low, last = middle, here
        else:
            high = middle
    return INFINITE if last > min(_HUGE, _ESCAPES * (1.0 + size)) else BROKEN


@helper
def differentiate(functions, observable, mode, duration, t, p, transit, none):  # type: ignore[no-untyped-def]
    """Differentiate the segment that a transit has just finished; return the rate at its exit."""
    n = transit.y.shape[0]
    jac, grad, start = transit.jac, transit.grad, transit.start
    if transit.meets[0] == SINGLY:
        functions.flow(mode, start[0], start[1:], duration, p, none, transit.end, jac)
    met = transit.end if transit.events[MODEL] & WALLS != 0 else transit.y  # before a reset
    functions.observe(observable, t, met, p, none, grad)
    rate = grad[0]
    for k in range(n):
        rate += grad[1 + k] * jac[k, 1 + n]
    return rate


@helper
def carry_after_joint(functions, surface, t, p, frame, count, transit, workspace, reset):  # type: ignore[no-untyped-def]
    """Carry the first rows of a frame after a joint: over its reset, or in no time without one."""
    if reset:
        functions.reset(surface, t, workspace.after, p, workspace.none, transit.end, transit.jac)
        apply_reset(frame, count, transit.jac, transit.image)
    if transit.events[MODEL] & AUTONOMOUS != 0:
        for i in range(count):
            frame[i, 0] = 0.0


@helper
def apply_reset(frame, count, reset, image):  # type: ignore[no-untyped-def]
    """Replace the first rows of a frame by their images under the derivative of a reset."""
    n = image.shape[0]
    for i in range(count):
        for j in range(n):
            value = 0.0
            for k in range(n + 1):
                value += reset[j, k] * frame[i, k]
            image[j] = value
        for j in range(n):
            frame[i, 1 + j] = image[j]


@helper
def push(frame, count, rate, jac, grad, image):  # type: ignore[no-untyped-def]
    """Replace the first rows of a frame, perturbations (dt, dy), by their images."""
    n = image.shape[0]
    for i in range(count):
        along = 0.0
        for j in range(n):
            a = (jac[j, 0] - jac[j, 1 + n]) * frame[i, 0]
            for k in range(n):
                a += jac[j, 1 + k] * frame[i, 1 + k]
            image[j] = a
            along += grad[1 + j] * a
        later = -along / rate
        frame[i, 0] = later
        for j in range(n):
            frame[i, 1 + j] = image[j] + jac[j, 1 + n] * later


@helper
def orthonormalise(frame, count, growth):  # type: ignore[no-untyped-def]
    """Make the first rows orthonormal (Gram and Schmidt); write the logarithms of their lengths.

    False if a length is zero or not finite.
    """
    width = frame.shape[1]
    for i in range(count):
        for k in range(i):
            share = 0.0
            for j in range(width):
                share += frame[i, j] * frame[k, j]
            for j in range(width):
                frame[i, j] -= share * frame[k, j]
        square = 0.0
        for j in range(width):
            square += frame[i, j] * frame[i, j]
        if not 0.0 < square < np.inf:
            return False
        growth[i] = 0.5 * math.log(square)
        scale = 1.0 / math.sqrt(square)
        for j in range(width):
            frame[i, j] *= scale
    return True


@helper
def seed(frame, first):  # type: ignore[no-untyped-def]
    """Start the rows from ``first`` on as perturbations of one state each, and a little of all others.

    A mode of rest forgets some states, and as many rows as it keeps must survive it: so no two rows, and no
    sums of them, have the same share of others (squares of the numbers of entries, in radians).
    """
    width = frame.shape[1]
    for i in range(first, frame.shape[0]):
        frame[i, 0] = 0.0
        for j in range(1, width):
            others = _OTHERS * math.sin(float(i * width + j) ** 2)
            frame[i, j] = 1.0 if j == 1 + i else others
