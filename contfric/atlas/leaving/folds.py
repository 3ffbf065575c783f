"""Orbits that are born where a bridge folds: sequences of both arms of its passages.

If passages fold by themselves (:mod:`contfric.continuation.singular_points.arms`), every cyclic sequence of
their arms is a candidate, over as many periods as at a sliding event: one of the two holds of a symmetric
bridge may be the shorter one, and the other one the longer.
"""

from __future__ import annotations

from contfric.atlas.collect import Event
from contfric.atlas.exploration import Exploration
from contfric.atlas.leaving.trace_away import first_end, settings_for
from contfric.continuation.assembly import assemble
from contfric.continuation.half_branch import first_point
from contfric.continuation.points import Point
from contfric.continuation.singular_points.arms import Arms, arms_at
from contfric.continuation.singular_points.switching import NEARER, start_nearby
from contfric.continuation.trace import trace_side
from contfric.events.bifurcation import Decision, EndReason, Kind
from contfric.events.incident.sequences import MOST_SEQUENCES, count, lengths, necklaces
from contfric.orbit.canonical.repetition import shortest
from contfric.orbit.orbit import Orbit


def follow_arms(state: Exploration, event: Event) -> bool:
    """Try all sequences of arms at a fold at which passages turn by themselves; tell whether some do."""
    arms = arms_at(event.bifurcation.orbit)
    if arms is None:
        return False
    event.kinds.add(Kind.SN)  # for sequences of two units it is a doubling, too
    unit = arms.unit
    state.raise_copies(shortest(event.bifurcation.orbit).periods // unit.periods)
    most = min(state.max_periods, state.copies * unit.periods)
    longest = lengths(unit.periods, unit.half, most)
    if arms.letters == 2 and longest == [1]:
        return True  # the two arms of the branch itself
    near = [
        (d, found) for d in NEARER if (found := arms.solved_near(d, state.settings)) is not None
    ]
    for length in longest:
        many = count(arms.letters, length)
        if many > MOST_SEQUENCES or not near:
            why = f"{many} sequences: more than {MOST_SEQUENCES} are not tried"
            why = why if near else "the arms were not found next to the fold"
            state.judge(event, f"orbits of {length} units", Decision.REFUSED, why=why)
            continue
        for sequence in necklaces(arms.letters, length):
            _try_arms(state, event, near, sequence)
    return True


def _try_arms(
    state: Exploration, event: Event, near: list[tuple[float, Arms]], sequence: tuple[int, ...]
) -> None:
    """Try one sequence, as a branch that begins at the fold.

    Its curve goes on through the fold as the one with all arms exchanged. Whether a trace ends at the fold or
    passes it depends on whether its vertex is seen, and that next to it is rounding.
    """
    reason = _reason(near[0][1], sequence)
    for _, arms in near:
        there = shortest(arms.orbit(sequence))  # of equal units it is that of one
        if not (there.converged and there.admissible):
            continue
        if state.knows(event, reason, there):
            return
        point = first_point(there, settings_for(there, state.settings))
        if point is not None:
            _add_one_sided(state, event, arms.at_fold(len(sequence)), point, reason)
            return
    state.judge(event, reason, Decision.REFUSED, why="no admissible orbit next to the fold")


def _reason(arms: Arms, sequence: tuple[int, ...]) -> str:
    """Return what a sequence is, in words: each unit with its holds, longer or shorter."""
    bits = range(len(arms.turning))
    text = " ".join("".join("+-"[letter >> k & 1] for k in bits) for letter in sequence)
    return f"holds longer (+) or shorter (-) one after the other: {text}"


def _add_one_sided(
    state: Exploration, event: Event, orbit: Orbit, point: Point, reason: str
) -> None:
    """Trace a family away from its orbit at a fold, from a point next to it."""
    settings = settings_for(orbit, state.settings)
    point, origin = start_nearby(orbit, point, settings, point.joints - orbit.joints)
    side = trace_side(orbit, point, settings, progress=state.progress)
    first = first_end(EndReason.BP, event, side, settings)
    state.accept(event, reason, assemble(orbit, settings, side, first, origin))
