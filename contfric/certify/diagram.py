"""Prove a whole diagram: a tube along every branch, and every event.

Mirror images of branches are not proved again and not counted: the symmetry of the model makes them
of the others. Branches and events are independent of each other, so that any executor may prove them.
With a time limit what is cheap comes first: events, the printed orbits of all branches, and then the tubes,
those of few points and segments first.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from contfric.atlas.diagram import Diagram
from contfric.certify.branch import BranchCertificate, certify_branch, certify_points
from contfric.certify.certificate import Certificate
from contfric.certify.diagram_certificate import (
    BranchSummary,
    DiagramCertificate,
    EventSummary,
    Gap,
    merged,
)
from contfric.certify.events import EventCertificate, certify_event
from contfric.certify.files import checkable, checked, told_apart
from contfric.certify.limit import LATE, latest
from contfric.certify.tubes.tube_file import tubes_of
from contfric.chaos.running import Progress, check_executor, compute_all
from contfric.continuation.branch import Branch
from contfric.events.bifurcation import Bifurcation
from contfric.models.balls.build import ball_model

_INTERRUPTED, _ALL = "interrupted", "branches and events"


@dataclass(frozen=True, eq=False)
class _Task:
    """A branch or an event to prove, until some time (that of ``time.time``).

    Attributes
    ----------
    points : certificates of the printed orbits of a branch, if they are known
    only_points : whether nothing else of a branch is to be proved
    """

    what: Branch | Bifurcation
    parameter: str
    until: float
    points: tuple[Certificate, ...] | None = None
    only_points: bool = False


@dataclass(frozen=True, eq=False)
class _Proved:
    """What was proved of a branch or an event, and of a branch its tubes for a file."""

    proof: BranchCertificate | EventCertificate
    tubes: tuple[dict[str, Any], ...] = ()


def certify_diagram(
    diagram: Diagram,
    executor: Executor | None = None,
    time_limit: float | None = None,
    progress: Progress | None = None,
) -> DiagramCertificate:
    """Prove what can be proved of a diagram; see :meth:`contfric.Diagram.certify`.

    Raises
    ------
    ParameterError
        If proofs are not offered for the model, or the time limit is not positive.
    """
    check_executor(executor)
    began, until = time.time(), latest(time_limit)
    branches = [(i, b) for i, b in enumerate(diagram.branches) if not b.mirrored]
    nodes = diagram.events
    for _, branch in branches[:1]:
        ball_model(branch.model, branch[0].params)  # whether proofs are offered
    # events first: they take milliseconds
    things: list[Branch | Bifurcation] = [node.bifurcation for node in nodes]
    things += [branch for _, branch in branches]
    tasks = {k: _Task(thing, diagram.parameter, until) for k, thing in enumerate(things)}
    results, ended = _proved(dict(sorted(tasks.items(), key=_cost)), executor, progress or _silent)
    found: dict[int, Any] = {k: result.proof for k, result in results.items()}
    late = [k for k in tasks if k not in found or bool(found[k].ended)]
    if late and not ended and time_limit is not None and time.time() > until:
        ended = f"the time limit of {time_limit:g} s ended the run"
    if late and ended:
        ended += f": {_parts(late, len(nodes))} not done"
    written = {k: _written(found.get(k)) for k in tasks}
    events = [
        replace(
            _event_summary(node.bifurcation, tuple(i + 1 for i in node.branches), found.get(k)),
            checkable=bool(written[k][0]),
            unchecked=written[k][1],
        )
        for k, node in enumerate(nodes)
    ]
    tubes = [
        _branch_summary(i + 1, branch, found.get(len(nodes) + k))
        for k, (i, branch) in enumerate(branches)
    ]
    parts, same = told_apart(part for some, _ in written.values() for part in some)
    return DiagramCertificate(
        diagram.model.name,
        diagram.parameter,
        diagram.range,
        tuple(tubes),
        tuple(events),
        time.time() - began,
        ended,
        (
            *parts,
            *(tube for k in sorted(results) for tube in results[k].tubes),
        ),
        tuple(part["params"][diagram.parameter] for part in same),
    )


def _cost(numbered: tuple[int, _Task]) -> int:
    """Return what a proof costs, roughly, to do the cheap ones first: boxes grow with points and segments."""
    what = numbered[1].what
    return len(what) * len(what.system.itinerary) ** 2 if isinstance(what, Branch) else 0


def _silent(_: str) -> None:
    """Nobody listens."""


def _parts(late: list[int], events: int) -> str:
    """Return how many events and branches are left, in words."""
    count = sum(k < events for k in late)
    named = [(count, "event", "s"), (len(late) - count, "branch", "es")]
    return " and ".join(f"{n} {name}{many if n > 1 else ''}" for n, name, many in named if n)


def _proved(
    tasks: dict[int, _Task], executor: Executor | None, progress: Progress
) -> tuple[dict[int, _Proved], str]:
    """Return what was proved by number of the task, and what ended the run early."""
    found, points = dict[int, Any](), dict[int, Any]()
    branches = {number: task for number, task in tasks.items() if isinstance(task.what, Branch)}
    events = {number: task for number, task in tasks.items() if number not in branches}

    def fill(results: dict[int, Any], some: dict[int, _Task], what: str) -> None:
        for number, result in _results(some, executor, progress):
            if result is not None:
                results[number] = result
            progress(f"{len(results)} of {len(tasks)} {what}")

    try:
        fill(found, events, _ALL)
        if any(task.until < math.inf for task in branches.values()):
            first = {number: replace(task, only_points=True) for number, task in branches.items()}
            fill(points, first, "printed orbits of branches")
        known = {k: replace(task, points=points.get(k)) for k, task in branches.items()}
        fill(found, known, _ALL)
    except KeyboardInterrupt:
        return found, _INTERRUPTED
    return found, ""


def _results(
    tasks: dict[int, _Task], executor: Executor | None, progress: Progress
) -> Iterator[tuple[int, Any]]:
    if executor is not None:
        yield from compute_all(tasks, executor, progress, prove)
        return
    # one after the other: the precision of flint belongs to the whole process
    for number, task in tasks.items():
        heard = partial(_within, progress, f"{number + 1} of {len(tasks)} {_ALL}")
        yield number, prove(task, progress=heard)


def _within(progress: Progress, before: str, text: str) -> None:
    progress(f"{before}: {text}")


def prove(
    task: _Task, stop: object = None, progress: Callable[[str], None] | None = None
) -> _Proved | tuple[Certificate, ...] | None:
    """Prove a branch or an event, or printed orbits only; None if the time was over before it began."""
    if time.time() > task.until and task.points is None:
        return None
    if isinstance(task.what, Bifurcation):
        return _Proved(certify_event(task.what, task.parameter, task.until))
    if task.only_points:
        return tuple(certify_points(task.what, task.until))
    proof = certify_branch(task.what, task.until, progress, task.points)
    return _Proved(proof, tuple(tubes_of(proof, task.until)))


def _written(
    proof: BranchCertificate | EventCertificate | None,
) -> tuple[list[dict[str, Any]], str]:
    """Return the event, or the orbits of a branch, as in a file; and why an event is not in it."""
    if proof is None:
        return [], "it was not tried"
    if isinstance(proof, BranchCertificate):  # its events are those of the diagram
        return checkable(proof.points), ""
    part, why = checked(proof)
    return ([] if part is None else [part]), why


def _event_summary(
    event: Bifurcation, branches: tuple[int, ...], proof: EventCertificate | None
) -> EventSummary:
    if proof is None:
        return EventSummary(event.label, event.kind.value, branches, math.nan, "", None, LATE)
    printed = event.params[proof.parameter]
    if proof.value is None:
        return EventSummary(event.label, event.kind.value, branches, printed, "", None, proof.why)
    text = str(proof.value.str(45, more=True)).strip("[]")
    return EventSummary(
        event.label, event.kind.value, branches, printed, text, proof.radius, proof.why
    )


def _branch_summary(number: int, branch: Branch, proof: BranchCertificate | None) -> BranchSummary:
    length = float(branch.arc[-1] - branch.arc[0])
    ends = (float(branch.values[0]), float(branch.values[-1]))
    if proof is None:
        gaps: tuple[Gap, ...] = (Gap(*ends, length, LATE),)
        return BranchSummary(number, branch.name, length, 0.0, 0.0, 0, gaps)
    gaps = merged([Gap(*p.values, p.stop - p.start, p.why) for p in proof.pieces if not p.proved])
    return BranchSummary(
        number,
        branch.name,
        length,
        length * proof.covered,
        length * proof.regular,
        len(proof.pieces),
        gaps,
        proof.complete,
        proof.events,
        tuple(proof.open),
        len(proof.points),
        proof.points_proved,
    )
