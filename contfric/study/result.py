"""What a run returns: what was found, how it ended, and where it is."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from contfric.atlas.diagram import Diagram
from contfric.continuation.branch import Branch
from contfric.errors import ResultFileError
from contfric.orbit.orbit import Orbit
from contfric.shown import Shown
from contfric.study.read import Study

if TYPE_CHECKING:
    from contfric.atlas.plane import Plane
    from contfric.chaos.map import LyapunovMap
    from contfric.ensembles.ensemble import Ensemble
    from contfric.equilibria.explore import EquilibriumDiagram
    from contfric.response.basins import Basins
    from contfric.response.returns import Returns
    from contfric.response.sweep import Sweep
    from contfric.study.responses import Response


class RunStatus(str, Enum):
    """How a run ended."""

    DONE = "done"
    INTERRUPTED = "interrupted"
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
    orbit : Orbit or None
        The orbit of the start; None if nothing needs it, or the run was interrupted before.
    branch : Branch or None
        The branch, if the study continues one.
    diagram : Diagram or None
        The diagram, if the study has a task.
    plane : Plane or None
        The curves of a plane, if the study has one.
    lyapunov : LyapunovMap or None
        The map of Lyapunov exponents, if the study asks for one.
    info : dict
        The content of ``run.json``.
    files : tuple of Path
        The files written.
    goes_on : bool
        Whether a checkpoint was left, from which the same call goes on.
    responses : dict
        Simulated responses by their keys in the study.
    """

    study: Study
    out: Path
    status: RunStatus
    orbit: Orbit | None
    branch: Branch | None
    diagram: Diagram | None
    plane: Plane | None
    lyapunov: LyapunovMap | None
    info: dict[str, Any]
    files: tuple[Path, ...]
    goes_on: bool = False
    responses: dict[str, Response] = field(default_factory=dict)

    @property
    def sweep(self) -> Sweep | None:
        """The sweep, if the study asks for one."""
        found = self.responses.get("sweep")
        return None if found is None else cast("Sweep", found)

    @property
    def poincare(self) -> Returns | None:
        """The points of a section, if the study asks for them."""
        found = self.responses.get("poincare")
        return None if found is None else cast("Returns", found)

    @property
    def basins(self) -> Basins | None:
        """The basins, if the study asks for them."""
        found = self.responses.get("basins")
        return None if found is None else cast("Basins", found)

    @property
    def ensemble(self) -> Ensemble | None:
        """The ensemble, if the study asks for one."""
        found = self.responses.get("ensemble")
        return None if found is None else cast("Ensemble", found)

    @property
    def equilibria(self) -> EquilibriumDiagram | None:
        """The branches of equilibria, if the study asks for them."""
        found = self.responses.get("equilibria")
        return None if found is None else cast("EquilibriumDiagram", found)

    def __repr__(self) -> str:
        return f"<StudyResult {self.study.name}: {self.status.value}, in {self.out}>"


class UnwrittenError(ResultFileError):
    """Some files could not be written; ``result`` holds everything that was computed."""

    def __init__(self, message: str, result: StudyResult) -> None:
        super().__init__(message)
        self.result = result
