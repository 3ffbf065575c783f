"""What was proved of an orbit."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from contfric.base.shown import Shown
from contfric.certify.limit import LATE
from contfric.certify.verdict import Finding, Verdict, all_of

if TYPE_CHECKING:
    from flint import acb, arb

    from contfric.orbit.orbit import Orbit


@dataclass(frozen=True, eq=False, repr=False)
class Certificate(Shown):
    """What was proved of an orbit, at its parameters taken as the exact binary numbers that they are.

    Attributes
    ----------
    orbit : Orbit
        The printed orbit.
    exists : Finding
        There is a solution of the chain of equations within ``radii`` of the printed joints.
    unique : Finding
        There is no other one.
    admissible : Finding
        It obeys every inequality over the whole of every segment.
    stable : Finding
        All Floquet multipliers lie inside of the unit circle; refuted means: proved unstable.
    radii : list of arb
        Half-widths of the box around the printed joints, in the order t_0, y_0, t_1, ...
    enclosure : list of arb
        The joints of the solution, in the same order; empty if it was not found.
    multipliers : list of acb
        Discs that contain the multipliers of one turn (half of a symmetric orbit), largest first.
    precision : int
        Bits that were needed.
    kept : int
        How many numbers the orbit keeps, whatever they are, as contacts never slip: it is unique among those
        that keep what the printed one does, and the multipliers 1 of the others are not among its own.
    ended : bool
        Whether a time limit ended the work; what it has shown until then stands.
    """

    orbit: Orbit
    exists: Finding
    unique: Finding
    admissible: Finding
    stable: Finding
    radii: list[arb]
    enclosure: list[arb]
    multipliers: list[acb]
    precision: int
    kept: int = 0
    ended: bool = False

    @property
    def proved(self) -> bool:
        """Whether the orbit is proved: existence, local uniqueness, admissibility and its stability.

        The stability that is proved must be the one that the orbit states.
        """
        wanted = Verdict.PROVED if self.orbit.stable else Verdict.REFUTED
        whole = all_of([self.exists, self.unique, self.admissible])
        return whole.proved and (bool(self.orbit.system.holds) or self.stable.verdict is wanted)

    @property
    def proved_but_unique(self) -> bool:
        """Whether all is proved, but perhaps that no other orbit is so near."""
        return replace(self, unique=Finding(Verdict.PROVED)).proved

    @property
    def why(self) -> str:
        """What is not proved, and why; empty if all is."""
        if self.proved:
            return ""
        named = (
            ("existence", self.exists),
            ("uniqueness", self.unique),
            ("admissibility", self.admissible),
        )
        found = [f"{name} {finding}" for name, finding in named if not finding.proved]
        if self.stable.verdict is Verdict.UNDECIDED:
            found.append(f"stability {self.stable}")
        elif not found:
            found.append("the stability that is proved is not the one that the orbit states")
        if self.ended and not any(LATE in text for text in found):
            found.append(f"more digits {LATE}")
        return "; ".join(found)

    @property
    def width(self) -> float:
        """Largest half-width of the enclosure of the joints; infinite without one."""
        return max((float(x.rad()) for x in self.enclosure), default=float("inf"))

    def save(self, path: Any) -> None:
        """Write the certificate as a JSON file, which ``contfric verify`` checks.

        Raises
        ------
        ResultFileError
            If the file cannot be written.
        """
        from contfric.certify.files import write_certificate

        write_certificate(self, path)

    def __repr__(self) -> str:
        return f"<Certificate of {self.orbit!r}: {'proved' if self.proved else self.why}>"

    def __str__(self) -> str:
        """Say each statement and what became of it, a line each."""
        lines = [
            f"{self.orbit!r}",
            f"  exists       {self.exists}",
            f"  unique       {self.unique}, within {_largest(self.radii):.1e} of the printed joints",
            f"  admissible   {self.admissible}",
            f"  stable       {self.stable}",
        ]
        if self.kept:
            lines.append(
                f"  family       unique among those that keep {self.kept} numbers as it does"
            )
        if self.enclosure:
            lines.append(f"  enclosure    joints known to {self.width:.1e}, {self.precision} bits")
        half = " (of the half-period map)" if self.orbit.system.half else ""
        lines += [f"  multiplier   {mu.str(12)}{half}" for mu in self.multipliers]
        return "\n".join(lines)


def _largest(radii: list[arb]) -> float:
    return max((float(r) for r in radii), default=float("nan"))
