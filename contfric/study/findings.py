"""What a run has found so far; each part is None until it is there."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from contfric.atlas.diagram import Diagram
from contfric.continuation.branch import Branch
from contfric.orbit.orbit import Orbit

if TYPE_CHECKING:
    from contfric.atlas.plane import Plane
    from contfric.chaos.map import LyapunovMap
    from contfric.study.responses import Response


@dataclass(eq=False)
class Findings:
    """The results of a run, as they come.

    Attributes
    ----------
    orbit : the orbit of the start
    branch : the branch, if the study continues one
    diagram : the diagram, if the study has a task in one parameter
    plane : the curves of a plane of two parameters
    lyapunov : the map of Lyapunov exponents
    responses : sweeps and other simulated responses, by their keys
    """

    orbit: Orbit | None = None
    branch: Branch | None = None
    diagram: Diagram | None = None
    plane: Plane | None = None
    lyapunov: LyapunovMap | None = None
    responses: dict[str, Response] = field(default_factory=dict)

    @property
    def empty(self) -> bool:
        """Whether nothing has been found."""
        return self.orbit is None and self.lyapunov is None and not self.responses
