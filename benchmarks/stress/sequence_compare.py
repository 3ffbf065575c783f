"""One simulation of contfric next to the reference of fifty digits: mode, surface, time, position.

An error above ``LIMIT`` sigma (:mod:`sequence_errors`) fails. What cannot be compared is counted, and the
comparison of that trajectory ends there:

``stop``
    ``|u|`` at a stop is within ``LIMIT`` sigma of S0: whether it sticks is decided by rounding.
``tangential``
    ``LIMIT`` sigma of the time of an event moves the rate there by a quarter of itself: whether the
    event takes place is decided by rounding, or nearly so.
``graze``
    contfric has an event that the reference has not, and what vanishes there is within ``LIMIT`` sigma
    of zero in fifty digits.
``leaving``
    contfric ends a slide where it starts, and both acceleration and its rate are within ``LIMIT``
    roundings of zero there: to which side it leaves is decided by rounding. Or the acceleration alone
    is, but after 1e9 periods, where it is no better known than the phase.
``start``
    ``|u|`` at the start is within ``LIMIT`` sigma of S0.
``in fifty digits``
    the reference itself meets a double root: a mass that is held exactly at S0, again and again.
``grown``
    ``LIMIT`` sigma is above 1e-3: chaos, or growth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from flint import arb
from motion import Event, Undecided, follow
from reference import Law, Slide, working_precision
from report import Tally
from sequence_cases import Case, load
from sequence_errors import EPS, Rounding, Spread

import contfric as cf
from contfric.errors import ContfricError
from contfric.simulation.simulate import Trajectory

#: Errors are of order sigma, and a decision within this many sigma is rounding's. Measured over 1.5e6
#: events: none above 2.5, one in 500 above 1.
LIMIT = 10.0
#: Where ``LIMIT`` sigma is this large a trajectory is no longer that of its start.
GROWN = 1e-3
#: A velocity of third order in time is below rounding up to its cube root.
START_RESOLUTION = 1e-5
#: contfric takes smaller accelerations for zero at a release with S = S0; a start on a surface after
#: 1e9 periods is not known as well as that.
VAGUE = 1e-13
PERIODS = 50
#: Events followed of one trajectory: 50 periods have this many at most, but where Omega is tiny.
MAX_EVENTS = 600


def compare(case: Case, tally: Tally) -> None:
    """Compare one trajectory with the reference."""
    p, start = case.params, case.start
    law, rounding = Law(**{k.replace("Omega", "omega"): v for k, v in p.items()}), Rounding(p)
    spread = rounding.start(case, law)
    tally.met("trajectories")
    if start.v == 0.0 and not start.side:
        u = load(law, start.time, start.x)
        rate = float(law.force(law.phase(arb(start.time)))[1])
        sigma = spread.along(-rate, 1.0) + rounding.load(start.x)
        if abs(float(abs(u) - law.S0)) < LIMIT * sigma:
            tally.met("undecidable: start")
            return
    try:
        motion = simulated(case)
    except ContfricError as error:
        tally.check("sequence", False, f"{error} :: {case}")
        return
    outcome = _Comparison(case, law, rounding, tally, motion, spread).run()
    tally.met(outcome)


def simulated(case: Case) -> Trajectory:
    """Return contfric's trajectory."""
    s = case.start
    return cf.simulate(
        "coulomb",
        case.params,
        state=[s.x, s.v],
        time=s.time,
        periods=PERIODS,
        events=MAX_EVENTS,
        domain=case.domain,
    )


@dataclass
class _Comparison:
    """The comparison of one trajectory."""

    case: Case
    law: Law
    rounding: Rounding
    tally: Tally
    motion: Trajectory
    spread: Spread

    def run(self) -> str:
        """Return how the comparison ended."""
        longest = PERIODS * float(self.law.period) * (1 + 1e-9)  # an event at the very end is seen
        events = follow(self.law, self.case.start, longest)
        itinerary = self.motion.itinerary
        for k in range(MAX_EVENTS):
            try:
                event = next(events)
            except Undecided:
                return self._pass("undecidable: in fifty digits")
            noise = self.rounding.event(event)
            after = self.spread.through(event, noise)
            if k == len(itinerary) or event.surface in ("held", "time"):
                return self._end(k, event, after)
            if (event.mode, event.surface) != itinerary[k] or self._apart(k, event, after):
                return self._differ(k, event)
            ended = self._measure(k, event, after)
            if ended:
                return ended
            self.spread = after
        return self._pass("ended by the number of events")

    def _pass(self, outcome: str) -> str:
        self.tally.check("sequence", True)
        return outcome

    def _fail(self, k: int, reason: str) -> str:
        self.tally.check("sequence", False, f"event {k}: {reason} :: {self.case}")
        return "ended by a failure"

    def _errors(self, k: int, event: Event) -> tuple[float, float]:
        with working_precision(self.law.bits):
            t = arb(int(self.motion.cycles[k])) * self.law.period + arb(float(self.motion.times[k]))
            dx = arb(float(self.motion.states[k, 0])) - event.x
            return abs(float(t - event.t)), abs(float(dx))

    def _apart(self, k: int, event: Event, after: Spread) -> bool:
        """Tell whether this may be another event than the reference's."""
        return self._errors(k, event)[0] > LIMIT * after.sigmas[0]

    def _measure(self, k: int, event: Event, after: Spread) -> str:
        """Compare one event; return why the comparison ends with it, or nothing."""
        (dt, dx), (st, sx) = self._errors(k, event), after.sigmas
        tangential = LIMIT * st * abs(event.bend) > abs(event.slope) / 4
        if tangential:
            return self._pass("undecidable: tangential")
        if LIMIT * max(sx, st * self.case.params["Omega"]) > GROWN:
            return self._pass("ended as grown")
        ratio = max(dt / st, dx / sx if sx > 0 else 0.0)
        self.tally.met(f"error/sigma below 2^{max(-4, math.ceil(math.log2(max(ratio, 1e-9)))):+d}")
        self.tally.largest(f"error/sigma: case {self.case.index}", ratio)
        self.tally.largest("error of time, absolute", dt)
        if ratio > LIMIT:
            return self._fail(k, f"error {dt:.2e} of time, {dx:.2e} of x; sigma {st:.2e}, {sx:.2e}")
        self.tally.check("event", True)
        if event.surface == "v":
            margin = abs(float(abs(event.u) - self.law.S0))
            doubt = after.along(event.load_rate, 1.0) + self.rounding.load(float(event.x))
            if margin < LIMIT * doubt:
                return self._pass("undecidable: stop")
        return ""

    def _end(self, k: int, event: Event, after: Spread) -> str:
        """Compare the ends: one of the two has no more events."""
        more = k < len(self.motion)
        if not more and event.surface in ("held", "time"):
            return self._pass(f"ended: {event.surface}")
        if not more:
            end = self.case.start.time + PERIODS * float(self.law.period)
            # as large as the rounding of the end itself
            slack = LIMIT * (after.sigmas[0] + EPS * end)
            if float(event.t) > end - slack:
                return self._pass("ended: time")
        return self._differ(k, event)

    def _differ(self, k: int, event: Event) -> str:
        """Say which of the two is right: a graze within the errors is either's, all else is a failure."""
        name, ours = f"{event.mode} -> {event.surface}", "nothing"
        if k < len(self.motion):
            ours = f"{' -> '.join(self.motion.itinerary[k])} with error {self._errors(k, event)[0]:.2e}"
            if self._is_leaving(k, event):
                return self._pass("undecidable: leaving")
            if self._is_graze(k, event):
                return self._pass("undecidable: graze")
        if self._event_in_doubt(event):
            return self._pass("undecidable: tangential")
        what = f"{ours} ({self.motion.end.name}), the reference has {name}"
        st = self.spread.through(event, self.rounding.event(event)).sigmas[0]
        return self._fail(k, f"{what} at t = {float(event.t)!r}, sigma {st:.2e}")

    def _event_in_doubt(self, event: Event) -> bool:
        if event.surface in ("held", "time"):
            return False
        st = self.spread.through(event, self.rounding.event(event)).sigmas[0]
        return LIMIT * st * abs(event.bend) > abs(event.slope) / 4

    def _is_leaving(self, k: int, event: Event) -> bool:
        """Tell whether a slide that contfric ends at its start is pushed by no more than rounding."""
        slide, p = event.segment, self.case.params
        if (
            not isinstance(slide, Slide)
            or self.motion.itinerary[k][0] != event.mode
            or slide.v0 != 0
        ):
            return False
        with working_precision(self.law.bits):
            f, f1, _, _ = (float(c) for c in self.law.force(slide.start_phase))
            a0 = float(slide.a0)
            start = abs(
                self._errors(k, event)[0] - event.duration
            )  # contfric's end after the start
        units = self.rounding.load(float(slide.x0)) + EPS * abs(f) + self.spread.along(-f1, 1.0)
        turn = self.rounding.fastest * (1 + self.rounding.fastest * self.spread.sigmas[0])
        rate = abs(f1 - 2 * p["zeta"] * a0)
        weak = rate < LIMIT * units * turn and start <= START_RESOLUTION
        # a start that is known no better than this may have left to the other side, and be back
        vague = units > VAGUE and start * rate <= 4 * LIMIT * units
        return abs(a0) < LIMIT * units and (weak or vague)

    def _is_graze(self, k: int, event: Event) -> bool:
        """Tell whether what vanishes at contfric's event vanishes within the errors in fifty digits."""
        segment = event.segment
        mode, surface = self.motion.itinerary[k]
        if mode != event.mode or (surface == "v") != isinstance(segment, Slide):
            return False
        with working_precision(self.law.bits):
            t = arb(int(self.motion.cycles[k])) * self.law.period + arb(float(self.motion.times[k]))
            d = t - segment.t0
            if not d > 0 or t > event.t:
                return False
            if isinstance(segment, Slide):
                at = segment.state(d)
                g, g1 = (float(c) for c in at.kernel)
                v0, a0 = float(segment.v0), float(segment.a0)
                sigma = self.spread.along(g * v0 - g1 * a0, -g)
                return abs(float(at.v)) < LIMIT * (
                    sigma + self.rounding.state(event.size, float(d))
                )
            f, f1, _, _ = self.law.force(self.law.phase(t))
            side = 1 if surface == "F+" else -1
            gap = abs(float(segment.x0 - f - side * self.law.S0))
            clock = EPS * self.rounding.period * abs(float(f1))
            return gap < LIMIT * (
                self.spread.along(0.0, 1.0) + self.rounding.load(event.size) + clock
            )
