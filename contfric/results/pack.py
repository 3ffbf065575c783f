"""From orbits, branches and diagrams to a header (JSON) and arrays, every object once.

Bifurcations, ends and orbits that several parts of a diagram share are stored once and shared again
after loading. All floating-point numbers are in arrays, so that nothing is rounded.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contfric.atlas.diagram import Diagram
from contfric.continuation.branch import Branch
from contfric.continuation.events import Bifurcation, End
from contfric.errors import ResultFileError
from contfric.models.definition import Model
from contfric.orbit.orbit import Orbit
from contfric.orbit.system import System, build_system

Header = dict[str, Any]
Arrays = dict[str, NDArray[Any]]

#: Arrays of a branch, each stored as ``branch<i>_<name>``.
BRANCH_ARRAYS = ("vector", "values", "joints", "arc", "labels")


@dataclass
class Packer:
    """Collects objects; each is packed when it is first met and known by its index."""

    model: Model
    systems: list[Header] = field(default_factory=list)
    orbits: list[Orbit] = field(default_factory=list)
    bifurcations: list[Bifurcation] = field(default_factory=list)
    ends: list[End] = field(default_factory=list)
    branches: list[Header] = field(default_factory=list)
    arrays: Arrays = field(default_factory=dict)
    _places: dict[object, int] = field(default_factory=dict)

    def system(self, system: System) -> int:
        """Return the index of a system."""
        if system.model.name != self.model.name:
            raise ResultFileError(
                f"orbits of '{system.model.name}' and '{self.model.name}' cannot be in one file"
            )
        key = (system.word, system.periods, system.half)
        if key not in self._places:
            _check_reduced(system)
            self._places[key] = len(self.systems)
            word = [list(pair) for pair in system.word]
            entry = {"word": word, "periods": system.periods, "half": system.half}
            self.systems.append(entry)
        return self._places[key]

    def orbit(self, orbit: Orbit) -> int:
        """Return the index of an orbit."""
        return self._index(orbit, self.orbits)

    def bifurcation(self, bifurcation: Bifurcation) -> int:
        """Return the index of a bifurcation."""
        return self._index(bifurcation, self.bifurcations)

    def end(self, end: End) -> int:
        """Return the index of an end."""
        return self._index(end, self.ends)

    def _index(self, item: Any, items: list[Any]) -> int:
        # the list keeps the object alive, so that its id stays its own
        if id(item) not in self._places:
            self._places[id(item)] = len(items)
            items.append(item)
        return self._places[id(item)]

    def branch(self, branch: Branch) -> int:
        """Return the index of a branch; its arrays are stored as they are."""
        index = len(self.branches)
        for name in BRANCH_ARRAYS:
            self.arrays[f"branch{index}_{name}"] = getattr(branch, name)
        if branch.turn_multipliers is not None:
            self.arrays[f"branch{index}_turn_multipliers"] = branch.turn_multipliers
        self.branches.append(
            {
                "system": self.system(branch.system),
                "parameter": branch.parameter,
                "bifurcations": [self.bifurcation(b) for b in branch.bifurcations],
                "ends": [self.end(end) for end in branch.ends],
                "mirrored": branch.mirrored,
                "notes": list(branch.notes),
                "stability": branch.turn_multipliers is not None,
            }
        )
        return index

    def diagram(self, diagram: Diagram) -> Header:
        """Return the header of a diagram."""
        self.arrays["range"] = np.array(diagram.range, dtype=np.float64)
        return {
            "parameter": diagram.parameter,
            "branches": [self.branch(branch) for branch in diagram.branches],
            "nodes": [
                {
                    "bifurcation": self.bifurcation(n.bifurcation),
                    "branches": list(n.branches),
                    "mirrored": n.mirrored,
                }
                for n in diagram.nodes
            ],
            "loose_ends": [
                {"branch": loose.branch, "side": loose.side, "end": self.end(loose.end)}
                for loose in diagram.loose_ends
            ],
            "complete": diagram.complete,
            "notes": list(diagram.notes),
            "settings": asdict(diagram.settings),
            "verification": None if diagram.verification is None else asdict(diagram.verification),
        }

    def finish(self) -> Header:
        """Return the header of everything collected, and store the remaining arrays."""
        # ends may name bifurcations that no list does, and those their orbits
        ends = [
            {
                "reason": end.reason.name,
                "message": end.message,
                "bifurcation": (
                    None if end.bifurcation is None else self.bifurcation(end.bifurcation)
                ),
            }
            for end in self.ends
        ]
        bifurcations = [self._bifurcation_entry(b) for b in self.bifurcations]
        self.arrays["bifurcation_params"] = np.array(
            [value for b in self.bifurcations for value in b.params.values()], dtype=np.float64
        )
        self.arrays["bifurcation_positions"] = np.array(
            [b.position for b in self.bifurcations], dtype=np.float64
        )
        orbits = [{"system": self.system(o.system), "status": o.status.name} for o in self.orbits]
        width = 1 + len(self.model.states)
        joints = [o.joints for o in self.orbits]
        self.arrays["orbit_joints"] = np.concatenate([np.empty((0, width)), *joints])
        self.arrays["orbit_vectors"] = np.array([o.vector for o in self.orbits], dtype=np.float64)
        residuals = [orbit.residual for orbit in self.orbits]
        self.arrays["orbit_residuals"] = np.array(residuals, dtype=np.float64)
        return {
            "systems": self.systems,
            "orbits": orbits,
            "bifurcations": bifurcations,
            "ends": ends,
            "branches": self.branches,
        }

    def _bifurcation_entry(self, bifurcation: Bifurcation) -> Header:
        return {
            "kind": bifurcation.kind.value,
            "params": list(bifurcation.params),
            "orbit": self.orbit(bifurcation.orbit),
            "tests": [[t.margin.value, t.segment, t.surface] for t in bifurcation.tests],
            "stable_before": bifurcation.stable_before,
            "stable_after": bifurcation.stable_after,
            "located": bifurcation.located,
            "accuracy": bifurcation.accuracy,
            "proposals": [
                [p.reason, p.verdict.value, p.branch, p.why] for p in bifurcation.proposals
            ],
        }


def _check_reduced(system: System) -> None:
    """Refuse a system in full seven-domain form: its word alone does not give it back."""
    try:
        rebuilt = build_system(system.model, system.word, system.periods, system.half)
    except ValueError:
        rebuilt = None
    if rebuilt is None or rebuilt.tests != system.tests:
        raise ResultFileError(
            "an orbit in the full form, with a joint at every surface, cannot be saved: save the "
            "orbit of the reduced form"
        )
