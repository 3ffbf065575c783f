"""Equilibria as results: points, sets of them, and all that a model has at some parameters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.base.shown import AtParameters
from contfric.base.tabled import as_table
from contfric.models.definition import Model

if TYPE_CHECKING:
    import pandas as pd

    from contfric.equilibria.regions import ModeRegion

ComplexArray = NDArray[np.complex128]
#: A real part smaller than this share of the largest eigenvalue is zero to rounding: the root of rounding, as
#: a double eigenvalue is known no better.
_ZERO = 1e-8


class Location(str, Enum):
    """Where a zero of a mode's field lies; the text says what that means."""

    ADMISSIBLE = "admissible: inside of the region of its mode"
    BOUNDARY = "on the boundary of the region of its mode"
    VIRTUAL = "virtual: outside of the region of its mode, so that no solution rests there"


@dataclass(frozen=True, eq=False)
class Rest(AtParameters):
    """A state at which one mode rests: what an equilibrium and a set of them have in common."""

    region: ModeRegion
    vector: FloatArray
    state: FloatArray

    @property
    def model(self) -> Model:
        """The model that rests."""
        return self.region.model

    @property
    def mode(self) -> str:
        """Name of its mode."""
        return self.region.mode

    @property
    def pseudo(self) -> bool:
        """Whether it is a pseudo-equilibrium: of a mode that lies on a surface."""
        return bool(self.region.on)


@dataclass(frozen=True, eq=False)
class Equilibrium(Rest):
    """A zero of the field of one mode.

    Attributes
    ----------
    region : the mode and where it holds
    vector : ndarray, shape (parameters,)
    state : ndarray, shape (n,)
    eigenvalues : ndarray, shape (n - k,)
        Of the field within the k surfaces that the mode lies on; the largest real part first.
    location : Location
    violated : tuple of str
        Surfaces and kinks on whose wrong side it is.

    Examples
    --------
    >>> import contfric as cf
    >>> [rest] = cf.find_equilibria("belt")
    >>> rest.mode, rest.state.round(9).tolist(), rest.stable
    ('rise', [0.625, 0.0], False)
    """

    eigenvalues: ComplexArray
    location: Location
    violated: tuple[str, ...] = ()

    @property
    def admissible(self) -> bool:
        """Whether it lies inside of the region of its mode."""
        return self.location is Location.ADMISSIBLE

    @property
    def stable(self) -> bool | None:
        """Whether it attracts what is near; None where its eigenvalues do not tell.

        A pseudo-equilibrium has to attract within its surface, to which the fields next to it have to lead.
        """
        if self.pseudo and not self.region.attracts(self.state, self.vector):
            return False
        return is_stable(self.eigenvalues)

    def __repr__(self) -> str:
        kind = "pseudo-equilibrium" if self.pseudo else "equilibrium"
        at = ", ".join(f"{s}={v:.6g}" for s, v in zip(self.model.states, self.state, strict=True))
        stable = {True: "stable", False: "unstable", None: "stability undecided"}[self.stable]
        return f"<{kind} of {self.mode}: {at}; {stable}, {self.location.name.lower()}>"


def is_stable(eigenvalues: ComplexArray) -> bool | None:
    """Return whether all real parts are negative; None where the largest is zero to rounding.

    Examples
    --------
    >>> is_stable(np.array([-1 + 2j, -1 - 2j])), is_stable(np.array([1j, -1j]))
    (True, None)
    """
    if not len(eigenvalues):
        return True
    largest, size = float(np.max(eigenvalues.real)), float(np.max(np.abs(eigenvalues)))
    return None if abs(largest) <= _ZERO * size else largest < 0.0


@dataclass(frozen=True, eq=False)
class EquilibriumSet(Rest):
    """A whole set of equilibria: every state of it is one, as where a mass that sticks is at rest.

    Attributes
    ----------
    region, vector : as of an equilibrium
    state : ndarray, shape (n,)
        One of them.
    directions : ndarray, shape (dimension, n)
        Unit vectors along the set, at that state.
    states : ndarray, shape (k, n)
        Along a set of dimension 1, from end to end; ``state`` alone for others.
    ends : tuple of (surface, state)
        Where a set of dimension 1 leaves the region of its mode, in both directions; empty for others, and
        where nothing bounds it.
    eigenvalues : ndarray
        Of the field within the surfaces of the mode, but one zero for each dimension.
    """

    directions: FloatArray
    states: FloatArray
    ends: tuple[tuple[str, FloatArray], ...]
    eigenvalues: ComplexArray

    @property
    def dimension(self) -> int:
        """Dimension of the set."""
        return len(self.directions)

    @property
    def stable(self) -> bool | None:
        """Whether the set attracts within its surface, by its other eigenvalues."""
        return is_stable(self.eigenvalues)

    def __repr__(self) -> str:
        ends = " to ".join(f"{s} {np.round(y, 6).tolist()}" for s, y in self.ends)
        where = f"from {ends}" if ends else f"through {np.round(self.state, 6).tolist()}"
        return f"<set of equilibria of {self.mode}, dimension {self.dimension}, {where}>"


@dataclass(frozen=True, eq=False, repr=False)
class Equilibria(AtParameters):
    """All equilibria that were found at some parameters; the result of :func:`contfric.find_equilibria`.

    Attributes
    ----------
    points : tuple of Equilibrium
    sets : tuple of EquilibriumSet
    complete : mapping of mode to bool
        Whether all equilibria of a mode are known: where its field is affine. Else those are that Newton's
        method found from many starts.

    Examples
    --------
    >>> import contfric as cf
    >>> found = cf.find_equilibria("popp", {"F": 0.0})
    >>> [point.stable for point in found.points]
    [False, False]
    """

    model: Model
    vector: FloatArray
    points: tuple[Equilibrium, ...]
    sets: tuple[EquilibriumSet, ...]
    complete: Mapping[str, bool]

    def __repr__(self) -> str:
        return (
            f"<Equilibria of {self.model.name}: {len(self.points)} points, {len(self.sets)} sets>"
        )

    def __iter__(self) -> Iterator[Equilibrium]:
        """Go through the equilibria where motion can rest: those that are admissible."""
        return (e for e in self.points if e.admissible)

    def __len__(self) -> int:
        return sum(e.admissible for e in self.points)

    def __getitem__(self, index: int) -> Equilibrium:
        found: list[Equilibrium] = list(self)
        return found[index]

    @property
    def virtual(self) -> tuple[Equilibrium, ...]:
        """Zeros of fields outside of their regions."""
        return tuple(e for e in self.points if e.location is Location.VIRTUAL)

    def to_dataframe(self) -> pd.DataFrame:
        """Return one row for each equilibrium, virtual ones too (needs pandas)."""
        rows: list[dict[str, Any]] = []
        for e in self.points:
            row: dict[str, Any] = {"mode": e.mode, "location": e.location.name.lower()}
            row |= {"pseudo": e.pseudo, "stable": e.stable}
            rows.append(row | dict(zip(self.model.states, e.state.tolist(), strict=True)))
        return as_table(rows)

    def __str__(self) -> str:
        values = ", ".join(f"{k} = {v:g}" for k, v in self.params.items())
        lines = [f"equilibria of {self.model.name} at {values}"]
        lines += [f"  {e!r}" for e in (*self.points, *self.sets)] or ["  none"]
        unsure = [mode for mode, known in self.complete.items() if not known]
        if unsure:
            lines.append(f"  perhaps more in {', '.join(unsure)}: searched by Newton's method")
        return "\n".join(lines)
