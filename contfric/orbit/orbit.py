"""A periodic orbit: its joints, and what follows from them when it is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.base.attributes import altered
from contfric.base.extras import need_flint
from contfric.base.renamed import renamed
from contfric.base.tabled import as_table
from contfric.base.tally import tally
from contfric.bvp.linear import of_two_halves, pencil_of_turn
from contfric.bvp.system import Itinerary, System, build_system
from contfric.errors import ParameterError
from contfric.models.definition import Model
from contfric.orbit.clock import clocked
from contfric.orbit.itinerary.itineraries import half_of, mirror_pairs, whole_of
from contfric.orbit.itinerary.read_signature import read_signature
from contfric.orbit.measured.quantities import MeasuredOrbit
from contfric.orbit.measured.samples import samples, state_within
from contfric.orbit.measured.stops import reach_of, stops_of
from contfric.orbit.tolerances import margin_slack, no_time
from contfric.signature import Signature

if not TYPE_CHECKING:
    from contfric.base.attributes import cached_property
if TYPE_CHECKING:
    from functools import cached_property
    from pathlib import Path

    import pandas as pd
    from matplotlib.axes import Axes

    from contfric.certify.certificate import Certificate
    from contfric.models.view import FlowView

ComplexArray = NDArray[np.complex128]
#: Relative to the orbit's size: an orbit nearer than this to its mirror image is symmetric. Between
#: rounding (1e-15) and what a branch point still resolves (the square root of it).
SYMMETRY_TOLERANCE = 1e-9
#: A multiplier this near to 1 makes the orbit one of a continuum to working precision.
DEGENERATE = 1e-9


class Status(str, Enum):
    """Outcome of a Newton solve; the text is the advice."""

    CONVERGED = "converged"
    NOT_CONVERGED = "Newton did not converge: start nearer, from a simulation or a continuation"
    SINGULAR = "the system is singular: a fold, or an orbit that belongs to a continuum"
    NOT_FINITE = "an iterate left the region where the flow is finite: start nearer"


@dataclass(frozen=True, eq=False)
class Orbit(MeasuredOrbit):
    """A periodic orbit of a piecewise-smooth model.

    Attributes
    ----------
    system : System
        The boundary-value problem that it solves.
    joints : ndarray, shape (N, 1 + n)
        Start time and state of each segment of one turn (half of a symmetric orbit).
    vector : ndarray, shape (parameters,)
        Parameters in the order of the model.
    residual : float
        Largest residual of the equations, relative to 1 + the size of the unknown.
    status : Status
        Whether the orbit is solved; an orbit that is not carries the last iterate.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> orbit.name, orbit.stable, round(orbit.x_max, 6)
    ('1a', True, 1.424217)
    """

    system: System
    joints: FloatArray
    vector: FloatArray
    residual: float
    status: Status = Status.CONVERGED

    @cached_property
    def model(self) -> Model:
        """The model that moves."""
        return self.system.model

    @property
    def params(self) -> dict[str, float]:
        """All parameters by name."""
        return self.model.mapping(self.vector)

    @property
    def periods(self) -> int:
        """Number of excitation periods of the orbit; without excitation, how often its itinerary repeats."""
        return self.system.periods

    @property
    def converged(self) -> bool:
        """Whether Newton converged."""
        return self.status is Status.CONVERGED

    @cached_property
    def flow(self) -> FlowView:
        """The model's flow at the orbit's parameters, to be asked by names."""
        return self.model.view(self.vector)

    @cached_property
    def turn(self) -> float:
        """Duration of one turn (half the orbit if it is solved on its half)."""
        if self.model.autonomous:  # a turn ends at time 0
            return -float(self.joints[0, 0])
        return self.system.layout.turn * self.flow.period

    @cached_property
    def period(self) -> float:
        """Duration of the orbit, nondimensional."""
        return self.turn * (2.0 if self.system.half else 1.0)

    # ------------------------------------------------------------------ the whole cycle

    @cached_property
    def itinerary(self) -> Itinerary:
        """Mode and exit surface of each segment of the whole orbit."""
        return whole_of(self.model, self.system.itinerary, self.system.half)

    word = renamed("word", "itinerary")

    @cached_property
    def cycle(self) -> FloatArray:
        """Joints of the whole orbit, shape (segments, 1 + n)."""
        if not self.system.half:
            return self.joints
        other, first = self.joints.copy(), clocked(self.model, self.joints, self.turn)
        other[:, 0] = first[:, 0] + self.turn
        other[:, 1:] = self.joints[:, 1:] @ self.system.layout.closure.T
        return np.vstack([first, other])

    @cached_property
    def ends(self) -> FloatArray:
        """End time and state of each segment of the whole orbit, shape (segments, 1 + n)."""
        ends = np.concatenate((self.cycle[1:], self.cycle[:1]))
        ends[-1, 0] += self.period
        return ends

    @cached_property
    def begins(self) -> FloatArray:
        """Start time and state of each segment of the whole orbit, after resets, shape (segments, 1 + n)."""
        if not self.model.resets:
            return self.cycle
        begins = self.cycle.copy()
        for i, joint in enumerate(self.cycle):
            mode, entry = self.itinerary[i - 1]
            if self.model.reset_at(mode, entry) is not None:
                begins[i, 1:] = self.flow.reset(entry, float(joint[0]), joint[1:])
        return begins

    @cached_property
    def durations(self) -> FloatArray:
        """How long each segment of the whole orbit lasts, shape (segments,)."""
        return np.asarray(self.ends[:, 0] - self.cycle[:, 0])

    def as_whole(self) -> Orbit:
        """Return the same orbit as a problem on its whole cycle."""
        return self._whole if self.system.half else self

    @cached_property
    def _whole(self) -> Orbit:
        system = build_system(self.model, self.itinerary, self.periods)
        return altered(self, system=system, joints=self.cycle)

    def as_half(self) -> Orbit:
        """Return a symmetric orbit as a problem on its half; any other orbit as it is."""
        if self.system.half:
            return self
        half = half_of(self.model, self.system.itinerary, self.periods)
        if half is None or not self.symmetric:
            return self
        system = build_system(self.model, half, self.periods, half=True)
        joints = clocked(self.model, self.joints[: len(half)], float(self.joints[len(half), 0]))
        return altered(self, system=system, joints=joints)

    def doubled(self) -> Orbit:
        """Return the orbit run through twice, as one of twice the period."""
        whole = self.as_whole()
        second = whole.joints.copy()
        second[:, 0] += whole.period
        if not self.model.autonomous and all(
            pair in self.model.sections for pair in whole.itinerary
        ):
            # a smooth cycle is found by one crossing each way, however long it is
            system = build_system(self.model, whole.itinerary, self.periods * 2)
            return altered(whole, system=system)
        system = build_system(self.model, whole.itinerary * 2, self.periods * 2)
        joints = clocked(self.model, np.vstack([whole.joints, second]), whole.period)
        return altered(whole, system=system, joints=joints)

    def mirror(self) -> Orbit:
        """Return the mirror image under the model's symmetry (an orbit of the same parameters)."""
        symmetry = self.model.symmetry
        if symmetry is None:
            raise ParameterError(
                f"model '{self.model.name}' has no symmetry: an orbit has no mirror image"
            )
        joints = self.joints.copy()
        if not self.model.autonomous:
            joints[:, 0] += symmetry.fraction * self.period / self.periods
        joints[:, 1:] = self.joints[:, 1:] @ symmetry.array().T
        itinerary = mirror_pairs(self.model, self.system.itinerary)
        system = build_system(self.model, itinerary, self.periods, self.system.half)
        return altered(self, system=system, joints=joints)

    @cached_property
    def symmetric(self) -> bool:
        """Whether the orbit is its own mirror image."""
        size = 1.0 + float(np.abs(self.joints).max())
        return self.mirror_distance < SYMMETRY_TOLERANCE * size

    @cached_property
    def mirror_distance(self) -> float:
        """Largest distance of a joint to its mirror image; infinite if the itineraries differ."""
        if self.system.half:
            return 0.0
        if half_of(self.model, self.system.itinerary, self.periods) is None:
            return float(np.inf)
        assert self.model.symmetry is not None
        n = len(self.joints) // 2
        image = self.joints[:n].copy()
        image[:, 0] += 0.5 * self.period
        image[:, 1:] = image[:, 1:] @ self.model.symmetry.array().T
        return float(np.abs(image - self.joints[n:]).max())

    # ------------------------------------------------------------------ what is watched

    @cached_property
    def _watched(self) -> tuple[FloatArray, NDArray[np.int64], bool]:
        from contfric.bvp.monitor import examine

        layout, count = self.system.layout, len(self.system.tests)
        watched = np.empty(count + len(layout.labels))
        labels, at = np.zeros(len(layout.labels), dtype=np.int64), (self.joints, self.vector)
        fine = examine(self.system.functions(), layout, *at, watched, labels, tally())
        return watched[:count], labels, bool(fine)

    @cached_property
    def turn_multipliers(self) -> ComplexArray:
        """Multipliers of one turn, largest first, shape (n,); (n - 1,) without the 1 of autonomous models."""
        from contfric.bvp.spectrum import stability

        mu = np.full(len(self.model.states), np.inf, dtype=np.complex128)
        if self.system.holds:  # the least disturbance ends a hold: it is no flow
            return mu[: self.model.directions]
        pencil = pencil_of_turn(self.system, self.joints, self.vector)
        stability(self.system.layout, pencil, mu, tally())
        return mu[: self.model.directions]

    @property
    def multipliers(self) -> ComplexArray:
        """Floquet multipliers of the whole orbit, as those of one turn."""
        mu = self.turn_multipliers
        return of_two_halves(mu) if self.system.half and not self.system.holds else mu

    @property
    def stable(self) -> bool:
        """Whether all multipliers lie inside the unit circle."""
        return bool(np.all(np.abs(self.turn_multipliers) < 1.0))

    @property
    def degenerate(self) -> bool:
        """Whether a multiplier is 1 to working precision: the orbit may belong to a continuum."""
        return bool(np.any(np.abs(self.multipliers - 1.0) < DEGENERATE))

    @property
    def margins(self) -> FloatArray:
        """Margins of the inequalities, in the order of ``system.tests``; positive if obeyed."""
        return self._watched[0]

    @property
    def labels(self) -> NDArray[np.int64]:
        """The transparent surfaces that the segments of one turn cross, as the engine codes them."""
        return self._watched[1]

    @property
    def admissible(self) -> bool:
        """Whether the orbit obeys every inequality inside every segment."""
        margins, _, fine = self._watched
        lasts = np.all(self.durations > -no_time(self.system, self.joints, margins))
        inside = np.all(margins > margin_slack(self.system, self.joints)) and lasts
        return bool(self.converged and fine and inside)

    def violations(self) -> list[str]:
        """Return what makes the orbit not admissible, one line each."""
        itinerary, margins = self.system.itinerary, self.margins
        slacks = margin_slack(self.system, self.joints)
        found = [
            f"segment {test.segment + 1} ({itinerary[test.segment][0]}): "
            f"{test.margin.value} margin at {test.surface} is {margin:.3g}"
            for test, margin, slack in zip(self.system.tests, margins, slacks, strict=True)
            if not margin > slack
        ]
        short = np.flatnonzero(self.durations <= -no_time(self.system, self.joints, margins))
        return found + [
            f"segment {k + 1} ({self.itinerary[k][0]}): it lasts {self.durations[k]:.3g}"
            for k in short
        ]

    # ------------------------------------------------------------------ what is seen

    @cached_property
    def signature(self) -> Signature:
        """The signature, with all of the model's domains, read off the solved segments."""
        return read_signature(self, self._watched[1])

    @property
    def name(self) -> str:
        """Name as in the reference: number of sticks, s or a, and segments if not 6."""
        return str(self.signature.name)

    @cached_property
    def stops(self) -> FloatArray:
        """Displacements at the stops and impacts in the order of the orbit, shape (stops,)."""
        return stops_of(self)

    @cached_property
    def _reach(self) -> tuple[float, float]:
        return reach_of(self)

    @property
    def x_max(self) -> float:
        """Largest displacement, x k / F_0."""
        return self._reach[1]

    @property
    def x_min(self) -> float:
        """Smallest displacement, x k / F_0."""
        return self._reach[0]

    @property
    def asymmetry(self) -> float:
        """``|max x + min x| / |max x - min x|`` (eq. (4) of the reference)."""
        return abs(self.x_max + self.x_min) / abs(self.x_max - self.x_min)

    def state(self, time: float) -> FloatArray:
        """Return the state at a time, shape (n,); any time, by periodicity."""
        start = float(self.cycle[0, 0])
        time = start + (time - start) % self.period
        i = int(np.searchsorted(self.cycle[:, 0], time, side="right")) - 1
        return state_within(self, i, time - float(self.cycle[i, 0]))

    def trajectory(self, points: int = 400) -> tuple[FloatArray, FloatArray, list[str]]:
        """Return times (k,), states (k, n) and domains (k) along one period, joints included."""
        return samples(self, self._watched[1], points)

    def to_dataframe(self, points: int = 400) -> pd.DataFrame:
        """Return one period as a table: t, the states, the domain (needs pandas)."""
        times, states, names = self.trajectory(points)
        columns = dict(zip(self.model.states, states.T, strict=True))
        return as_table({"t": times, **columns, "domain": names}, self.model.origins)

    def certify(self, *, time_limit: float | None = None) -> Certificate:
        """Prove that the orbit exists, is alone, admissible, stable or not (needs python-flint).

        After ``time_limit`` seconds (hundreds of segments take minutes) what is left is undecided. A
        ParameterError says where proofs are not offered, or that the limit is no number above 0.
        """
        need_flint()
        from contfric.certify.limit import latest
        from contfric.certify.orbit import certify_orbit

        return certify_orbit(self, until=latest(time_limit))

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the orbit in the phase plane, coloured by domain."""
        from contfric.plot.orbits.orbit import plot_orbit

        return plot_orbit(self, ax=ax)

    def animate(self, path: str | Path, frames: int = 120, rate: int = 30) -> Path:
        """Write one period in the phase plane as an animation (a gif), and return its path."""
        from contfric.plot.orbits.trajectory import animate_orbit

        return animate_orbit(self, path, frames, rate)

    def __repr__(self) -> str:
        from contfric.orbit.positions.kept import positions_of

        values = ", ".join(f"{k}={v:.6g}" for k, v in self.params.items())
        name = self.name if self.converged else "not solved"  # an iterate may have no signature
        # where else they may rest takes solves (resting)
        kept = "".join(f"; {p.said(self)}" for p in positions_of(self)) if self.converged else ""
        return f"<Orbit {name}: {values}; {self.status.name.lower()}{kept}>"
