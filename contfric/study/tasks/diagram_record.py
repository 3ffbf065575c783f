"""The part of a run's record that describes a diagram, and the record as lines of text."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, TypeAlias

from contfric.base.shown import aligned

if TYPE_CHECKING:
    from contfric.atlas.diagram import Diagram
    from contfric.continuation.branch import Branch
    from contfric.events.bifurcation import Proposal

Record: TypeAlias = dict[str, Any]


def entries_of(found: Diagram) -> Record:
    """Return branches, bifurcations and what follows them."""
    return {
        "parameter": found.parameter,
        "complete": found.complete,
        "multipliers": all(branch.stable is not None for branch in found.branches),
        "branches": [_branch_entry(i, b) for i, b in enumerate(found.branches, start=1)],
        "bifurcations": [
            {
                "kind": node.bifurcation.kind.value,
                "label": node.bifurcation.label,
                "branches": [i + 1 for i in node.branches],
                "params": node.bifurcation.params,
                "group": node.bifurcation.group,
                "contacts": list(node.bifurcation.contacts),
                "scenario": getattr(found.scenario(node), "value", None),
                "stable_before": node.bifurcation.stable_before,
                "stable_after": node.bifurcation.stable_after,
                "located": node.bifurcation.located,
                "proposals": [_proposal_entry(p) for p in node.bifurcation.proposals],
            }
            for node in found.events
        ],
        "loose_ends": [str(end) for end in found.loose_ends],
        "notes": list(found.notes),
        "verified": found.verified,
        "verification": [] if found.verification is None else str(found.verification).split("\n"),
    }


def lines_of(record: Record) -> Iterator[str]:
    """Yield branches, bifurcations and loose ends as tables."""
    name = record["parameter"]
    yield ""
    yield from aligned([["branch", "name", "points", name, "", "ends"], *_branch_rows(record)])
    yield ""
    events = list(_event_rows(record))
    head = ["event", name, "branches", "scenario"]
    yield from aligned([head, *events]) if events else ["no events"]
    yield ""
    if record["loose_ends"]:
        yield "unresolved branch ends (loose ends)"
        yield from (f"  {text}" for text in record["loose_ends"])
    else:
        yield "no loose ends"
    yield from (f"note: {text}" for text in record.get("notes", []))
    if not record.get("multipliers", True):
        yield "note: without 'stability' in 'want' PD and NS are not detected, BP only where a branch turns"
    yield from record.get("verification", [])
    if not record["complete"]:
        yield "incomplete: the exploration was stopped before it was done"


def proposals(record: Record) -> Iterator[str]:
    """Yield what was proposed to follow each event, and what became of it."""
    events = [event for event in record.get("bifurcations", []) if event["proposals"]]
    if not events:
        return
    name = record["parameter"]
    yield ""
    yield "what was proposed to follow the events"
    for event in events:
        yield f"  {event['label']} at {name} = {event['params'][name]:.10g}"
        for item in event["proposals"]:
            branch = "" if item["branch"] is None else f" as branch {item['branch']}"
            why = f": {item['why']}" if item["why"] else ""
            yield f"    {item['verdict']}{branch}: {item['reason']}{why}"


def _proposal_entry(proposal: Proposal) -> Record:
    return {
        "verdict": proposal.verdict.value,
        "reason": proposal.reason,
        "branch": None if proposal.branch is None else proposal.branch + 1,
        "why": proposal.why,
    }


def _branch_entry(number: int, branch: Branch) -> Record:
    # a fold lies beyond the points on both sides of it
    events = (b.params[branch.parameter] for b in branch.bifurcations)
    values = [float(branch.values.min()), float(branch.values.max()), *events]
    return {
        "branch": number,
        "signature": branch.name,
        "mirrored": branch.mirrored,
        "bridge": branch.bridge,
        "points": len(branch),
        "from": min(values),
        "to": max(values),
        "ends": [
            f"at {value:.8g}: {end}"
            for value, end in zip(branch.values[[0, -1]], branch.ends, strict=True)
        ],
    }


def _branch_rows(record: Record) -> list[list[str]]:
    rows: list[list[str]] = []
    for branch in record["branches"]:
        if branch["mirrored"]:
            rows[-1][1] += " and mirror"
            continue
        label = branch["signature"] + (" (bridge)" if branch["bridge"] else "")
        number, count = str(branch["branch"]), str(branch["points"])
        low, high = f"{branch['from']:.8g}", f"{branch['to']:.8g}"
        rows.append([number, label, count, low, high, "; ".join(branch["ends"])])
    return rows


def _event_rows(record: Record) -> Iterator[list[str]]:
    name = record["parameter"]
    names = {branch["branch"]: branch["signature"] for branch in record["branches"]}
    for event in record["bifurcations"]:
        joined = "; ".join(f"{names[i]} ({i})" for i in event["branches"])
        yield [event["label"], f"{event['params'][name]:.13g}", joined, event.get("scenario") or ""]
