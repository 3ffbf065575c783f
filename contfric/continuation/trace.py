"""One branch, traced in both directions from its start to its ends.

At a corner two branches of one itinerary meet, and a march goes on from one to the other. At the end of a
continuum (Omega = 1/2, no damping) a margin falls to zero along one branch, and grows again along another
one of the same itinerary: the equations left over begin with a quadratic form, of which each is one line
(:mod:`contfric.atlas.leaving.families`). No test changes its sign there. Newton's method sees a hyperbola
that is as wide as rounding makes it, and steps that are short enough turn with it. What is smooth turns in
proportion to the step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.bvp.system import Margin
from contfric.continuation.assembly import assemble, join
from contfric.continuation.branch import Branch
from contfric.continuation.ends.at_events import (
    AT_END,
    end_at_resonance,
    endless,
    grows,
    lost_in_end,
    never_leaves,
    only_lengthens,
    slows_down,
)
from contfric.continuation.ends.at_range import is_at_limit, limit_end
from contfric.continuation.ends.at_values import stop_among
from contfric.continuation.ends.at_vertices import Overshoot, end_stalled, overshoots_vertex
from contfric.continuation.events_of_step import end_of_holds, resolve
from contfric.continuation.families.vertical import VerticalFamily, family_near
from contfric.continuation.half_branch import CHUNK, Side, first_point
from contfric.continuation.located_event import ROUGH
from contfric.continuation.locating.sliding import met_together
from contfric.continuation.moving_joints import move_joints
from contfric.continuation.points import FIRST_STEP, MOST_POINTS, Point, Settings, settings_of
from contfric.continuation.start import start_of, too_fast
from contfric.errors import ConvergenceError, function_of
from contfric.events.bifurcation import TERMINAL, Bifurcation, End, EndReason
from contfric.orbit.orbit import Orbit
from contfric.remember.advance import foresee, foreseeable
from contfric.remember.journal import remembered

#: A step this short after hundreds of points (arclength) gets nowhere.
_CRAWLS = 1e-6

Progress = Callable[[str], None]
#: A turn (rad) over a step (arclength) that no smooth branch makes: steps are chosen to turn by 0.12, and
#: those that do within hundreds of roots of rounding have a radius of less than 1e-4.
_TURN, _STEP = 0.12, 1e-5
#: Distance from the start of a side below which the step control has not found its step yet.
_START = 10.0 * _STEP
#: Share of what a margin was along the side that is left of it where it vanishes; and the most that is left,
#: at the tip of a hyperbola as wide as rounding makes it: some hundreds of units of rounding come together in
#: a margin. Where margins stay above, steps are short for another reason.
_FALLEN, _LEFT = 1e-2, 1e3 * float(np.finfo(float).eps)


def continue_orbit(
    orbit: Orbit,
    parameter: str,
    range: tuple[float, float],
    *,
    max_step: float | None = None,
    stability: bool = True,
    max_points: int = MOST_POINTS,
    stop_at: Mapping[Any, float] | None = None,
    progress: Progress | None = None,
) -> Branch:
    """Continue an orbit in one parameter, in both directions, to the ends of its branch.

    Folds, branch points, period doublings and tangencies are passed; a sliding event ends it.

    Parameters
    ----------
    parameter : str
        Name of the parameter, such as ``"Omega"``.
    range : (float, float)
        Where it may go; clipped to the model's limits.
    max_step : float, optional
        Largest step along the branch, as a share of the range (times 1 + the size of the
        state); that of the model by default. If it declares none 0.01, or 0.1 where orbits are smooth
        all along and no surface is near, so that steps follow the curvature.
    stability : bool
        Whether multipliers are evaluated; without them PD is not detected, nor BP where no
        asymmetric branch turns.
    max_points : int
        Largest number of points of each half-branch; a branch that reaches it says so.
    stop_at : mapping, optional
        Quantities by name, as expressions or as functions of an orbit, and a value of each, such as
        ``{"x_max": 1.4}``: a branch ends where the first of them is taken, exactly there, with the reason
        STOP.

    Returns
    -------
    Branch
        With k points: ``values`` of the parameter, shape (k,), ``multipliers``, shape (k, n), each
        ``branch[i]`` an orbit; ``bifurcations`` in order, and two ``ends`` with their reasons.

    Raises
    ------
    ParameterError
        If the parameter, the range or the step is not valid.
    ConvergenceError
        If the orbit is not solved, or has no unique continuation.

    Notes
    -----
    Ctrl-C ends the branch where it is, with the reason INTERRUPTED.

    What detection cannot see: two events of the same kind within one step, if a parabola through three
    values of the test function has no zero there. A smaller ``max_step`` shows them.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> [end.reason.name for end in cf.continue_orbit(orbit, "Omega", (0.4, 0.6)).ends]
    ['SS', 'CS']
    """
    function_of("progress", progress)
    settings = settings_of(orbit, parameter, range, max_step, stability, max_points, stop_at)
    return follow_orbit(orbit, settings, progress, keep=True)


def follow_orbit(
    orbit: Orbit, settings: Settings, progress: Progress | None = None, *, keep: bool = False
) -> Branch:
    """Continue an orbit both ways, as :func:`continue_orbit` does; ``keep`` is that of :func:`trace_side`."""
    if not orbit.converged:
        raise ConvergenceError(f"the orbit is not solved: {orbit.status.value}", orbit)
    try:
        orbit, start = start_of(orbit, settings)
    except ConvergenceError:
        family = family_near(orbit, orbit.model.index_of(settings.parameter))
        branch = None if family is None else follow_family(family, settings, progress, keep=keep)
        if branch is None:
            raise
        return branch
    return _both_ways(orbit, start, settings, progress, keep)


def follow_family(
    family: VerticalFamily,
    settings: Settings,
    progress: Progress | None = None,
    *,
    keep: bool = False,
) -> Branch | None:
    """Trace a family of orbits at one value of the parameter, along another one in which it is regular."""
    inside = family.settings(settings)
    start = first_point(family.orbit, inside, family.along, 0.0)
    if start is None:
        return None
    return family.at_its_value(_both_ways(family.orbit, start, inside, progress, keep))


def _both_ways(
    orbit: Orbit, start: Point, settings: Settings, progress: Progress | None, keep: bool
) -> Branch:
    """Follow a branch from a point to both of its ends."""
    foresee(trace_side, orbit, start.reversed(), settings, keep=keep)
    ahead = trace_side(orbit, start, settings, progress=progress, keep=keep)
    if ahead.end.reason in (EndReason.CLOSED, EndReason.INTERRUPTED):
        return assemble(orbit, settings, ahead, End(ahead.end.reason))
    behind = trace_side(orbit, start.reversed(), settings, progress=progress, keep=keep)
    return join(orbit, settings, behind, ahead)


def _went_to_its_end(side: Side) -> bool:
    return side.end.reason is not EndReason.INTERRUPTED


@remembered(finished=_went_to_its_end)
@foreseeable(without=("progress", "keep"))
def trace_side(
    orbit: Orbit,
    start: Point,
    settings: Settings,
    *,
    first_step: float = FIRST_STEP,
    at_event: bool = False,
    progress: Progress | None = None,
    keep: bool = False,
) -> Side:
    """Follow a branch from a point along its tangent until it ends.

    ``at_event`` says that the point is at a sliding event, to which smooth events in the same location
    belong. With ``keep`` Ctrl-C ends the side where it is, with the reason INTERRUPTED. Without it is passed
    on: who traces sides one after the other must not take the end of one for an answer.
    """
    side = Side.starting(start, orbit.system, End(EndReason.START), settings.stability)
    side.at_event = at_event
    step = first_step * settings.largest
    while True:
        try:
            finished, step = _advance(orbit, side, settings, step)
        except KeyboardInterrupt:
            if not keep:
                raise
            side.end = End(EndReason.INTERRUPTED)
            return side
        if progress is not None:
            progress(f"{side.count} points, {settings.parameter} = {side.tip.value:.6g}")
        if finished:
            may_be = side.autonomous and side.end.reason in _MAY_BE_ENDLESS
            if may_be and (end := endless(_tip(orbit, side, settings))):
                side.end = end
            if side.end.reason is EndReason.SINGULAR and only_lengthens(side, settings, AT_END):
                side.end = End(EndReason.PERIOD)
            if side.end.reason is EndReason.PERIOD:
                last, events = _tip(orbit, side, settings), side.bifurcations
                while events and lost_in_end(events[-1], last, settings.parameter, settings.width):
                    events.pop()
            side.rows = side.rows.first(side.last + 1)
            return side


#: What the end at an equilibrium may look like: there every rate vanishes, and so do conditions on them.
_MAY_BE_ENDLESS = frozenset(
    EndReason[name]
    for name in ("PERIOD", "STEP", "BROKEN", "SINGULAR", *(k.name for k in TERMINAL))
)
#: Why an orbit with chatter is not finite beyond a point.
_NO_REST = "incomplete chatter: beyond this point the impacts do not come to rest"


def _advance(orbit: Orbit, side: Side, settings: Settings, step: float) -> tuple[bool, float]:
    """March once and deal with what stopped it; (whether the side is finished, next step)."""
    from contfric.continuation.core import march as kernels

    if side.count >= settings.most_points:
        side.end = End(EndReason.POINTS)
        return True, step
    count = side.count
    why, step = side.march(orbit, settings, step)
    overshoot = overshoots_vertex(orbit, side, settings, side.count - count)
    if overshoot is not Overshoot.NONE:
        kept = side.count - count
        stopped = bool(settings.stop_at) and stop_among(orbit, side, settings, kept, side.last)
        return stopped or overshoot is Overshoot.ENDED, step
    ended = ends_at_corner(orbit, side, settings, side.count - count)
    if not ended and why == kernels.EVENT and only_lengthens(side, settings):
        side.drop_tip()
        side.end, ended = End(EndReason.PERIOD), True
    # what is in the last step may come first
    unresolved = not ended and why in (kernels.EVENT, kernels.OUTSIDE)
    last, fresh = side.last - int(unresolved), side.count - count
    stopped = bool(settings.stop_at) and stop_among(orbit, side, settings, fresh, last)
    if stopped or ended:
        return True, step
    if why == kernels.FULL and _crawls(side):
        why = kernels.STEP
    if why in (kernels.STEP, kernels.BROKEN) and move_joints(orbit, side, settings):
        return False, FIRST_STEP * settings.largest
    reasons = {
        kernels.STEP: EndReason.STEP,
        kernels.BROKEN: EndReason.BROKEN,
        kernels.CLOSED: EndReason.CLOSED,
        kernels.UNBOUNDED: EndReason.UNBOUNDED,
        kernels.ENDLESS: EndReason.PERIOD,
        kernels.MORE: EndReason.WORK,
    }
    if why in reasons:
        side.end = End(reasons[why])
        if why == kernels.BROKEN and any(
            m in orbit.model.chatter_by_mode for m, _ in orbit.itinerary
        ):
            side.end = End(EndReason.BROKEN, _NO_REST)
        elif why == kernels.BROKEN:
            side.end = End(EndReason.BROKEN, too_fast(_tip(orbit, side, settings)))
        if why in (kernels.STEP, kernels.BROKEN) and is_at_limit(side.tip.value, settings):
            side.end = limit_end(side.tip.value, settings)
        elif why in (kernels.STEP, kernels.BROKEN) and never_leaves(_tip(orbit, side, settings)):
            side.end = End(EndReason.REST)
        elif why == kernels.STEP and not end_of_holds(orbit, side, settings, True):
            end_stalled(orbit, side, settings)
        if side.end.reason in (EndReason.STEP, EndReason.BROKEN) and slows_down(side, settings):
            side.end = End(EndReason.PERIOD)
        elif side.end.reason is EndReason.STEP:
            side.end = end_at_resonance(side, settings) or side.end
        return True, step
    if why == kernels.FULL and grows(side, settings):
        side.end = End(EndReason.UNBOUNDED)
        return True, step
    if why == kernels.FULL:
        return end_of_holds(orbit, side, settings, step < _CRAWLS), step
    return resolve(orbit, side, settings), step


def _crawls(side: Side) -> bool:
    """Tell whether hundreds of steps have got nowhere: Newton's method fails by rounding at longer ones."""
    arc = side.rows.arc
    return side.last + 1 >= CHUNK and float(arc[side.last] - arc[1]) < CHUNK * _CRAWLS


def _tip(orbit: Orbit, side: Side, settings: Settings) -> Orbit:
    """Return the last orbit of a side."""
    return side.tip.orbit(orbit, orbit.model.index_of(settings.parameter))


def ends_at_corner(orbit: Orbit, side: Side, settings: Settings, fresh: int) -> bool:
    """End a side at the first corner among its last points, if there is one at which a margin vanishes.

    Parameters
    ----------
    fresh : number of points that are new
    """
    rows, last = side.rows, side.last
    first = max(0, last - fresh)
    steps = rows.arc[first + 1 : last + 1] - rows.arc[first:last]
    started = rows.arc[first:last] - side.first.arc > _START
    short, touches = (steps < _STEP) & started, _touches(side, orbit, first) & started
    if not (short | touches).any():
        return False
    turns = _turns(side, first, settings.scale) > _TURN
    for k in first + np.flatnonzero((short & turns) | touches):
        tip = rows.point(int(k))
        found = met_together(orbit, tip, settings)
        if found is None or not _has_fallen(side, orbit, int(k), found):
            continue
        if touches[k - first]:
            change = _left_over(side, orbit, int(k), found)
        else:  # it lies within the step over which the branch turns, on either of the two ways
            size = orbit.model.size_of(orbit.model.index_of(settings.parameter), tip.value)
            step, change = float(steps[k - first]), float(rows.w[k + 1, 0] - tip.value)
            change = max(abs(change), step * abs(tip.slope)) + step**2 * size
        known = max(ROUGH, 2.0 * change / settings.width)
        side.rewind(int(k))
        side.end = End(EndReason[found.kind.name], bifurcation=replace(found, bound=known))
        return True
    return False


def _turns(side: Side, first: int, scale: float) -> FloatArray:
    """Return by how much (rad) a side turns over each of its steps from a row on."""
    rows, last = side.rows, side.last
    z, w = rows.tangents[first : last + 1], rows.directions[first : last + 1, 0]
    along = np.sum(z[1:] * z[:-1], axis=(1, 2)) / z.shape[1] + w[1:] * w[:-1] * scale
    angles: FloatArray = np.arccos(np.clip(along, -1.0, 1.0))
    return angles


def _touches(side: Side, orbit: Orbit, first: int) -> NDArray[np.bool_]:
    """Tell for each step from a row on whether a margin is zero where it begins, and at no point next to it.

    A point may lie at the very corner, by chance: steps on either side of it need not be short. A load inside
    of a stick touches its limit there. One at its end may touch it along a branch: at the second of
    two equal maxima it is no event.
    """
    inside = [k for k, test in enumerate(orbit.system.tests) if test.margin is Margin.INTERIOR]
    last, margins = side.last, side.rows.tests[:, inside]
    touches = np.zeros(max(0, last - first), dtype=bool)
    low = max(first, 1)
    if low >= last:
        return touches
    near = _FALLEN * np.minimum(margins[low - 1 : last - 1], margins[low + 1 : last + 1])
    touches[low - first :] = np.any(np.abs(margins[low:last]) < np.minimum(_LEFT, near), axis=1)
    return touches


def _left_over(side: Side, orbit: Orbit, k: int, found: Bifurcation) -> float:
    """Return by how much the parameter changes from a row to where its margin vanishes, with the square."""
    rows, test = side.rows, orbit.system.tests.index(found.tests[0])
    left = abs(float(rows.tests[k, test] / rows.tests[k - 1, test]))
    return abs(float(rows.w[k, 0] - rows.w[k - 1, 0])) * float(np.sqrt(left))


def _has_fallen(side: Side, orbit: Orbit, k: int, found: Bifurcation) -> bool:
    """Tell whether a margin has come to zero along a side, and is not zero all along."""
    before = side.rows.tests[: k + 1, orbit.system.tests.index(found.tests[0])]
    return bool(before[-1] < min(_LEFT, _FALLEN * np.max(before)))
