"""The record of a run: what was asked, what was done and how often, what was skipped."""

from __future__ import annotations

import json
import platform
import sys
from collections.abc import Mapping
from dataclasses import asdict
from datetime import datetime, timezone
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from contfric.atlas.diagram import Diagram
from contfric.continuation.branch import Branch
from contfric.continuation.events import Proposal
from contfric.orbit.counts import Counts
from contfric.orbit.orbit import Orbit
from contfric.results import replacing
from contfric.study.findings import Findings
from contfric.study.plan import Plan
from contfric.study.record_plane import map_entries, plane_entries
from contfric.study.tables import listed_nodes

#: Modules that a run loads only if the study needs them.
WATCHED = (
    "numba",
    "matplotlib",
    "networkx",
    "scipy.optimize",
    "pandas",
    "pydantic",
    "yaml",
)


def package_version() -> str:
    """Return the version of contfric; a source folder that is not installed has none."""
    try:
        return version("contfric")
    except PackageNotFoundError:
        return "unknown (not installed)"


def record_of(
    plan: Plan,
    counts: Counts,
    timings: Mapping[str, float],
    found: Findings,
) -> dict[str, Any]:
    """Return the record of a run as plain data; status and files are added by the run."""
    return {
        "contfric": package_version(),
        "python": platform.python_version(),
        "date": datetime.now(timezone.utc).isoformat(timespec="seconds"),
        "name": plan.study.name,
        "title": plan.study.title,
        "study": plan.study.as_dict(),
        "counts": asdict(counts),
        "modules": {name: name in sys.modules for name in WATCHED},
        "module_count": len(sys.modules),
        "timings": {name: round(seconds, 6) for name, seconds in timings.items()},
        "skipped": [asdict(item) for item in plan.skipped],
        **(_start_entries(found.orbit) if found.orbit is not None else {}),
        **(_diagram_entries(found.diagram) if found.diagram is not None else {}),
        **({"plane": plane_entries(found.plane)} if found.plane is not None else {}),
        **({"lyapunov": map_entries(found.lyapunov)} if found.lyapunov is not None else {}),
        **_response_entries(found),
    }


def _response_entries(found: Findings) -> dict[str, Any]:
    if not found.responses:
        return {}
    from contfric.study.tables_response import entries_of

    return {key: entries_of(x) for key, x in found.responses.items()}


def _start_entries(orbit: Orbit) -> dict[str, Any]:
    return {
        "start": {
            "signature": orbit.name,
            "segments": str(orbit.signature),
            "periods": orbit.periods,
            "params": orbit.params,
            "residual": orbit.residual,
        }
    }


def _diagram_entries(diagram: Diagram) -> dict[str, Any]:
    return {
        "parameter": diagram.parameter,
        "complete": diagram.complete,
        "branches": [_branch_entry(i, b) for i, b in enumerate(diagram.branches, start=1)],
        "bifurcations": [
            {
                "kind": node.bifurcation.kind.value,
                "label": node.bifurcation.label,
                "branches": [i + 1 for i in node.branches],
                "params": node.bifurcation.params,
                "group": node.bifurcation.group,
                "contacts": list(node.bifurcation.contacts),
                "scenario": getattr(diagram.scenario(node), "value", None),
                "stable_before": node.bifurcation.stable_before,
                "stable_after": node.bifurcation.stable_after,
                "located": node.bifurcation.located,
                "proposals": [_proposal_entry(p) for p in node.bifurcation.proposals],
            }
            for node in listed_nodes(diagram)
        ],
        "loose_ends": [str(end) for end in diagram.loose_ends],
        "notes": list(diagram.notes),
        "verified": diagram.verified,
        "verification": []
        if diagram.verification is None
        else str(diagram.verification).split("\n"),
    }


def _proposal_entry(proposal: Proposal) -> dict[str, Any]:
    return {
        "verdict": proposal.verdict.value,
        "reason": proposal.reason,
        "branch": None if proposal.branch is None else proposal.branch + 1,
        "why": proposal.why,
    }


def _branch_entry(number: int, branch: Branch) -> dict[str, Any]:
    # a fold lies beyond the points on both sides of it
    events = [b.params[branch.parameter] for b in branch.bifurcations]
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


def write_record(path: Path, record: Mapping[str, Any]) -> None:
    """Write the record as JSON."""
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
