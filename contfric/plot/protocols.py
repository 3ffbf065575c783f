"""What the drawings need to know of an orbit, a branch and a diagram.

Drawing stands below the results that it draws; it knows them by what they offer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from contfric.models import Model
from contfric.models.definition import FloatArray


class SignatureLike(Protocol):
    """A closed walk through the domains of a model."""

    @property
    def segments(self) -> Sequence[str]:
        """Names of the domains in the order of the visit."""


class OrbitLike(Protocol):
    """A periodic orbit."""

    @property
    def model(self) -> Model:
        """The model that moves."""

    @property
    def params(self) -> Mapping[str, float]:
        """All parameters by name."""

    @property
    def vector(self) -> FloatArray:
        """Parameters in the order of the model."""

    @property
    def name(self) -> str:
        """Name such as ``2s``."""

    @property
    def period(self) -> float:
        """Duration of the orbit."""

    @property
    def periods(self) -> int:
        """Number of excitation periods."""

    @property
    def word(self) -> Sequence[tuple[str, str]]:
        """Mode and exit surface of each segment."""

    @property
    def cycle(self) -> FloatArray:
        """Start time and state of each segment, shape (segments, 1 + n)."""

    @property
    def begins(self) -> FloatArray:
        """The same behind resets."""

    @property
    def ends(self) -> FloatArray:
        """End time and state of each segment, shape (segments, 1 + n)."""

    @property
    def x_max(self) -> float:
        """Largest value of the first state."""

    @property
    def x_min(self) -> float:
        """Smallest value of the first state."""

    @property
    def stops(self) -> FloatArray:
        """Displacements at the stops, shape (stops,)."""

    def state(self, time: float) -> FloatArray:
        """Return the state at a time, shape (n,)."""


class KindLike(Protocol):
    """A kind of bifurcation."""

    @property
    def value(self) -> str:
        """Short name such as ``SN``."""

    @property
    def meaning(self) -> str:
        """One line for a legend."""


class BifurcationLike(Protocol):
    """A located event."""

    @property
    def kind(self) -> KindLike:
        """What it is."""

    @property
    def params(self) -> Mapping[str, float]:
        """Parameters at which it happens."""

    @property
    def orbit(self) -> OrbitLike:
        """The orbit there."""

    @property
    def label(self) -> str:
        """Name such as ``CS_s``."""

    @property
    def meaning(self) -> str:
        """One line for a legend, of what happens in this model."""

    @property
    def position(self) -> float:
        """Arclength on the branch."""

    @property
    def stable_before(self) -> bool | None:
        """Stability at smaller values of the parameter; at a fold, before it on the branch."""

    @property
    def stable_after(self) -> bool | None:
        """Stability at larger values of the parameter; at a fold, behind it on the branch."""


class EndLike(Protocol):
    """Why a branch ends."""

    @property
    def bifurcation(self) -> BifurcationLike | None:
        """The event that ends it, if any."""


class BranchLike(Protocol):
    """A family of orbits along a parameter."""

    @property
    def model(self) -> Model:
        """The model that moves."""

    @property
    def name(self) -> str:
        """Name such as ``2s``."""

    @property
    def mirrored(self) -> bool:
        """Whether this is the mirror image of a computed branch."""

    @property
    def symmetric(self) -> bool:
        """Whether the orbits are their own mirror images."""

    @property
    def bridge(self) -> bool:
        """Whether the orbits have holds: the branch bridges a jump of the flow."""

    @property
    def parameter(self) -> str:
        """The parameter that varies."""

    @property
    def vector(self) -> FloatArray:
        """The other parameters."""

    @property
    def values(self) -> FloatArray:
        """The parameter at each point, shape (k,)."""

    @property
    def arc(self) -> FloatArray:
        """Arclength at each point, shape (k,)."""

    @property
    def turn_multipliers(self) -> NDArray[np.complex128] | None:
        """Multipliers at each point, shape (k, n); None if not computed."""

    @property
    def stable(self) -> NDArray[np.bool_] | None:
        """Stability at each point, shape (k,); None if not computed."""

    @property
    def bifurcations(self) -> Sequence[BifurcationLike]:
        """Events in the order of the branch."""

    @property
    def ends(self) -> Sequence[EndLike]:
        """Why it ends at its first and at its last point."""


class NodeLike(Protocol):
    """A bifurcation and the branches that meet there."""

    @property
    def bifurcation(self) -> BifurcationLike:
        """The event."""

    @property
    def branches(self) -> Sequence[int]:
        """Indices of the branches that meet there."""


class DiagramLike(Protocol):
    """Branches joined by bifurcations."""

    @property
    def parameter(self) -> str:
        """The parameter that varies."""

    @property
    def range(self) -> tuple[float, float]:
        """Where it was followed."""

    @property
    def branches(self) -> Sequence[BranchLike]:
        """The branches."""

    @property
    def nodes(self) -> Sequence[NodeLike]:
        """Each bifurcation with the branches that meet there."""

    @property
    def bifurcations(self) -> Sequence[BifurcationLike]:
        """Each bifurcation once."""


class LyapunovMapLike(Protocol):
    """Largest Lyapunov exponents on a grid."""

    @property
    def axes(self) -> Mapping[str, FloatArray]:
        """The two parameters that vary, and their values."""

    @property
    def params(self) -> Mapping[str, float]:
        """The parameters that do not vary."""

    @property
    def values(self) -> FloatArray:
        """Largest exponent, shape (len, len); nan where there is none."""

    @property
    def chaotic(self) -> NDArray[np.bool_]:
        """Where it is positive beyond its error, shape (len, len)."""

    def absent(self, missing: bool) -> NDArray[np.bool_]:
        """Tell where no motion has an exponent, or (``missing``) where nothing was computed."""


class SpecialLike(Protocol):
    """A point of codimension two."""

    @property
    def name(self) -> str:
        """What it is, such as ``SN-CS``."""

    @property
    def params(self) -> Mapping[str, float]:
        """The parameters there."""


class CurveLike(Protocol):
    """A curve of bifurcations in two parameters."""

    @property
    def parameters(self) -> tuple[str, str]:
        """The two parameters."""

    @property
    def label(self) -> str:
        """Name in the manner of the reference."""

    @property
    def values(self) -> FloatArray:
        """Both parameters at each point, shape (k, 2)."""

    @property
    def arc(self) -> FloatArray:
        """Arclength at each point, shape (k,)."""

    @property
    def kinds(self) -> Sequence[KindLike]:
        """The bifurcation at each point."""

    @property
    def meanings(self) -> Mapping[str, str]:
        """One line for a legend for each kind of its points."""

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Whether stable orbits are bounded at each point, shape (k,)."""

    @property
    def special(self) -> Sequence[SpecialLike]:
        """Points of codimension two."""


class PlaneLike(Protocol):
    """Curves of a plane."""

    @property
    def ranges(self) -> FloatArray:
        """Limits of both parameters, shape (2, 2)."""

    @property
    def curves(self) -> Sequence[CurveLike]:
        """The curves."""

    @property
    def twins(self) -> Sequence[int]:
        """For each curve the first one of the same motion."""

    @property
    def special(self) -> Sequence[SpecialLike]:
        """Points of codimension two, each once."""
