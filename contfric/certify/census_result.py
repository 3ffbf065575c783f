"""What was proved of all period-1 orbits with a stick at given parameters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from contfric.orbit.orbit import Orbit

if TYPE_CHECKING:
    from flint import arb


@dataclass(frozen=True, eq=False)
class ProvedOrbit:
    """A period-1 orbit with a stick that was proved to exist.

    Attributes
    ----------
    orbit : Orbit
        Refined by Newton's method from the proved one.
    phases : tuple of arb
        Phases of its releases at ``u = S0``, in [0, T).
    multiplier : arb
        Its Floquet multiplier that is not 0 (a stick makes the other one 0).
    symmetric : bool
        Whether it is its own symmetry image. Of two that are images of each other one is listed, as ``pair``.
    pair : bool
    """

    orbit: Orbit
    phases: tuple[arb, ...]
    multiplier: arb
    symmetric: bool
    pair: bool

    @property
    def stable(self) -> bool | None:
        """Whether it is asymptotically stable, as far as that is proved."""
        if abs(self.multiplier) < 1:
            return True
        return False if abs(self.multiplier) > 1 else None


@dataclass(frozen=True)
class Strip:
    """An interval of phases of which is not known whether an orbit is released in it, and why."""

    first: float
    last: float
    why: str

    def __str__(self) -> str:
        return f"phases {self.first:.12g} to {self.last:.12g}: {self.why}"


@dataclass(frozen=True, eq=False)
class CensusCertificate:
    """All period-1 orbits with a stick; the result of :func:`contfric.certify_census`.

    Attributes
    ----------
    params : dict
        All parameters by name, exact binary numbers.
    orbits : tuple of ProvedOrbit
        Each proved to exist.
    strips : tuple of Strip
        Undecided phases: orbits that are released at no other phase than these are not excluded.
    intervals : int
        On so many intervals of phases it was decided.

    Examples
    --------
    >>> import contfric as cf
    >>> found = cf.certify_census("coulomb", {"Omega": 0.5, "S": 0.8, "S0": 0.9})
    >>> found.proved, [(one.orbit.name, one.stable) for one in found.orbits]
    (True, [('2s', True)])
    """

    params: dict[str, float]
    orbits: tuple[ProvedOrbit, ...]
    strips: tuple[Strip, ...]
    intervals: int

    @property
    def proved(self) -> bool:
        """Whether it is proved that no other orbit exists."""
        return not self.strips

    @property
    def why(self) -> str:
        """What is not decided, a strip each; empty if all is."""
        return "; ".join(str(strip) for strip in self.strips)

    def __str__(self) -> str:
        """Say it in a few lines."""
        at = ", ".join(f"{name}={value:g}" for name, value in self.params.items())
        head = (
            "no other one exists: proved"
            if self.proved
            else f"undecided: {len(self.strips)} strips"
        )
        lines = [f"period-1 orbits with a stick at {at}: {len(self.orbits)}; {head}"]
        for found in self.orbits:
            kind = "symmetric" if found.symmetric else "and its image" if found.pair else ""
            phases = ", ".join(str(t.str(15, radius=False)) for t in found.phases)
            size = found.multiplier.str(8, radius=False)
            lines.append(
                f"  {found.orbit.name}{f', {kind}' if kind else ''}: released at phase {phases}; "
                f"multiplier {size}"
            )
        return "\n".join([*lines, *(f"  undecided {strip}" for strip in self.strips)])
