"""Events of a trajectory in fifty digits, each with the tangent map of its segment.

At every event the mass is at rest, so that a trajectory is a chain of maps of two numbers: time t and
position x. With the free kernel G of a slide of duration d, the accelerations ``a0``, ``a1`` at its ends
and ``v0`` at its start (0 but for the first)::

    dx1 = (G' + 2 zeta G) (dx0 - v0 dt0) - G  a0 dt0,
    dt1 = -[ -G (dx0 - v0 dt0) - G' a0 dt0 ] / a1,

and for a stick that ends at time t1 ``dx1 = dx0``, ``dt1 = dx0 / f'(t1)``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from first_root import Undecided
from flint import arb
from reference import Law, Rest, Slide, first_zero, working_precision

__all__ = ["Event", "Start", "Undecided", "follow"]

SLIDE_UP, SLIDE_DOWN, STICK = "slide+", "slide-", "stick"
#: A mass at rest that is not released within one period is never: a little more than one is proved.
HELD_PERIODS = 1.0005
Matrix = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True)
class Start:
    """Where a trajectory begins.

    Attributes
    ----------
    time, x, v : the state
    mode : ``slide+``, ``slide-`` or ``stick``
    side : +1 or -1 if it starts on ``u = +-S0``, from rest: x is then the number for which that holds
        exactly, within rounding of the one given
    """

    time: float
    x: float
    v: float
    mode: str
    side: int = 0


@dataclass(frozen=True)
class Event:
    """The end of a segment.

    Attributes
    ----------
    mode, surface : the segment's mode and the surface met; ``held`` or ``time`` if there is none
    t, x, u : time, position and load there
    duration : of the segment
    size : ``|x| + |v|`` at its start
    map : derivatives of (t, x) there with respect to (t, x) at its start
    slope, bend : rate of what vanishes at the event (v, or u), and the rate of that
    load_rate : du/dt at the event
    segment : the segment itself, to look closer
    """

    mode: str
    surface: str
    t: arb
    x: arb
    u: arb
    duration: float
    size: float
    map: Matrix
    slope: float
    bend: float
    load_rate: float
    segment: Slide | Rest


def follow(law: Law, start: Start, longest: float) -> Iterator[Event]:
    """Yield the events from a start, and last one that says why there are no more.

    Raises
    ------
    Undecided
        If the working precision does not decide what happens next.
    """
    with working_precision(law.bits):
        t, x, v = arb(start.time), arb(start.x), arb(start.v)
        end = float(t) + longest
        a0, mode, side = None, start.mode, start.side
        if side:
            x = (law.force(law.phase(t))[0] + side * law.S0).mid()
            a0 = -side * (law.S0 - law.S)
    while True:
        with working_precision(law.bits):
            left = end - float(t)
            if mode == STICK:
                event = _rest(law, t, x, side, left)
            else:
                event = _slide(law, mode, t, x, v, a0, left)
        yield event
        if event.surface in ("held", "time"):
            return
        with working_precision(law.bits):
            t, x, v, side = event.t, event.x, arb(0), 0
            mode, a0 = _next(law, event)


def _next(law: Law, event: Event) -> tuple[str, arb | None]:
    """Return the mode that follows, and the acceleration at its start where it is known exactly."""
    if event.surface == "v":
        if abs(event.u) < law.S0:
            return STICK, None
        if not abs(event.u) > law.S0:
            raise Undecided
        return (SLIDE_DOWN if event.u > 0 else SLIDE_UP), None
    # released at u = +-S0, towards the other side
    gap = law.S0 - law.S
    return (SLIDE_DOWN, -gap) if event.surface == "F+" else (SLIDE_UP, gap)


def _slide(law: Law, mode: str, t: arb, x: arb, v: arb, a0: arb | None, left: float) -> Event:
    s = 1 if mode == SLIDE_UP else -1
    slide = Slide(law, s, t, x, v, a0)
    order = leading_zeros(v, slide.a0, law.force(slide.start_phase)[1])
    d = first_zero(slide, order, left)
    size = abs(float(x)) + abs(float(v))
    if d is None:
        return _no_event(mode, "time", t, x, left, size, slide)
    at = slide.state(d)
    g, g1 = (float(k) for k in at.kernel)
    a, j = (float(k) for k in at.rates)
    v0, start_a = float(v), float(slide.a0)
    xx = g1 + 2 * float(law.zeta) * g
    matrix = ((g * -v0 / a + g1 * start_a / a, g / a), (-xx * v0 - g * start_a, xx))
    f, f1, _, _ = law.force(at.phase)
    u = (at.x - f).mid()
    return Event(
        mode, "v", (t + d).mid(), at.x.mid(), u, float(d), size, matrix, a, j, -float(f1), slide
    )


def leading_zeros(*rates: arb) -> int:
    """Return how many of a value and its derivatives vanish, exactly, before the first that does not."""
    return next((k for k, rate in enumerate(rates) if not rate.is_zero()), len(rates))


def _rest(law: Law, t: arb, x: arb, side: int, left: float) -> Event:
    """Return the end of a stick; ``side`` is that of the surface it starts on."""
    whole = float(law.period) * HELD_PERIODS
    longest, which, first = min(left, whole), 0, None
    rests = {k: Rest(law, k, t, x) for k in (1, -1)}
    _, f1, f2, _ = law.force(law.phase(t))
    for k, rest in rests.items():
        d = first_zero(rest, leading_zeros(arb(0), f1, f2) if k == side else 0, longest)
        if d is not None and (first is None or d < first):
            first, which, longest = d, k, float(d)
    size = abs(float(x))
    if first is None or float(first) > min(left, whole):
        kind = "held" if whole < left else "time"
        return _no_event(STICK, kind, t, x, min(left, whole), size, rests[1])
    t1 = (t + first).mid()
    _, f1, f2, _ = law.force(law.phase(t1))
    rate, bend = -float(f1), -float(f2)
    matrix = ((0.0, -1.0 / rate), (0.0, 1.0))
    name = "F+" if which > 0 else "F-"
    u = which * law.S0
    return Event(STICK, name, t1, x, u, float(first), size, matrix, rate, bend, rate, rests[which])


def _no_event(
    mode: str, kind: str, t: arb, x: arb, d: float, size: float, segment: Slide | Rest
) -> Event:
    unit = ((1.0, 0.0), (0.0, 1.0))
    return Event(mode, kind, (t + arb(d)).mid(), x, arb(0), d, size, unit, 1.0, 0.0, 0.0, segment)
