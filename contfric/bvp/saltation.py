"""Saltation matrices that are finite although the rate of the exit vanishes.

After a joint at which the field jumps, a disturbance is multiplied by the saltation matrix, with the rate
of the exit as divisor [1]_. Where a surface is only touched that rate is 0, and a segment after it has no
length. Two kinds of joints have a limit there, in which the rate does not stand:

* the field is continuous (a contact with a spring; a slider that comes to rest; a section): the identity;
* motion begins to slide on the surface h = 0, and the field changes along one direction e only (a slider
  that begins to slip; friction that begins to stick): the projection ``1 - e h_y / (h_y . e)``.

The rows of such an exit would divide zero by zero. They are replaced: the joint is passed when it was.
Without excitation the last joint fixes the phase, and what is passed is a plane normal to the field.

.. [1] R. I. Leine, H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, Springer
   (2004), chapter 7.
"""

from __future__ import annotations

from itertools import islice

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.assembly import following_modes
from contfric.bvp.passages import Passage, fields_between, passage_at
from contfric.bvp.system import System
from contfric.models.view import FlowView
from contfric.signature.holds import is_hold

#: States at which the direction is asked for where it is known to be one: it is taken where the change is
#: largest, and vanishes at all of these by no accident.
_FEW = 4
#: A rate at an exit below this share of an ordinary one counts as small: rows of the exit that divide by it
#: lose as many digits, twice: twelve are left.
_SMALL = 1e-2


def pass_when_due(system: System, vector: FloatArray, a: FloatArray, b: FloatArray) -> None:
    """Replace the rows of joints at which the rate of the exit does not matter, in the blocks of a turn.

    Parameters
    ----------
    a, b : blocks on z_i and z_{i+1}, shape (N, m, m); changed in place
    """
    model, itinerary = system.model, system.itinerary
    for i, (mode, exit_) in enumerate(itinerary):
        if is_hold(exit_) or is_hold(itinerary[(i + 1) % len(itinerary)][1]):
            continue  # what is held has equations of its own
        slope = b[i, -1].copy()  # the row says that the joint lies on the surface
        if not _is_small(slope, b[i, :-1, 0]):
            continue
        following = following_modes(model, itinerary, system.half)[i]
        passage = passage_at(model, mode, exit_, following)  # of few joints, as it takes a while
        if passage is Passage.JUMP:
            continue
        if passage is Passage.PROJECTED:
            project = _projection(FlowView(model, vector), slope[1:], (mode, exit_, following))
            a[i, :-1], b[i, :-1, 0] = project @ a[i, :-1], project @ b[i, :-1, 0]
        a[i, -1], b[i, -1] = 0.0, 0.0
        if not model.autonomous:
            b[i, -1, 0] = 1.0
        elif i + 1 == len(itinerary):  # the column of time at the end of a flow is the field there
            field = b[i, :-1, 0]
            b[i, -1, 1:] = field / (np.linalg.norm(field) or 1.0)
        else:
            a[i, -1, 0], b[i, -1, 0] = -1.0, 1.0


def _is_small(slope: FloatArray, field: FloatArray) -> bool:
    rate = slope[0] + slope[1:] @ field
    return bool(rate * rate < _SMALL**2 * (slope @ slope) * (1.0 + field @ field))


def _projection(view: FlowView, slope: FloatArray, joint: tuple[str, str, str]) -> FloatArray:
    """Return the map of disturbances where sliding begins; e is that of the state at which it is largest."""
    found = islice(fields_between(view, *joint), _FEW)
    changes = [there - here for here, there, _ in found]
    along = max(changes, key=lambda change: float(np.linalg.norm(change)))
    return np.eye(len(slope)) - np.outer(along, slope) / (slope @ along)
