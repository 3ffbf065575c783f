"""A half-branch while it is traced: rows that the compiled march fills, and what is kept of them.

The march needs tangents and tests of the last points only. What a branch keeps of a point (joints,
parameter, arclength, labels, multipliers) is copied out of the rows when they are full.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray, IntArray
from contfric.base.attributes import altered
from contfric.base.pace import Pace
from contfric.base.tally import tally
from contfric.bvp.system import System
from contfric.continuation.points import SMALLEST_STEP, Point, PointRows, Settings
from contfric.events.bifurcation import Bifurcation, End
from contfric.orbit.orbit import Orbit
from contfric.remember.advance import heed

if TYPE_CHECKING:
    from contfric.continuation.core.steps import BranchProblem

#: Points that the rows hold at a time: enough to cost nothing.
CHUNK = 512
#: Most points that are solved for along one side, for each that it may have: one in two is refused at worst,
#: a few tens where a side comes to an end. Beyond that it gets nowhere.
_MOST_SOLVES = 50

#: Step below which none is refused for its angle: where a branch has a sharp bend it goes on in the shortest.
_GIVES_WAY = 4.0 * SMALLEST_STEP
#: A column that is full grows by one part in this many; the last rest is given back.
_GROWTH = 8
#: Rows that are moved at once: few enough to need no memory to speak of.
_BLOCK = 1 << 14
#: Points this near to a vertex (arclength) are left out: the system is singular there, and they are good
#: to about 1e-4 only. The branch that leaves starts at twice the distance.
_CROWD = 5e-4

#: What a branch keeps of its points, and with multipliers.
_KEPT = ("joints", "values", "arc", "labels")


def kept(stability: bool) -> tuple[str, ...]:
    """Return the columns that a branch keeps of its points."""
    return (*_KEPT, "mu") if stability else _KEPT


@dataclass(eq=False)
class GrowingColumns:
    """What is kept of many points: one array a column, which grows in place.

    (Pieces that are joined at the end would take the memory twice.)
    """

    arrays: dict[str, NDArray[Any]]
    count: int = 0

    def append(self, rows: dict[str, NDArray[Any]]) -> None:
        """Copy rows behind those that are there."""
        stop = self.count + len(rows["values"])
        if not self.count:
            self.arrays, self.count = {name: new.copy() for name, new in rows.items()}, stop
            return
        for name, new in rows.items():
            array = self.arrays[name]
            if stop > len(array):
                capacity = max(stop, self.count + self.count // _GROWTH)
                array.resize((capacity, *new.shape[1:]), refcheck=False)
            array[self.count : stop] = new
        self.count = stop

    def take(self, name: str) -> NDArray[Any]:
        """Return one column, and let it go."""
        array = self.arrays.pop(name)
        array.resize((self.count, *array.shape[1:]), refcheck=False)
        return array

    def take_behind(self, name: str, back: GrowingColumns) -> NDArray[Any]:
        """Return one column after the reversed one of another side, without their common first row."""
        before = back.take(name)[:0:-1]
        array, shift = self.take(name), len(before)
        array.resize((self.count + shift, *array.shape[1:]), refcheck=False)
        for stop in range(self.count, 0, -_BLOCK):  # from the end, for the two locations overlap
            start = max(0, stop - _BLOCK)
            array[start + shift : stop + shift] = array[start:stop]
        array[:shift] = before
        return array


@dataclass(eq=False)
class Side:
    """One side of a branch, from its first point outward.

    Attributes
    ----------
    first : the point it starts from
    end : why it ended
    bifurcations : what it has met
    names : the columns that are kept of its points
    rows, last : the points at work, and the row of the last one
    count : points so far
    at_event : whether the first point is at a sliding event
    autonomous : whether the duration of a turn is one of the unknowns
    largest : longest step, where the settings' would overshoot what is near
    solves : points solved for by the march, those among them that it refused
    notes : what changed on it and is no event
    """

    first: Point
    end: End
    names: tuple[str, ...]
    rows: PointRows
    last: int = 0
    count: int = 1
    at_event: bool = False
    largest: float = np.inf
    bifurcations: list[Bifurcation] = field(default_factory=list)
    _kept: GrowingColumns = field(default_factory=lambda: GrowingColumns({}))
    _fresh: int = 0
    autonomous: bool = False
    solves: int = 0
    notes: list[str] = field(default_factory=list)

    @classmethod
    def starting(cls, point: Point, system: System, end: End, stability: bool) -> Side:
        """Return a side that consists of its first point."""
        side = cls(point, end, kept(stability), PointRows.empty(system, CHUNK))
        side.autonomous = system.model.autonomous
        side.rows.put(0, point)
        return side

    @property
    def tip(self) -> Point:
        """The last point."""
        return self.rows.point(self.last)

    @property
    def before_tip(self) -> Point:
        """The last point but one."""
        return self.rows.point(self.last - 1)

    @property
    def position(self) -> float:
        """Arclength of the last point."""
        return float(self.rows.arc[self.last])

    @property
    def length(self) -> float:
        """Arclength from the first point to the last."""
        return self.position - self.first.arc

    @property
    def second_multipliers(self) -> NDArray[np.complex128]:
        """Multipliers of one turn at the second point (at the first, if it is the only one)."""
        count = self._kept.count
        kept = [*self._kept.arrays["mu"][: min(2, count)]] if count else []
        here = self.rows.mu[self._fresh : self.last + 1]
        return np.array([*kept, *here[:2]][min(1, self.count - 1)])

    def put_tip(self, point: Point) -> None:
        """Replace the last point."""
        self.rows.put(self.last, point)

    def drop_tip(self) -> None:
        """Take the last point away."""
        self.last -= 1
        self.count -= 1

    def restart(self, point: Point) -> None:
        """Go on from a point that is the last one with other joints: nothing is predicted across."""
        self._keep(self.last + 1)
        self.rows.put(0, point)
        self.last, self._fresh = 0, 0
        self.count += 1

    def rewind(self, row: int) -> None:
        """Take away the points after a row."""
        self.count -= self.last - row
        self.last = row

    def end_at(self, row: int, point: Point, end: End) -> None:
        """End with a point after a row."""
        self.rewind(row)
        self.last += 1
        self.count += 1
        self.rows.put(self.last, point)
        self.end = end

    def drop_crowd(self, arc: float) -> None:
        """Take away the points just before a vertex, but for the last one."""
        while self.last > 1 and self.rows.arc[self.last - 1] > arc - _CROWD:
            self.drop_tip()

    def relabel_first(self, labels: IntArray) -> None:
        """Give the first of two points the labels of the second."""
        self.rows.labels[self.last - 1] = labels

    def march(self, orbit: Orbit, settings: Settings, step: float) -> tuple[int, float]:
        """March on; return (why it stopped, next step)."""
        from contfric.bvp.convergence import ALONG, INTEGRATED
        from contfric.bvp.newton import ON_THE_WAY
        from contfric.continuation.core.geometry import Course
        from contfric.continuation.core.march import BUDGET, MORE, march

        if self.last + 1 >= CHUNK:
            self._keep_full_rows()
        stop = min(CHUNK, self.last + 1 + settings.most_points - self.count)
        largest = min(self.largest, settings.largest_of(orbit.system))
        integrated = orbit.system.layout.rounding > INTEGRATED
        options = march_options(step, largest, ON_THE_WAY if integrated else ALONG)
        why, most = MORE, _MOST_SOLVES * settings.most_points
        problem, start, counts = branch_problem(orbit, settings), self.first.as_start(), tally()
        box, arrays, pace = settings.box, self.rows.arrays(stop), _LAST.pace
        while why == MORE and self.solves < most:  # between the calls Ctrl-C is heard
            heed()
            options[BUDGET], before, began = pace.budget, int(counts[0]), perf_counter()
            course = Course(options, box, self.last, *start, self.count - 1, arrays, counts)
            why, last, options[0] = march(problem, course)
            self.count += last - self.last
            self.last = last
            done = int(counts[0]) - before
            self.solves += done
            pace.took(done, perf_counter() - began)
        return why, float(options[0])

    def _keep_full_rows(self) -> None:
        """Keep all rows but the last, and go on with the last two as the first."""
        self._keep(self.last)
        for array in vars(self.rows).values():
            array[:2] = array[self.last - 1 : self.last + 1]
        self.last, self._fresh = 1, 1

    def _keep(self, stop: int) -> None:
        rows = slice(self._fresh, stop)
        self._kept.append({name: getattr(self.rows, name)[rows] for name in self.names})
        self._fresh = stop

    def column(self, name: str) -> FloatArray:
        """Return one column of all points so far, of those that are kept."""
        before = self._kept.arrays[name][: self._kept.count] if self._kept.count else None
        here: FloatArray = getattr(self.rows, name)[self._fresh : self.last + 1]
        return here if before is None else np.concatenate([before, here])

    def columns(self) -> GrowingColumns:
        """Return everything that is kept of the points; the side is finished."""
        self._keep(self.last + 1)
        return self._kept


def march_options(step: float, largest: float, accuracy: float) -> FloatArray:
    """Return the numbers that steer the march, with a single point in its budget."""
    return np.array([min(step, largest), largest, SMALLEST_STEP, _GIVES_WAY, 1.0, 0.0, accuracy])


class _LastProblem(threading.local):
    """The branch last at work in this thread: its pieces and its events ask for it again and again."""

    orbit: Orbit | None = None
    system: System | None = None
    settings: Settings | None = None
    problem: BranchProblem
    pace: Pace


_LAST = _LastProblem()


def branch_problem(orbit: Orbit, settings: Settings) -> BranchProblem:
    """Return the branch of an orbit as the compiled engine takes it."""
    from contfric.continuation.core.steps import BranchProblem

    if _LAST.orbit is orbit and _LAST.settings is settings:
        return _LAST.problem
    system = orbit.system
    if _LAST.system is not system:
        _LAST.pace = Pace()
    if _LAST.system is system and _LAST.settings is settings:  # an orbit next to the last one
        which, scale = _LAST.problem.which, _LAST.problem.scale
    else:
        which = np.array([orbit.model.index_of(settings.parameter)])
        scale = np.array([settings.scale])
    _LAST.problem = BranchProblem(
        system.functions(), system.layout, orbit.vector, which, scale, settings.stability
    )
    _LAST.orbit, _LAST.system, _LAST.settings = orbit, system, settings
    return _LAST.problem


#: Where a march began, for one that is a single point: it returns nowhere.
_NO_START = np.empty((0, 0, 0)), np.empty((0, 0))


def first_point(
    orbit: Orbit, settings: Settings, tangent: FloatArray | None = None, slope: float = 1.0
) -> Point | None:
    """Solve for the first point of a branch; None if it has no unique tangent there.

    Parameters
    ----------
    tangent, slope : direction to solve normal to; by default along the parameter
    """
    from contfric.bvp.convergence import ALONG
    from contfric.continuation.core.geometry import Course
    from contfric.continuation.core.march import BROKEN, march

    direction = np.zeros_like(orbit.joints) if tangent is None else tangent
    rows = PointRows.empty(orbit.system, 1)
    rows.joints[0], rows.w[0] = orbit.joints, orbit.vector[orbit.model.index_of(settings.parameter)]
    rows.tangents[0], rows.directions[0] = direction, slope
    options = march_options(0.0, settings.largest, ALONG)
    course = Course(options, settings.box, -1, *_NO_START, 0, rows.arrays(), tally())
    why, _, _ = march(branch_problem(orbit, settings), course)
    return None if why == BROKEN else rows.only()


def point_before(orbit: Orbit, point: Point, back: float, settings: Settings) -> Point | None:
    """Solve for the point of a branch this far (in arclength) before one."""
    moved = point.along(orbit, orbit.model.index_of(settings.parameter), -back)
    found = first_point(moved, settings, point.tangent, point.slope)
    return None if found is None else altered(found, arc=point.arc - back)
