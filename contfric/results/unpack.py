"""From a header and arrays back to orbits, branches and diagrams."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

import numpy as np

from contfric.atlas.balance import Balance, IndexSum
from contfric.atlas.diagram import Asked, Diagram, LooseEnd, Node
from contfric.atlas.verification import Restart, Verification
from contfric.continuation.branch import Branch
from contfric.continuation.events import (
    ACCURACY,
    Bifurcation,
    End,
    EndReason,
    Kind,
    Proposal,
    Verdict,
)
from contfric.models.definition import Model
from contfric.orbit.orbit import Orbit, Status
from contfric.orbit.system import IntArray, Margin, System, Test, build_system
from contfric.results.pack import BRANCH_ARRAYS, Arrays, Header


@dataclass(frozen=True, eq=False)
class Unpacker:
    """Rebuilds objects by their indices, each once."""

    model: Model
    header: Header
    arrays: Arrays

    @cached_property
    def systems(self) -> list[System]:
        """The boundary-value problems."""
        return [
            build_system(
                self.model,
                tuple(self._pair(str(mode), str(exit_)) for mode, exit_ in entry["word"]),
                entry["periods"],
                entry["half"],
            )
            for entry in self.header["systems"]
        ]

    def _pair(self, mode: str, exit_: str) -> tuple[str, str]:
        """Return a segment as words have it now: results of earlier versions have joints on sections."""
        if (mode, exit_) in self.model.sections:
            return self.model.section_pair(mode, exit_)
        return self.model.whole_mode(mode), exit_

    @cached_property
    def orbits(self) -> list[Orbit]:
        """The single orbits: a start, and those of the bifurcations."""
        joints, vectors = self.arrays["orbit_joints"], self.arrays["orbit_vectors"]
        residuals = self.arrays["orbit_residuals"].tolist()
        entries = self.header["orbits"]
        systems = [self.systems[entry["system"]] for entry in entries]
        starts = [0, *accumulate(system.segments for system in systems)]
        self._expect(joints.shape == (starts[-1], 1 + len(self.model.states)))
        self._expect(len(vectors) == len(residuals) == len(entries))
        self._expect(not entries or vectors.shape[1] == len(self.model.parameters))
        return [
            Orbit(
                system,
                joints[start : start + system.segments].copy(),
                vectors[i].copy(),
                residuals[i],
                Status[entries[i]["status"]],
            )
            for i, (system, start) in enumerate(zip(systems, starts[:-1], strict=True))
        ]

    @cached_property
    def bifurcations(self) -> list[Bifurcation]:
        """The bifurcations."""
        values = iter(self.arrays["bifurcation_params"].tolist())
        positions = self.arrays["bifurcation_positions"].tolist()
        return [
            Bifurcation(
                Kind(entry["kind"]),
                {name: next(values) for name in entry["params"]},
                self.orbits[entry["orbit"]],
                tuple(Test(Margin(m), segment, s) for m, segment, s in entry["tests"]),
                position,
                entry["stable_before"],
                entry["stable_after"],
                entry.get("located", True),
                entry.get("accuracy", ACCURACY),
                tuple(
                    Proposal(reason, Verdict(verdict), branch, why)
                    for reason, verdict, branch, why in entry.get("proposals", ())
                ),
            )
            for entry, position in zip(self.header["bifurcations"], positions, strict=True)
        ]

    @cached_property
    def ends(self) -> list[End]:
        """The ends of branches."""
        return [
            End(
                EndReason[entry["reason"]],
                entry["message"],
                None if entry["bifurcation"] is None else self.bifurcations[entry["bifurcation"]],
            )
            for entry in self.header["ends"]
        ]

    @cached_property
    def branches(self) -> list[Branch]:
        """The branches."""
        return [self._branch(i, entry) for i, entry in enumerate(self.header["branches"])]

    def _branch(self, index: int, entry: Header) -> Branch:
        system = self.systems[entry["system"]]
        found = {name: self.arrays[f"branch{index}_{name}"] for name in BRANCH_ARRAYS}
        shape = (len(found["values"]), system.segments, 1 + len(self.model.states))
        self._expect(found["joints"].shape == shape)
        self._expect(found["vector"].shape == (len(self.model.parameters),))
        self._expect(len(found["arc"]) == len(found["labels"]) == shape[0])
        if found["labels"].shape[1:] != (len(system.layout.labels),):
            found["labels"] = _labelled(system, entry["parameter"], found)
        stability = entry["stability"]
        first, last = (self.ends[i] for i in entry["ends"])
        return Branch(
            system=system,
            parameter=entry["parameter"],
            turn_multipliers=self.arrays[f"branch{index}_turn_multipliers"] if stability else None,
            bifurcations=tuple(self.bifurcations[i] for i in entry["bifurcations"]),
            ends=(first, last),
            mirrored=entry["mirrored"],
            notes=tuple(entry.get("notes", ())),
            **found,
        )

    def diagram(self, entry: Header) -> Diagram:
        """Return the diagram of a header entry."""
        low, high = self.arrays["range"].tolist()
        return Diagram(
            model=self.model,
            parameter=entry["parameter"],
            range=(low, high),
            branches=tuple(self.branches[i] for i in entry["branches"]),
            nodes=tuple(
                Node(self.bifurcations[n["bifurcation"]], tuple(n["branches"]), n["mirrored"])
                for n in entry["nodes"]
            ),
            loose_ends=tuple(
                LooseEnd(loose["branch"], loose["side"], self.ends[loose["end"]])
                for loose in entry["loose_ends"]
            ),
            complete=entry["complete"],
            notes=tuple(entry["notes"]),
            settings=_asked(entry.get("settings", {})),
            verification=_verification(entry.get("verification")),
        )

    @staticmethod
    def _expect(holds: bool) -> None:
        if not holds:
            raise ValueError("arrays do not fit each other")


def _labelled(system: System, parameter: str, arrays: Arrays) -> IntArray:
    """Return what the segments of a branch cross, where an earlier version has watched other surfaces."""
    active, rows = system.model.index_of(parameter), []
    for joints, value in zip(arrays["joints"], arrays["values"], strict=True):
        vector = arrays["vector"].copy()
        vector[active] = value
        rows.append(Orbit(system, joints.copy(), vector, 0.0, Status.CONVERGED).labels)
    return np.array(rows, dtype=np.int64).reshape(len(rows), len(system.layout.labels))


def _asked(entry: Header) -> Asked:
    """Return what a diagram was asked for; JSON has lists where it has pairs."""
    stops = tuple((name, value) for name, value in entry.get("stop_at", ()))
    return Asked(**{**entry, "stop_at": stops})


def _verification(entry: Header | None) -> Verification | None:
    """Return what a diagram was held against, from its header entry."""
    if entry is None:
        return None
    restarts = tuple(
        Restart(**{**r, "missing": tuple(r["missing"]), "extra": tuple(r["extra"])})
        for r in entry["restarts"]
    )
    balances = tuple(Balance(**b) for b in entry["balances"])
    return Verification(restarts, balances, tuple(IndexSum(**s) for s in entry["sums"]))
