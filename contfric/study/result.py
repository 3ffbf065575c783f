"""The result of a run: what was found, how it ended, and where its files are."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from contfric.base.shown import Shown
from contfric.errors import ResultFileError
from contfric.study.read import Study
from contfric.study.tasks.branch import ContinueTask

if TYPE_CHECKING:
    from contfric.atlas.diagram import Diagram
    from contfric.atlas.plane.plane import Plane
    from contfric.chaos.map import LyapunovMap
    from contfric.continuation.branch import Branch
    from contfric.curves.of_quantities.curve import QuantityCurve
    from contfric.curves.of_quantities.extremum import ExtremumCurve
    from contfric.ensembles.ensemble import Ensemble
    from contfric.equilibria.explore import EquilibriumDiagram
    from contfric.fitting.result import Fit
    from contfric.orbit.orbit import Orbit
    from contfric.response.basins import Basins
    from contfric.response.returns import ReleaseMap, Returns
    from contfric.response.stable_set import StableSet
    from contfric.response.sweep import Sweep
    from contfric.study.tasks.task import Found


class RunStatus(str, Enum):
    """How a run ended."""

    DONE = "done"
    INTERRUPTED = "interrupted"
    FAILED = "some tasks failed"
    UNWRITTEN = "some files could not be written"


@dataclass(frozen=True, eq=False)
class StudyResult(Shown):
    """What a run found and where it is.

    Attributes
    ----------
    study : Study
    out : Path
        The folder of the results.
    status : RunStatus
    info : dict
        The content of ``run.json``.
    files : tuple of Path
        The files written.
    goes_on : bool
        Whether a checkpoint was left, from which the same call goes on.
    found : dict
        What was found, by its name: ``orbit``, ``diagram``, ``plane``, ``lyapunov``, ``sweep``, ``poincare``,
        ``release_map``, ``basins``, ``equilibria``, ``ensemble``. Each is an attribute, too; None if it was
        not asked for, or the run was interrupted before.
    """

    study: Study
    out: Path
    status: RunStatus
    found: Found
    info: dict[str, Any]
    files: tuple[Path, ...]
    goes_on: bool = False

    @property
    def orbit(self) -> Orbit | None:
        """The orbit of the start."""
        return self.found.get("orbit")

    @property
    def branch(self) -> Branch | None:
        """The branch, if the study continues one."""
        alone = isinstance(self.study.task, ContinueTask) and self.diagram is not None
        return self.diagram.branches[0] if alone and self.diagram else None

    @property
    def diagram(self) -> Diagram | None:
        """The diagram, if the study explores or continues."""
        return self.found.get("diagram")

    @property
    def plane(self) -> Plane | None:
        """The curves of a plane."""
        return self.found.get("plane")

    @property
    def lyapunov(self) -> LyapunovMap | None:
        """The map of Lyapunov exponents."""
        return self.found.get("lyapunov")

    @property
    def sweep(self) -> Sweep | None:
        """The sweep."""
        return self.found.get("sweep")

    @property
    def poincare(self) -> Returns | None:
        """The points of a section."""
        return self.found.get("poincare")

    @property
    def release_map(self) -> ReleaseMap | None:
        """The map of releases."""
        return self.found.get("release_map")

    @property
    def basins(self) -> Basins | None:
        """The basins."""
        return self.found.get("basins")

    @property
    def stable_set(self) -> StableSet | None:
        """The stable set of the orbit of the start."""
        return self.found.get("stable_set")

    @property
    def hold(self) -> QuantityCurve | None:
        """The orbits on which a quantity has one value."""
        return self.found.get("hold")

    @property
    def extremum(self) -> ExtremumCurve | None:
        """The orbits at which a quantity is extreme."""
        return self.found.get("extremum")

    @property
    def fit(self) -> Fit | None:
        """The parameters from measurements."""
        return self.found.get("fit")

    @property
    def equilibria(self) -> EquilibriumDiagram | None:
        """The branches of equilibria."""
        return self.found.get("equilibria")

    @property
    def ensemble(self) -> Ensemble | None:
        """The ensemble."""
        return self.found.get("ensemble")

    def __repr__(self) -> str:
        return f"<StudyResult {self.study.name}: {self.status.value}, in {self.out}>"


class UnwrittenError(ResultFileError):
    """Some files could not be written; ``result`` holds everything that was computed."""

    def __init__(self, message: str, result: StudyResult) -> None:
        super().__init__(message)
        self.result = result
