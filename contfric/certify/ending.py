r"""A box that reaches beyond the end of a branch: its orbits are admissible up to one.

The equations of a chain know nothing of its inequalities, so that a box (:mod:`contfric.certify.tube`) may
reach beyond the event at which a branch ends. Let X(s) be the curve in it, T its direction. A few
inequalities change their sign in the box: a load at a joint less its limit, a rate at an exit, the
duration of a segment are numbers m(s), with ``m' = (derivative of m by the unknowns) T``; inside of a
segment q(tau, s) may vanish for times tau in a window W only, and its derivative by s for fixed tau is
known in the same way. Where all of these derivatives are negative over the whole box, towards its outer
end, each of the inequalities holds for s below some number, so that all of them hold up to the least, s*:
there the branch ends, and nowhere else in the box. The other inequalities are proved for all s; where they
lean on one of the first (a load that begins at its limit at the event is below it before) they hold up to s*.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from flint import arb

from contfric.certify.chain import Chain, Segments
from contfric.certify.extended import Builder, EventCondition, rows_of
from contfric.certify.inequalities import (
    DURATION,
    EXIT,
    INSIDE,
    JOINT,
    Inequality,
    InequalityName,
    inequalities,
)
from contfric.certify.passing import dot
from contfric.certify.tube import Box, section
from contfric.certify.verdict import Verdict
from contfric.certify.zeros import Closing
from contfric.models.balls.numbers import Vector
from contfric.orbit.system import System

#: Inequalities at joints, which may change their sign in the box of an end.
_NUMBERS = (DURATION, JOINT, EXIT)


@dataclass(frozen=True, eq=False)
class Edge:
    """The chain of a branch, to look at a box that reaches beyond its end.

    Attributes
    ----------
    forward : whether the outer end is that of ``last``; else it is that of ``first``
    """

    system: System
    segments: Segments
    build: Builder
    closing: Closing
    forward: bool


def ends_inside(edge: Edge, box: Box) -> tuple[InequalityName, ...]:
    """Return the inequalities that end the branch at one orbit of a box; none if that is not proved."""
    if box.tangent is None:
        return ()
    loose = [found.name for found in _failing(edge, box.all, ()) if found.name.what in _NUMBERS]
    left = _failing(edge, box.all, loose)
    if not all(found.name.what == INSIDE for found in left):
        return ()
    sides = (False, True) if edge.forward else (True, False)
    zeros = [section(edge.segments, edge.build, box, last) for last in sides]
    if zeros[0] is None or zeros[1] is None or _failing(edge, zeros[0], ()):
        return ()
    beyond = _failing(edge, zeros[1], ())
    if not any(found.finding.verdict is Verdict.REFUTED for found in beyond):
        return ()
    falls = all(_falls(edge, box, name, None) for name in loose)
    if falls and all(_falls(edge, box, found.name, found.window()) for found in left):
        return (*loose, *(found.name for found in left))
    return ()


def _failing(
    edge: Edge, x: Vector, loose: tuple[InequalityName, ...] | list[InequalityName]
) -> list[Inequality]:
    """Return the inequalities that are not proved for all solutions in some balls."""
    chain = Chain(edge.segments, replace(edge.build(x[-1]), slopes=None))
    joints = chain.joints(x[:-1])
    found = inequalities(chain, edge.system, joints, edge.closing, loose=loose)
    return [inequality for inequality in found if not inequality.finding.proved]


def _falls(edge: Edge, box: Box, name: InequalityName, window: arb | None) -> bool:
    """Tell whether the number of an inequality falls towards the outer end, over the whole box."""
    chain = Chain(edge.segments, edge.build(box.all[-1]))
    assert box.tangent is not None
    z, i = chain.joints(box.all[:-1]), name.segment
    sign = signs_of(edge.system, name)
    if name.what == DURATION:
        first, last = (chain.times_by(k, box.tangent) for k in (i, i + 1))
        slope = last - first
    elif name.what == INSIDE:
        if window is None or sign is None or not window < chain.duration(i, z):
            return False
        rows = rows_of(chain.model, edge.segments, EventCondition(i, name.surface), 0)
        slope = sign * dot(chain.observed_within(z, i, window, *rows)[1], box.tangent)
    else:
        if sign is None:
            return False
        order = int(name.what == EXIT)
        rows = rows_of(chain.model, edge.segments, EventCondition(i, name.surface), order)
        slope = sign * dot(chain.observed(z, i + 1, *rows)[1], box.tangent)
    return bool(slope < 0 if edge.forward else slope > 0)


def signs_of(system: System, name: InequalityName) -> int | None:
    """Return the sign with which the observable of an inequality is positive where it holds."""
    layout, surfaces = system.layout, [s.name for s in system.model.surfaces]
    i = name.segment
    if name.what == EXIT:
        return int(layout.exit_signs[i])
    if name.what == JOINT:
        rows = [(at, surfaces[k], s) for at, k, s, where in layout.joint if where == 0]
    else:
        rows = [(at, surfaces[k], s) for at, k, s in layout.interior]
        if layout.pins[i] == -1 and layout.exit_signs[i]:
            rows.append((i, surfaces[layout.exits[i]], -layout.exit_signs[i]))
    return next((int(s) for at, k, s in rows if (at, k) == (i, name.surface)), None)
