"""The unit of a motion: its shortest period (half of it if it is its own symmetry image); its itineraries.

A motion at an event solves the equations of several itineraries (:mod:`contfric.events.incident.incident`).
It is cut at the start of a slide of some length, which every itinerary has, and in which no contact rests if
there is one; each itinerary of a unit is a **form**.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.attributes import cached_property
from contfric.bvp.system import Itinerary, build_system
from contfric.errors import NotationError
from contfric.models.definition import Model
from contfric.models.mode_domains import mirror_mode
from contfric.orbit.canonical.slides import (
    SAME_SOLUTION,
    repeats,
    repetitions,
    slides_of,
    time_unit,
)
from contfric.orbit.clock import clocked
from contfric.orbit.itinerary.itineraries import mirror_pairs
from contfric.orbit.orbit import Orbit, Status
from contfric.signature.holds import is_hold
from contfric.signature.walks import is_closed_walk, show


@dataclass(frozen=True, eq=False)
class Form:
    """One itinerary of the unit of a motion.

    Attributes
    ----------
    itinerary : mode and exit of each segment
    joints : start joints (t, y) of the segments, shape (k, 1 + n)
    away : how fast the start joints move in time where the new orbit is singular at the event, shape (k,)
    reason : what happens at its places, in words
    unit : of the solution
    """

    itinerary: Itinerary
    joints: FloatArray
    away: FloatArray
    reason: str
    unit: Unit

    @cached_property
    def orbit(self) -> Orbit:
        """The solution as an orbit of this form alone; on its half where the unit is half of it.

        Raises
        ------
        NotationError
            If there is no such itinerary.
        """
        return self.unit.orbit((self,))[0]

    @property
    def has_hold(self) -> bool:
        """Whether something is held."""
        return any(is_hold(exit_) for _, exit_ in self.itinerary)


@dataclass(frozen=True, eq=False)
class Unit:
    """The shortest part of a solution that it consists of.

    Attributes
    ----------
    model : the model that moves
    vector : parameters
    periods : shortest period of the solution, in periods of the excitation
    half : whether the unit is half of it, the other half being its symmetry image
    duration : of the unit
    mode : mode of the slide that it begins with
    cut : time and state at which it begins (after an impact), shape (1 + n,)
    """

    model: Model
    vector: FloatArray
    periods: int
    half: bool
    duration: float
    mode: str
    cut: FloatArray

    def image(self, joints: FloatArray, times: int) -> FloatArray:
        """Return joints of the unit as those of the unit that is some number of times later."""
        moved = joints.copy()
        moved[:, 0] += times * self.duration
        if self.half and times % 2:
            assert self.model.symmetry is not None
            moved[:, 1:] = moved[:, 1:] @ self.model.symmetry.array().T
        return moved

    def starts(self, count: int) -> FloatArray:
        """Return the joints at which that many units begin, one after the other, shape (count, 1 + n)."""
        starts = np.repeat(self.cut[None], count, axis=0)
        starts[:, 0] += np.arange(count) * self.duration
        if self.half:
            assert self.model.symmetry is not None
            starts[1::2, 1:] = starts[1::2, 1:] @ self.model.symmetry.array().T
        return starts

    def image_itinerary(self, itinerary: Itinerary, times: int) -> Itinerary:
        """Return an itinerary of the unit as one of the unit that is some number of times later."""
        return mirror_pairs(self.model, itinerary) if self.half and times % 2 else itinerary

    def orbit(self, forms: tuple[Form, ...]) -> tuple[Orbit, FloatArray]:
        """Return the solution as an orbit of forms one after the other, and how its joints move away.

        An odd number of half units is the half of a symmetric orbit.

        Raises
        ------
        NotationError
            If there is no such itinerary.
        """
        count = len(forms)
        itinerary = tuple(
            pair for j, f in enumerate(forms) for pair in self.image_itinerary(f.itinerary, j)
        )
        joints = np.concatenate([self.image(f.joints, j) for j, f in enumerate(forms)])
        away = np.concatenate([f.away for f in forms])
        half = self.half and count % 2 == 1
        periods = self.periods * count // (2 if self.half and not half else 1)
        whole = itinerary if not half else (*itinerary, *mirror_pairs(self.model, itinerary))
        if any(is_hold(exit_) for _, exit_ in whole) and not is_closed_walk(whole, self.model):
            raise NotationError(f"'{show(whole)}' is no closed walk: a hold would be cut in two")
        joints = clocked(self.model, joints, float(joints[0, 0]) + count * self.duration)
        try:
            system = build_system(self.model, itinerary, periods, half)
        except ValueError as error:
            raise NotationError(str(error)) from None
        return Orbit(system, joints, self.vector.copy(), 0.0, Status.CONVERGED), away


def unit_of(orbit: Orbit, rests: Collection[str] = ()) -> Unit:
    """Return the unit of the solution of a whole orbit.

    Parameters
    ----------
    rests : surfaces of contacts that may be held; it is cut where they do not rest, if there is such a slide
    """
    slides = slides_of(orbit)
    turns = repetitions(orbit, slides)
    periods = max(1, orbit.periods // turns)
    half = periods % 2 == 1 and repeats(orbit, slides, 2 * turns, mirrored=True)
    model, lasts = orbit.model, orbit.durations
    resting = [model.mode_by_name[mode].sliding for mode, _ in orbit.itinerary]
    held = [any(model.lies_on(mode, s) for s in rests) for mode, _ in orbit.itinerary]
    longest = max(slides, key=lambda i: (not held[i], not resting[i], lasts[i]))
    duration = orbit.period / (turns * (2 if half else 1))
    mode = orbit.itinerary[longest][0]
    cut = np.array(orbit.begins[longest])
    return Unit(orbit.model, orbit.vector, periods, half, duration, mode, cut)


@dataclass(frozen=True, eq=False)
class UnitPiece:
    """One unit of a whole orbit.

    Attributes
    ----------
    number : units of the orbit before it
    segments : of the orbit; those past its end are of its next period
    itinerary : of the piece, as that of the first unit of the solution
    """

    number: int
    segments: range
    itinerary: Itinerary


def pieces(orbit: Orbit, unit: Unit) -> list[UnitPiece]:
    """Return the units of a whole orbit.

    Raises
    ------
    NotationError
        If the orbit does not begin with a slide where a unit does.
    """
    cuts = _cuts(orbit, unit)
    if cuts is None:
        raise NotationError(
            "the edited itinerary does not begin with a slide where the solution does"
        )
    count, found = len(orbit.itinerary), []
    for j, (start, stop) in enumerate(zip(cuts, [*cuts[1:], cuts[0]], strict=True)):
        segments = range(start, stop if stop > start else stop + count)
        itinerary = tuple(orbit.itinerary[i % count] for i in segments)
        found.append(UnitPiece(j, segments, unit.image_itinerary(itinerary, j)))
    return found


def form_of(orbit: Orbit, away: FloatArray, unit: Unit, piece: UnitPiece, reason: str) -> Form:
    """Return one unit of a whole orbit as a form, as the first unit of the motion."""
    count = len(orbit.itinerary)
    locations = [i % count for i in piece.segments]
    joints = orbit.cycle[locations]
    joints[:, 0] += np.array([orbit.period * (i // count) for i in piece.segments])
    joints[:, 0] += unit.cut[0] + piece.number * unit.duration - joints[0, 0]
    return Form(piece.itinerary, unit.image(joints, -piece.number), away[locations], reason, unit)


def _cuts(orbit: Orbit, unit: Unit) -> list[int] | None:
    """Return the segments with which the units of a whole orbit begin; None if one is not there."""
    period, whole = orbit.period, unit.model.whole_mode
    gaps = orbit.begins - unit.starts(round(period / unit.duration))[:, None]
    near = np.abs(gaps[:, :, 1:]).max(axis=2) < SAME_SOLUTION
    near &= orbit.durations > SAME_SOLUTION * time_unit(orbit)
    modes = [whole(mode) for mode, _ in orbit.itinerary]
    wanted = [whole(unit.mode)]
    if unit.half:
        wanted.append(whole(mirror_mode(unit.model)[unit.mode]))
    later, cuts = gaps[:, :, 0], list[int]()
    # without excitation time tells one turn from another, and nothing else
    known = 0.25 * unit.duration if orbit.model.autonomous else SAME_SOLUTION
    for j, at in enumerate(near):
        fits, mode = at, wanted[j % len(wanted)]
        if j or not orbit.model.autonomous:
            fits = at & (np.abs(later[j] - period * np.rint(later[j] / period)) < known)
        found = next((i for i in np.flatnonzero(fits).tolist() if modes[i] == mode), None)
        if found is None:
            return None
        if not j and orbit.model.autonomous:  # any of its turns may come first
            later = later - later[0, found]
        cuts.append(found)
    return cuts
