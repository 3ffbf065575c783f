"""Events that end a branch: which do, and the end that they are."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.continuation.ends.at_range import limit_end
from contfric.continuation.ends.at_vertices import CROSSED
from contfric.continuation.half_branch import Side
from contfric.continuation.points import Point, Settings
from contfric.continuation.singular_points.vertices import at_vertex
from contfric.errors import NotationError
from contfric.events.bifurcation import ACCURACY, TERMINAL, Bifurcation, End, EndReason, Kind
from contfric.events.local.holdable import NoJump
from contfric.events.local.jumps import nothing_jumps
from contfric.events.local.touching import entered_at, is_crossed, thrown_at
from contfric.events.locations import locations_of
from contfric.events.outcomes.outcomes import outcome_at
from contfric.orbit.canonical.sections import is_smooth
from contfric.orbit.canonical.slides import SHORT
from contfric.orbit.measured.samples import stationary_within
from contfric.orbit.orbit import Orbit

#: An orbit of this size (relative) is a point: located events are good to the root of rounding at a vertex.
_NO_SIZE = 1e-5
#: Near a point an orbit is an ellipse, but for terms of the second order of its size: where that is below the
#: first, they are below the second.
_SMALL, _LINEAR = 0.05, 0.1
#: Flights this high (relative to 1 + the states) between contacts are about to vanish: their impacts have
#: speeds near the root of rounding, and no limit that is known to more than a few digits.
_NO_HEIGHT = 1e-8
#: An orbit that passes an equilibrium this near (relative to its size) comes to it: what is left of the
#: distance there is rounding, over the factor by which it grows on the way out.
_AT_EQUILIBRIUM = 1e-6
#: Duration, in parts of a segment, over which its field is asked for an equilibrium: short enough that no
#: eigenvalue makes a whole turn, long enough to be seen above rounding.
_PART = 1e-2
#: A turn this much longer than at the start, along a parameter whose share of the tangent is below this,
#: comes to an equilibrium.
_LONGER, _STANDS = 1.5, 1e-6
#: Share of the period over which nothing but it may have changed: a saddle with complex eigenvalues makes a
#: branch turn again and again, with folds at which nothing changes for a moment.
_LATELY = 0.25
#: The same where a branch has ended: a saddle that repels its cycle multiplies rounding to the size of the
#: orbit before the parameter has been still for longer.
AT_END = 0.1
#: Joints of events that cannot be told from such an end differ by this at most.
_SAME = 1e-4

#: A parameter that changes by less than this share of the range over hundreds of points, while states are
#: this large and grow by this factor, comes to a resonance.
_AT_RESONANCE, _LARGE, _GROWS = 1e-7, 1e3, 1.1
#: States of a side that stalls at a resonance, and the share of the range over which they have doubled.
_HUGE, _STANDS = 1e4, 1e-4
#: By how much less the parameter moves from doubling to doubling, if nothing bounds the amplitude: 1/2.
_HALVES = 0.65
_AT_PEAK = (
    "the peak of a resonance with little damping: orbits as large as {size:.2g} are determined to too few "
    "digits to go on. Add damping, or start on the other side"
)


def is_point(orbit: Orbit) -> bool:
    """Tell whether an autonomous orbit has shrunk to a point, and not only its joints to one location."""
    if not orbit.model.autonomous:
        return False
    states = np.concatenate(
        [orbit.begins[:, 1:], orbit.ends[:, 1:]]
    )  # a clock that ticks is no point
    least = _NO_SIZE * (1.0 + np.abs(states).max())
    return bool(np.ptp(states, axis=0).max() < least) and orbit.x_max - orbit.x_min < least


def passes_point(before: Orbit, after: Orbit) -> bool:
    """Tell whether a smooth autonomous orbit shrinks to a point between two: beyond it joints change places.

    Near an equilibrium that begins to oscillate they are linear in the amplitude, which changes its sign.
    """
    if not before.model.autonomous or not is_smooth(before.model, before.itinerary):
        return False
    apart = [o.begins[:, 1:] - o.begins[:, 1:].mean(axis=0) for o in (before, after)]
    sizes = [float(np.linalg.norm(a)) for a in apart]
    if not 0.0 < max(sizes) < _SMALL * (1.0 + float(np.abs(before.begins[:, 1:]).max())):
        return False
    between = (apart[0] * sizes[1] + apart[1] * sizes[0]) / sum(sizes)
    return float(np.linalg.norm(between)) < _LINEAR * min(sizes)


def never_leaves(orbit: Orbit) -> bool:
    """Tell whether the flights off a wall on which impacts come to rest have shrunk to nothing."""
    model = orbit.model
    if not model.chatter_by_mode:
        return False
    least = _NO_HEIGHT * (1.0 + float(np.abs(orbit.joints[:, 1:]).max()))
    for own in {model.chatter_by_mode[m] for m, _ in orbit.itinerary if m in model.chatter_by_mode}:
        gap, highest = model.surface_by_name[own.surface].observable, 0.0
        level = orbit.flow.level(own.surface)
        for i, ((mode, _), end) in enumerate(zip(orbit.itinerary, orbit.ends, strict=True)):
            if mode in model.chatter_by_mode:
                continue
            _, values = stationary_within(orbit, i, gap)
            highest = max(
                highest,
                *np.abs(values - level),
                abs(orbit.flow.height(own.surface, end[0], end[1:])),
            )
        if highest < least:
            return True
    return False


def equilibrium_met(orbit: Orbit) -> tuple[str, str] | None:
    r"""Return the mode at whose equilibrium an autonomous orbit arrives, and the surface; None if at none.

    An equilibrium of a mode is a fixed point of its flow :math:`\varphi_h` over any time h. From a state x
    it is Newton's step away from it,

    .. math:: d = (D\varphi_h - 1)^{-1} (x - \varphi_h(x)).

    Where a joint is at the equilibrium of the mode that ends or begins there, a boundary equilibrium, the
    orbit needs for ever: its period grows as the logarithm of the distance :math:`|d|`, and other
    conditions that are met there mean nothing, as every rate vanishes.
    """
    if not orbit.model.autonomous:
        return None
    size = float(np.max(np.ptp(np.vstack([orbit.begins, orbit.ends])[:, 1:], axis=0)))
    for i, (mode, exit_) in enumerate(orbit.itinerary):
        lasts = float(orbit.durations[i])
        stands = orbit.model.is_at_rest(mode) or mode in orbit.model.chatter_by_mode
        if stands or lasts < SHORT * orbit.period:
            continue
        for joint, surface in (
            (orbit.ends[i], exit_),
            (orbit.begins[i], orbit.itinerary[i - 1][1]),
        ):
            if _to_equilibrium(orbit, mode, joint, _PART * lasts) < _AT_EQUILIBRIUM * size:
                return mode, surface
    return None


def _to_equilibrium(orbit: Orbit, mode: str, joint: FloatArray, lasts: float) -> float:
    """Return how far an equilibrium of a mode is from a joint by Newton's method; infinite if none is."""
    time, state = float(joint[0]), joint[1:]
    moved = orbit.flow.state(mode, time, state, lasts) - state
    slopes = orbit.flow.jacobian(mode, time, state, lasts)[:, 1 : 1 + len(state)]
    slopes -= np.eye(len(state))
    if not (np.isfinite(moved).all() and np.isfinite(slopes).all()):
        return np.inf
    step = np.linalg.lstsq(slopes, -moved, rcond=None)[0]
    reached = np.abs(moved + slopes @ step).max() <= 0.5 * np.abs(moved).max()
    return float(np.abs(step).max()) if reached else np.inf


def endless(orbit: Orbit) -> End | None:
    """Return the end of a branch whose orbit comes to an equilibrium on a surface; None if it does not.

    Where the surface is a section, the field is the same on both sides: the orbit is homoclinic.
    """
    met = equilibrium_met(orbit)
    if met is None:
        return None
    where = f" on the surface '{met[1]}' (boundary equilibrium)"
    if met in orbit.model.sections:
        where = " (homoclinic)"
    reason = f"the period grows without bound: the orbit comes to an equilibrium{where}"
    return End(EndReason.PERIOD, reason)


def end_at_limit(
    side: Side, located: list[tuple[Bifurcation, Point]], point: Point, settings: Settings
) -> None:
    """End a side before a limit of the model at which an event lies: several conditions degenerate there."""
    inside = [p for _, p in located if settings.low <= p.value <= settings.high]
    if inside:
        side.put_tip(inside[0])
    else:  # the last good point is as near as one gets
        side.drop_tip()
    side.end = limit_end(point.value, settings)


def ends_at(
    orbit: Orbit, side: Side, bifurcation: Bifurcation, point: Point, settings: Settings
) -> bool:
    """End a side at an event, or keep the event where the side goes on through it."""
    ends = EndReason.SINGULAR if point.lost else _ends_branch(bifurcation, point, orbit)
    if ends is None:
        side.bifurcations.append(bifurcation)
        return False
    if ends in (EndReason.BP, EndReason.PD):
        active = orbit.model.index_of(settings.parameter)
        side.drop_crowd(point.arc)
        side.put_tip(at_vertex(point, bifurcation.orbit, active))
    else:
        side.put_tip(point)
    message: str | Callable[[], str] = ""
    if ends.name == bifurcation.kind.name:  # most are never read
        message = partial(_end_message, bifurcation)
    vertex = ends is EndReason.BP and bifurcation.kind is Kind.BP
    if vertex and bifurcation.orbit.system.half == orbit.system.half:
        message = CROSSED
    side.end = End(ends, message, None if point.lost else bifurcation)
    return True


def _end_message(bifurcation: Bifurcation) -> str:
    """Return why a branch ends at an event, in words that fit what happens there."""
    kind, meaning = bifurcation.kind, bifurcation.meaning
    message = _why_it_ends(bifurcation)
    if meaning == kind.meaning or not TERMINAL & {kind}:
        return message
    return (message or EndReason[kind.name].value).replace(kind.meaning, meaning)


def _ends_branch(bifurcation: Bifurcation, point: Point, orbit: Orbit) -> EndReason | None:
    """Return why a branch ends at a bifurcation, or None if it goes on."""
    if bifurcation.kind in TERMINAL:
        return EndReason[bifurcation.kind.name]
    if bifurcation.kind is Kind.BP and point.slope == 0.0:  # another curve crosses at its vertex
        return EndReason.BP
    # at a fold, too: holds that turn by themselves have changed their lengths with each other
    simpler = bifurcation.kind in (Kind.BP, Kind.PD, Kind.SN)
    if simpler and bifurcation.orbit.system.half and not orbit.system.half:
        return EndReason.BP
    if simpler and bifurcation.orbit.periods < orbit.periods:
        return EndReason.PD
    return None


def _why_it_ends(bifurcation: Bifurcation) -> str:
    """Return why a branch ends at an event where its kind alone would say something else; else nothing."""
    orbit, kind = bifurcation.orbit, bifurcation.kind
    if kind not in (Kind.SS, Kind.AS, Kind.GS) or orbit.system.holds:
        return ""
    modes, model = [mode for mode, _ in orbit.system.itinerary], orbit.model
    struck = [
        t for t in bifurcation.tests if model.reset_at(modes[t.segment], t.surface) is not None
    ]
    if struck:
        met = struck[0]
        if thrown_at(orbit, met) or entered_at(orbit.system, met):
            return bifurcation.meaning
        return "grazing impact: the wall is just touched"
    if any(entered_at(orbit.system, t) or thrown_at(orbit, t) for t in bifurcation.tests):
        return bifurcation.meaning
    if {test.surface for test in bifurcation.tests} & orbit.model.fixed_sides.keys():
        return (
            "incomplete chatter: beyond this point impacts are finitely many, and branches with any number "
            "of them come together here"
        )
    continuous = f"{kind.meaning}: the signature changes, the solution is continuous"
    if orbit.model.composed and orbit.model.filippov:
        return "" if kind is Kind.SS else continuous
    # where nothing jumps at rest nothing does here, whichever of several margins is met first
    if nothing_jumps(orbit) or is_crossed(bifurcation):
        return continuous
    for location in locations_of(bifurcation)[:1]:
        try:
            follows = outcome_at(orbit.as_whole(), location, kind).edit
        except NoJump:
            return continuous
        except NotationError:  # what is there instead is told by what follows
            return ""
        if not follows.holds:
            return continuous
    return ""


def slows_down(side: Side, settings: Settings) -> bool:
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


def only_lengthens(side: Side, settings: Settings, lately: float = _LATELY) -> bool:
    """Tell whether only the period has changed along a side before its last point, by a share of itself.

    Next to a homoclinic orbit parameter and states differ by less than events are known to. The passage of
    the saddle multiplies rounding until no joint after it has its place: what is met there is no event.
    """
    if not side.autonomous or side.last < 1:
        return False
    values, joints = (side.column(name)[:-1] for name in ("values", "joints"))
    shorter = np.flatnonzero(-joints[:, 0, 0] < (1.0 - lately) * -joints[-1, 0, 0])
    if not shorter.size:
        return False
    values, states = values[shorter[-1] :], joints[shorter[-1] :, :, 1:]
    moved = np.max(np.ptp(states, axis=0)) / (1.0 + np.max(np.abs(states)))
    return bool(max(moved, np.ptp(values) / settings.width) < ACCURACY)


def grows(side: Side, settings: Settings) -> bool:
    """Tell whether a side has run along one value of the parameter while only its amplitude grew.

    In resonance the amplitude grows as the inverse of the distance of the parameter from a limit that it
    never reaches; far out the orbits are determined to fewer digits than that distance has.
    """
    values, last = side.rows.w[: side.last + 1, 0], side.last
    if np.ptp(values) > _AT_RESONANCE * settings.width:
        return False
    before, now = (float(np.abs(side.rows.joints[k, :, 1:]).max()) for k in (0, last))
    return now > _LARGE and now > _GROWS * before


def end_at_resonance(side: Side, settings: Settings) -> End | None:
    """Return the end of a side that stalls at a resonance: large, and over its last doubling at one value.

    Without damping the distance of the parameter from the resonance halves while the amplitude doubles. So
    the parameter moves by half of what it moved over the doubling before; with damping it comes to the peak,
    by ``(sqrt(3) - 0)/(sqrt(15) - sqrt(3)) = 0.81`` of that.
    """
    sizes = np.abs(side.rows.joints[: side.last + 1, :, 1:]).max(axis=(1, 2))
    half, quarter = (np.flatnonzero(sizes <= share * sizes[-1]) for share in (0.5, 0.25))
    if not len(quarter) or sizes[-1] < _HUGE:
        return None
    values = side.rows.w[: side.last + 1, 0]
    lately, before = abs(values[-1] - values[half[-1]]), abs(values[half[-1]] - values[quarter[-1]])
    if np.ptp(values[half[-1] :]) >= _STANDS * settings.width:
        return None
    if lately < _HALVES * before:
        return End(EndReason.UNBOUNDED)
    return End(EndReason.STEP, _AT_PEAK.format(size=sizes[-1]))


def lost_in_end(event: Bifurcation, end: Orbit, parameter: str, width: float) -> bool:
    """Tell whether an event differs from an end of endless period by less than events are known to.

    Points there differ by rounding alone, and so do their multipliers: they change sign for no reason. Next
    to a saddle with complex eigenvalues events never cease; which of them is the last would be a matter of
    the step.
    """
    gap = abs(event.params[parameter] - end.params[parameter])
    return gap < ACCURACY * width and event.outline.apart(end.outline) < _SAME
