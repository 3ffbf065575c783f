"""The tasks of a study: each is a module with its schema, checks, computation, tables and record.

A new task is a module with a subclass of :class:`~contfric.study.tasks.task.Task`, and a line here.
"""

from __future__ import annotations

from contfric.study.tasks.basins import BasinsTask
from contfric.study.tasks.branch import ContinueTask
from contfric.study.tasks.diagram import ExploreTask
from contfric.study.tasks.ensemble import EnsembleTask
from contfric.study.tasks.equilibria import EquilibriaTask
from contfric.study.tasks.fit import FitTask
from contfric.study.tasks.lyapunov import LyapunovTask
from contfric.study.tasks.orbit import Start
from contfric.study.tasks.plane import PlaneTask
from contfric.study.tasks.poincare import PoincareTask
from contfric.study.tasks.quantity_curves import ExtremumTask, HoldTask
from contfric.study.tasks.release_map import ReleaseMapTask
from contfric.study.tasks.stable_set import StableSetTask
from contfric.study.tasks.sweep import SweepTask
from contfric.study.tasks.task import Task

#: The tasks, in the order of the steps of a run.
TASKS: tuple[type[Task], ...] = (
    ExploreTask,
    ContinueTask,
    PlaneTask,
    LyapunovTask,
    SweepTask,
    PoincareTask,
    ReleaseMapTask,
    BasinsTask,
    StableSetTask,
    HoldTask,
    ExtremumTask,
    EquilibriaTask,
    EnsembleTask,
    FitTask,
)
#: The same after the orbit of the start, which any of them may need.
STEPS: tuple[type[Task], ...] = (Start, *TASKS)
