"""One branch, both ways, to its ends."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from contfric.continuation.accuracy import not_critical
from contfric.continuation.assembly import assemble, join
from contfric.continuation.branch import Branch
from contfric.continuation.ending import (
    end_at_limit,
    endless,
    ends_at,
    is_point,
    never_leaves,
)
from contfric.continuation.events import TERMINAL, Bifurcation, End, EndReason, Kind
from contfric.continuation.limits import is_at_limit, limit_crossed, limit_end
from contfric.continuation.locate import belongs_to, locate_events
from contfric.continuation.points import (
    EXTRA,
    FIRST_STEP,
    MOST_POINTS,
    Point,
    Settings,
    settings_of,
)
from contfric.continuation.section_joints import (
    LAST_CROSSING,
    is_known_touch,
    is_on_section,
    move_joints,
)
from contfric.continuation.side import Side
from contfric.continuation.sliding import nearly_reached
from contfric.continuation.smooth import SAME_PLACE
from contfric.continuation.start import start_of
from contfric.continuation.stopping import stop_among, stop_between
from contfric.continuation.vertex_ends import (
    NEAREST,
    SHORTER,
    Overshoot,
    end_stalled,
    overshoots_vertex,
)
from contfric.errors import ConvergenceError, function_of
from contfric.orbit.orbit import Orbit
from contfric.remember.advance import foresee, foreseeable
from contfric.remember.journal import remembered

#: An event within this share of a step of a limit of the parameter belongs to the limit (S = 0).
_AT_LIMIT = 1e-6

#: A margin this negative (nondimensional) is violated; a located limit is good to rounding.
_VIOLATED = 1e-9
#: A turn this much longer than at the start, along a parameter whose share of the tangent is below this,
#: comes to an equilibrium.
_LONGER, _STANDS = 1.5, 1e-6

#: A parameter that changes by less than this share of the range over hundreds of points, while states are
#: this large and grow by this factor, comes to a resonance.
_AT_RESONANCE, _LARGE, _GROWS = 1e-7, 1e3, 1.1

#: A step this short after hundreds of points (arclength) gets nowhere.
_CRAWLS = 1e-6

Progress = Callable[[str], None]


def continue_orbit(
    orbit: Orbit,
    parameter: str,
    range: tuple[float, float],
    *,
    max_step: float | None = None,
    stability: bool = True,
    max_points: int = MOST_POINTS,
    stop_at: Mapping[str, float] | None = None,
    progress: Progress | None = None,
) -> Branch:
    """Continue an orbit in one parameter, both ways, to the ends of its branch.

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
        Most points of each side; a branch that reaches it says so.
    stop_at : mapping, optional
        Quantities by name or expression, and a value of each, such as ``{"x_max": 1.4}``: a branch ends
        where the first of them is taken, exactly there, with the reason STOP.

    Raises
    ------
    ParameterError
        If the parameter, the range or the step is not valid.
    ConvergenceError
        If the orbit is not solved, or has no unique continuation.

    Notes
    -----
    Ctrl-C ends the branch where it is, with the reason INTERRUPTED.

    What detection cannot see: two events of the same kind within one step whose test functions do
    not betray it by a parabola through three points. A smaller ``max_step`` shows them.

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
    orbit, start = start_of(orbit, settings)
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

    ``at_event`` says that the point is at a sliding event, to which smooth events in the same place belong.
    With ``keep`` Ctrl-C ends the side where it is, with the reason INTERRUPTED. Without it is passed on: who
    traces sides one after the other must not take the end of one for an answer.
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
            if side.end.reason in _MAY_BE_ENDLESS and (end := endless(_tip(orbit, side, settings))):
                side.end = end
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
    from contfric.continuation import march as kernels

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
    unresolved = why in (kernels.EVENT, kernels.OUTSIDE)  # what is in the last step may come first
    last, fresh = side.last - int(unresolved), side.count - count
    if settings.stop_at and stop_among(orbit, side, settings, fresh, last):
        return True, step
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
        if why in (kernels.STEP, kernels.BROKEN) and is_at_limit(side.tip.value, settings):
            side.end = limit_end(side.tip.value, settings)
        elif why in (kernels.STEP, kernels.BROKEN) and never_leaves(_tip(orbit, side, settings)):
            side.end = End(EndReason.REST)
        elif why == kernels.STEP and not _end_of_holds(orbit, side, settings, True):
            end_stalled(orbit, side, settings)
        if side.end.reason in (EndReason.STEP, EndReason.BROKEN) and _slows_down(side, settings):
            side.end = End(EndReason.PERIOD)
        return True, step
    if why == kernels.FULL and _grows(side, settings):
        side.end = End(EndReason.UNBOUNDED)
        return True, step
    if why == kernels.FULL:
        return _end_of_holds(orbit, side, settings, step < _CRAWLS), step
    return _resolve(orbit, side, settings), step


def _tip(orbit: Orbit, side: Side, settings: Settings) -> Orbit:
    """Return the last orbit of a side."""
    return side.tip.orbit(orbit.system, orbit.vector, orbit.model.index_of(settings.parameter))


def _slows_down(side: Side, settings: Settings) -> bool:
    """Tell whether a side has run along one value of the parameter while only its period grew.

    Near a homoclinic orbit the period grows as the logarithm of the distance of the parameter, and
    Newton fails when that distance is rounding.
    """
    if not side.autonomous:
        return False
    tip, first = side.tip, side.first
    return bool(
        abs(tip.slope) < _STANDS * settings.width
        and tip.joints[0, 0] < _LONGER * first.joints[0, 0]
    )


def _grows(side: Side, settings: Settings) -> bool:
    """Tell whether a side has run along one value of the parameter while only its amplitude grew.

    In resonance the amplitude grows as the inverse of the distance of the parameter from a limit that it
    never reaches; far out the orbits are determined to fewer digits than that distance has.
    """
    values, last = side.rows.w[: side.last + 1, 0], side.last
    if np.ptp(values) > _AT_RESONANCE * settings.width:
        return False
    before, now = (float(np.max(np.abs(side.rows.joints[k, :, 1:]))) for k in (0, last))
    return now > _LARGE and now > _GROWS * before


def _end_of_holds(orbit: Orbit, side: Side, settings: Settings, stuck: bool) -> bool:
    """End a side that is stuck just before several holds end at once; True if that is so."""
    reached = nearly_reached(orbit, side.tip, settings) if stuck else None
    if reached is not None:
        side.end = End(EndReason[reached.kind.name], bifurcation=reached)
    return reached is not None


def _resolve(orbit: Orbit, side: Side, settings: Settings) -> bool:
    """Locate what happened over the last step; True if the side ends there."""
    before, after = side.before_tip, side.tip
    limit = limit_crossed(orbit, before, after, settings)
    stop = stop_between(orbit, before, after, settings) if settings.stop_at else None
    if stop is not None and (limit is None or stop.point.arc <= limit[0].arc):
        limit = stop.point, ""
    located = locate_events(orbit, before, after, settings)
    if any(is_on_section(b) and is_point(b.orbit) for b, _ in located):
        side.drop_tip()  # beyond it the same orbits come again, half a cycle later
        side.end = End(EndReason.POINT)
        return True
    if _comes_closer(side, located, after.arc - before.arc):
        return False
    if located and is_on_section(located[0][0]):
        side.drop_tip()
        if move_joints(orbit, side, settings):
            return False
        side.end = End(EndReason.STEP, LAST_CROSSING)
        return True
    side.largest = np.inf  # what asked for shorter steps is behind
    if shrunk := [pair for pair in located if is_point(pair[0].orbit)]:
        # segments of no length fold and double with it, and Newton fails before it
        clear = [pair for pair in located if pair[0].located and not pair[1].lost]
        located = [*(pair for pair in clear if pair not in shrunk), shrunk[-1]]
    for bifurcation, point in located:
        if limit is not None and _is_beyond(point, limit[0], after.arc - before.arc, settings):
            break
        if is_at_limit(point.value, settings):
            end_at_limit(side, located, point, settings)
            return True
        if _is_known(side, bifurcation, before, point, after, settings):
            continue
        if is_point(bifurcation.orbit):
            side.put_tip(point)
            side.end = End(EndReason.POINT)
            return True
        if never_leaves(bifurcation.orbit):  # flights of no height fold by rounding
            side.put_tip(point)
            side.end = End(EndReason.REST)
            return True
        if not point.lost and (note := not_critical(bifurcation, before, after, settings)):
            side.notes.append(note)
        elif ends_at(orbit, side, bifurcation, point, settings):
            return True
    reached = after if limit is None else limit[0]
    if np.any(reached.tests[:-EXTRA] < -_VIOLATED):
        side.drop_tip()
        if is_at_limit(side.tip.value, settings):
            side.end = limit_end(side.tip.value, settings)
        elif not _end_of_holds(orbit, side, settings, True):
            side.end = End(EndReason.SINGULAR)
        return True
    if limit is None:
        return False
    side.put_tip(limit[0])
    side.end = limit_end(after.value, settings)
    if stop is not None and limit[0] is stop.point:
        side.end = stop.end
    return True


def _is_beyond(point: Point, limit: Point, step: float, settings: Settings) -> bool:
    """Tell whether an event lies at the limit of the parameter, or behind it."""
    within = settings.low <= point.value <= settings.high
    return point.arc > limit.arc - _AT_LIMIT * step or not within


def _is_known(
    side: Side,
    bifurcation: Bifurcation,
    before: Point,
    point: Point,
    after: Point,
    settings: Settings,
) -> bool:
    """Tell whether an event is that at which the side starts, or a touch that is known already."""
    if side.at_event and belongs_to(bifurcation, side.first, point, settings):
        return True
    if bifurcation.kind is not Kind.T:
        return False
    if _is_start(side, before, point):
        side.relabel_first(after.labels)  # where a stop lies on a surface its label is arbitrary
        return True
    return is_known_touch(side, point)


def _comes_closer(side: Side, located: list[tuple[Bifurcation, Point]], step: float) -> bool:
    """Go back to the point before an event near which Newton fails, and on in shorter steps.

    Where two curves of orbits cross, Newton converges from no farther than the crossing is away: a step
    across may end on the other curve, and what is between its ends belongs to neither.
    """
    fails = any(point.lost or point.rough for _, point in located)
    if not fails or step < NEAREST:
        return False
    side.drop_tip()
    side.largest = step / SHORTER
    return True


def _is_start(side: Side, before: Point, point: Point) -> bool:
    """Tell whether a change of labels happens at the very start of a side, at an event."""
    return side.count == 2 and point.arc - before.arc < SAME_PLACE
