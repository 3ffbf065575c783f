"""Continuation of an equilibrium in one parameter, both ways, and through the boundaries of regions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contfric.equilibria.boundary import Partner, partner_of
from contfric.equilibria.branch import BranchEnd, EquilibriumBranch
from contfric.equilibria.events import BoundaryPoint, EquilibriumEvent, EquilibriumKind, HopfPoint
from contfric.equilibria.find import equilibrium_at
from contfric.equilibria.hopf import centre_of
from contfric.equilibria.march import LocatedSignChange, MarchLimits, Run, march
from contfric.equilibria.regions import check_no_excitation, scale_of
from contfric.equilibria.result import Equilibrium, Location
from contfric.equilibria.zero_curve import Arc, CurvePoint
from contfric.errors import ParameterError, checked_range, real_number, shown, whole_number

#: Largest step in the scaled product by default: a fiftieth of the range or of a natural size. What happens
#: twice within one step is not seen.
_MAX_STEP = 0.02
#: Share of the range within which an event cannot be told from a limit of the model.
_AT_LIMIT = 1e-9
#: Most regions that a branch goes through.
_MOST_RUNS = 100


def continue_equilibrium(
    equilibrium: Equilibrium,
    parameter: str,
    bounds: tuple[float, float],
    *,
    max_step: float | None = None,
    max_points: int = 5000,
) -> EquilibriumBranch:
    """Follow an equilibrium along a parameter, both ways, through folds and through the boundaries of modes.

    Where it reaches a surface that bounds its mode, the branch goes on with the equilibrium of another mode
    that meets it there: beyond (persistence) or back (non-smooth fold).

    Parameters
    ----------
    equilibrium : Equilibrium
        Admissible or virtual; of :func:`contfric.find_equilibria`.
    parameter : str
    bounds : (low, high)
    max_step : float, optional
        Largest step, as a share of the range and of the natural sizes of the states.
    max_points : int
        Most points each way.

    Returns
    -------
    EquilibriumBranch
        Its points, through every mode that it visits, and its events.

    Raises
    ------
    ParameterError
        If it lies on a boundary, or the model is excited along the range.

    Examples
    --------
    >>> import contfric as cf
    >>> branch = cf.continue_equilibrium(cf.find_equilibria("belt")[0], "vb", (0.1, 1.0))
    >>> branch.ends[0].value
    'the end of the range'
    """
    given: object = equilibrium
    if not isinstance(given, Equilibrium):
        raise ParameterError(
            "what is continued is an equilibrium of find_equilibria (a set of them moves with its ends: "
            f"find it at each value); got {shown(given)}"
        )
    model, active = equilibrium.model, equilibrium.model.index_of(parameter)
    if equilibrium.location is Location.BOUNDARY:
        raise ParameterError(
            "the equilibrium lies on the boundary of its region: move a parameter a little, find it again, "
            "and continue from there"
        )
    check_no_excitation(model, equilibrium.params, parameter)
    step = _MAX_STEP if max_step is None else real_number("max_step", max_step, least=1e-9)
    limits = _limits(
        equilibrium, parameter, bounds, step, whole_number("max_points", max_points, least=10)
    )
    scale = scale_of(model, equilibrium.vector)
    arc = Arc(equilibrium.region, equilibrium.vector, active, scale, limits.high - limits.low)
    halves: list[list[Run]] = []
    for sign in (-1.0, 1.0):
        start = arc.start(equilibrium.state, float(equilibrium.vector[active]), sign)
        closed = bool(halves and halves[0]) and halves[0][-1].end is BranchEnd.CLOSED
        if start is None or closed:  # one half of a closed branch is all of it
            halves.append([])
        else:
            halves.append(_followed(arc, start, limits))
    return _branch(equilibrium, parameter, halves[0], halves[1])


def _limits(
    equilibrium: Equilibrium, parameter: str, bounds: tuple[float, float], step: float, points: int
) -> MarchLimits:
    low, high = checked_range(parameter, bounds)
    least, most, _, _ = equilibrium.model.limits(parameter, equilibrium.params)
    value = equilibrium.params[parameter]
    if not max(low, least) <= value <= min(high, most):
        raise ParameterError(
            f"the equilibrium is at {parameter} = {value:g}, outside of the range ({low:g}, {high:g})"
        )
    return MarchLimits(
        max(low, least),
        min(high, most),
        BranchEnd.LIMIT if least > low else BranchEnd.RANGE,
        BranchEnd.LIMIT if most < high else BranchEnd.RANGE,
        step,
        points,
    )


def _followed(arc: Arc, start: CurvePoint, limits: MarchLimits) -> list[Run]:
    """Follow a curve from region to region."""
    runs: list[Run] = []
    left = limits.max_points
    for _ in range(_MOST_RUNS):
        run = march(arc, start, replace(limits, max_points=left))
        left -= len(run.points)
        partner: Partner | None = None
        for crossing in run.crossings:
            if _is_at_limit(arc, crossing.point, limits):
                run.end = BranchEnd.LIMIT if run.end is BranchEnd.BOUNDARY else run.end
                continue
            found, partner = _event(arc, crossing)
            run.events += [] if found is None else [found]
        runs.append(run)
        beyond = partner.start if partner is not None and run.end is BranchEnd.BOUNDARY else None
        if beyond is None or left < 2:
            break
        if len(runs) > 1 and _is_start(runs[0], *beyond):
            run.end = BranchEnd.CLOSED
            break
        arc, start = beyond
    return runs


def _is_at_limit(arc: Arc, point: CurvePoint, limits: MarchLimits) -> bool:
    """Tell whether an event is at a limit of the model, where formulas may degenerate."""
    value, near = arc.parameter(point.x), _AT_LIMIT * (limits.high - limits.low)
    below = limits.low_end is BranchEnd.LIMIT and value - limits.low < near
    return below or (limits.high_end is BranchEnd.LIMIT and limits.high - value < near)


def _is_start(first: Run, arc: Arc, point: CurvePoint) -> bool:
    """Tell whether a branch comes back to the boundary that its first run left by."""
    again = first.arc.region is arc.region
    return again and bool(np.max(np.abs(first.points[-1].x - point.x)) < 1e-9)


def _event(arc: Arc, crossing: LocatedSignChange) -> tuple[EquilibriumEvent | None, Partner | None]:
    """Return an event as a result, and what meets the branch there; None where nothing happens."""
    point = crossing.point
    y, p = arc.at(point)
    at = equilibrium_at(arc.region, y, p)
    parameter = arc.region.model.parameter_names[arc.active]
    before, after = (_stable(arc, side) for side in (crossing.before, crossing.after))
    common = (parameter, at, before, after)
    if crossing.test in ("SN", "BP"):
        return EquilibriumEvent(EquilibriumKind(crossing.test), *common), None
    if crossing.test == "H":
        return HopfPoint(EquilibriumKind.H, *common, centre_of(arc.region, y, p, arc.active)), None
    if arc.region.domain_of(y, p)[1]:
        return None, None  # still virtual on both sides
    partner = partner_of(arc, point)
    if partner.start is not None:
        after = _stable(*partner.start)
    event = BoundaryPoint(
        EquilibriumKind.BE,
        *common[:3],
        after,
        crossing.test,
        partner.unfolding,
        partner.mode,
        partner.product,
    )
    return event, partner


def _stable(arc: Arc, point: CurvePoint) -> bool | None:
    return equilibrium_at(arc.region, *arc.at(point)).stable


def _branch(
    start: Equilibrium, parameter: str, down: list[Run], up: list[Run]
) -> EquilibriumBranch:
    """Return both halves as one branch, from the end of the first to the end of the second."""
    n = len(start.state)
    points = [(run.arc, point) for run in down for point in run.points][::-1]
    events = [_reversed(event) for run in down for event in run.events][::-1]
    later = [(run.arc, point) for run in up for point in run.points]
    points += later[1:] if points else later
    events += [event for run in up for event in run.events]
    found = [equilibrium_at(arc.region, *arc.at(point)) for arc, point in points]
    own = np.full((len(points), n), np.nan, dtype=np.complex128)
    for k, equilibrium in enumerate(found):
        own[k, : len(equilibrium.eigenvalues)] = equilibrium.eigenvalues
    ends = [runs[-1].end if runs else BranchEnd.LOST for runs in (down, up)]
    if down and ends[0] is BranchEnd.CLOSED and not up:
        ends[1] = BranchEnd.CLOSED
    return EquilibriumBranch(
        start.model,
        parameter,
        start.vector,
        np.array([arc.parameter(point.x) for arc, point in points]),
        np.array([equilibrium.state for equilibrium in found]).reshape(-1, n),
        own,
        tuple(arc.region for arc, _ in points),
        np.array([not equilibrium.violated for equilibrium in found], dtype=bool),
        tuple(events),
        (ends[0], ends[1]),
    )


def _reversed(event: EquilibriumEvent) -> EquilibriumEvent:
    """Return an event as it is met in the other direction."""
    return replace(event, stable_before=event.stable_after, stable_after=event.stable_before)
