"""The tables of simulated responses, and what the record of a run says of them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from contfric.chaos.status import Motion
from contfric.ensembles.ensemble import Ensemble
from contfric.equilibria.events import BoundaryPoint, EquilibriumEvent, HopfPoint
from contfric.equilibria.explore import EquilibriumDiagram
from contfric.response.basins import Basins
from contfric.response.outcome import Outcome
from contfric.response.returns import Returns
from contfric.response.sweep import Sweep

if TYPE_CHECKING:
    from contfric.study.responses import Response


def header_of(found: Response) -> list[str]:
    """Return the columns of the table of a response."""
    if isinstance(found, EquilibriumDiagram):
        states = found.model.states
        return ["branch", "event", found.parameter, "mode", *states, "stable", "admissible"]
    if isinstance(found, Ensemble):
        return ["sample", *found.distributions, "event", found.parameter]
    if isinstance(found, Basins):
        return [*found.axes, "orbit", "name", "motion"]
    if isinstance(found, Returns):
        return ["cycle", "t", "mode", *found.model.states]
    return ["direction", found.parameter, "outcome", "period", "mode", "t", *found.model.states]


def rows_of(found: Response) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of the table of a response."""
    if isinstance(found, EquilibriumDiagram):
        return _equilibria(found)
    if isinstance(found, Ensemble):
        return _places(found)
    if isinstance(found, Basins):
        return _starts(found)
    return _points(found) if isinstance(found, Returns) else _swept(found)


def _equilibria(found: EquilibriumDiagram) -> Iterator[tuple[Any, ...]]:
    """Yield the points of each branch, and then its events."""
    for number, branch in enumerate(found.branches):
        looks = zip(branch.stable.tolist(), branch.admissible.tolist(), strict=True)
        for k, look in enumerate(looks):
            place = number, "", branch.values[k].item(), branch.regions[k].mode
            yield *place, *branch.states[k].tolist(), *look
        for event in branch.events:
            at = event.equilibrium
            yield number, event.label, event.value, at.mode, *at.state.tolist(), "", ""


def _event_entry(event: EquilibriumEvent) -> dict[str, Any]:
    entry: dict[str, Any] = {
        "label": event.label,
        "meaning": event.meaning,
        "value": event.value,
        "state": event.equilibrium.state.tolist(),
    }
    if isinstance(event, HopfPoint):
        entry |= {"frequency": event.frequency, "lyapunov": event.lyapunov}
    if isinstance(event, BoundaryPoint):
        entry |= {"unfolding": event.unfolding.name.lower(), "partner": event.partner}
    return entry


def _starts(found: Basins) -> Iterator[tuple[Any, ...]]:
    motions, names = [motion.name.lower() for motion in Motion], [*found.names, ""]
    rows, columns = (values.tolist() for values in found.axes.values())
    for i, a in enumerate(rows):
        for j, b in enumerate(columns):
            label = int(found.labels[i, j])
            yield a, b, label, names[label], motions[found.motions[i, j]]


def _places(found: Ensemble) -> Iterator[tuple[Any, ...]]:
    rows = found.rows
    events = zip(rows.event_label.tolist(), rows.event_value.tolist(), strict=True)
    for sample, event in zip(rows.event_sample.tolist(), events, strict=True):
        yield sample, *found.samples[sample].tolist(), *event


def _ensemble_entry(found: Ensemble) -> dict[str, Any]:
    return {
        "parameter": found.parameter,
        "range": list(found.range),
        "distributions": found.distributions,
        "seed": found.seed,
        "samples": len(found),
        "outcomes": found.counts(),
        "complete": found.complete,
        "events": [
            {"label": e.label, "share": e.share, "low": e.low, "high": e.high, "count": e.count}
            | {"quantiles": e.quantiles().tolist()}
            for e in found.events
        ],
        "classes": [
            {"events": list(c.events), "share": c.share, "low": c.low, "high": c.high}
            | {"samples": len(c.samples)}
            for c in found.classes
        ],
    }


def _points(found: Returns) -> Iterator[tuple[Any, ...]]:
    modes = [mode.name for mode in found.model.modes]
    for k in range(len(found)):
        place = found.cycles[k].item(), found.times[k].item(), modes[found.modes[k]]
        yield *place, *found.states[k].tolist()


def _swept(found: Sweep) -> Iterator[tuple[Any, ...]]:
    outcomes = [outcome.name.lower() for outcome in Outcome]
    modes = [mode.name for mode in found.model.modes]
    for name, run in found.runs.items():
        for i, value in enumerate(run.index.tolist()):
            yield (
                name,
                found.values[value].item(),
                outcomes[run.outcomes[value]],
                run.periods[value].item(),
                modes[run.modes[i]],
                run.times[i].item(),
                *run.states[i].tolist(),
            )


def entries_of(found: Response) -> dict[str, Any]:
    """Return what the record of a run says of a response."""
    if isinstance(found, EquilibriumDiagram):
        return {
            "parameter": found.parameter,
            "range": list(found.bounds),
            "branches": [
                {
                    "modes": list(dict.fromkeys(branch.modes)),
                    "points": len(branch),
                    "from": float(branch.values.min()),
                    "to": float(branch.values.max()),
                    "ends": [end.value for end in branch.ends],
                }
                for branch in found.branches
            ],
            "sets": len(found.sets),
            "events": [_event_entry(event) for event in found.events],
            "complete": found.complete,
        }
    if isinstance(found, Ensemble):
        return _ensemble_entry(found)
    if isinstance(found, Basins):
        return {
            "grid": {n: [float(v[0]), float(v[-1]), len(v)] for n, v in found.axes.items()},
            "at": found.at,
            "complete": found.complete,
            "shares": [vars(share) for share in found.shares],
        }
    if isinstance(found, Returns):
        return {
            "section": found.section,
            "points": len(found),
            "outcome": found.outcome.name.lower(),
            "complete": found.complete,
        }
    return {
        "parameter": found.parameter,
        "values": [float(found.values[0]), float(found.values[-1]), len(found.values)],
        "params": found.params,
        "section": found.section,
        "complete": found.complete,
        "points": {name: len(run) for name, run in found.runs.items()},
        "outcomes": {outcome.name.lower(): count for outcome, count in found.counts().items()},
    }
