"""The closure of a turn: how rows at its end read at its start, and whether the symmetry of a half is one.

Over whole periods the extended state ``(y, 1, cos w_k t, sin w_k t)`` is the same. Over half a period,
with ``w_k T = 2 pi n_k``, it is ``D (y, 1, ...)``, D = diag(K, 1, (-1)^n_k). The second half of a
symmetric orbit is the image of the first one if the images of fields, surfaces and resets are those of the
image mode and of the image surface:

    M_m' D = D M_m,        g_F' D = -g_F,        R_F' D = D R_F .

Which modes a reset acts in, and which one it leads into, is no matter of formulas: the problem of the whole
orbit, read from the model, must have on its second half what the symmetry makes of the first one.
"""

from __future__ import annotations

from flint import arb, arb_mat

from contfric.bvp.system import Layout, System, build_system
from contfric.certify.equations.chain import Segments
from contfric.certify.equations.zeros import Closing
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import numbers, zeros
from contfric.models.mode_domains import mirror_mode
from contfric.orbit.itinerary.itineraries import whole_of
from contfric.orbit.orbit import Orbit


def closure_of_states(segments: Segments) -> arb_mat:
    """Return the matrix K of the closure on the states."""
    return arb_mat([[arb(c) for c in row] for row in segments.closure])


def closure_matrix(segments: Segments, model: BallModel, half: bool) -> arb_mat:
    """Return the matrix D of the closure on the extended state."""
    size, n = model.size, model.states
    rows, closing = zeros(size, size), closure_of_states(segments)
    for a in range(n):
        for b in range(n):
            rows[a][b] = closing[a, b]
    rows[n][n] = arb(1)
    for k, turns in enumerate(model.turns):
        sign = -1 if half and turns % 2 else 1
        for at in (n + 1 + 2 * k, n + 2 + 2 * k):
            rows[at][at] = arb(sign)
    return arb_mat(rows)


def closing_of(segments: Segments, model: BallModel, half: bool) -> Closing:
    """Return how a row on the extended state at the last joint reads at the first one."""
    if not half:
        return lambda row: row
    matrix = closure_matrix(segments, model, half)
    return lambda row: numbers(arb_mat([row]) * matrix)


def is_symmetry(orbit: Orbit, segments: Segments, model: BallModel) -> bool:
    """Tell whether the declared symmetry of a half problem is one, exactly.

    It is shown by the formulas of the model, for all parameters; or by its matrices where they are exact:
    with slopes that are exact too, over the ball of the parameter, for all its values.
    """
    symmetry = orbit.model.symmetry
    if symmetry is None or symmetry.fraction != 0.5 or orbit.periods % 2 == 0:
        return False
    if model.resets and not _acts_alike(orbit.system):
        return False
    if model.mirrored is not None:
        image = mirror_mode(orbit.model)
        modes = tuple((mode, image[mode]) for mode in dict.fromkeys(segments.modes))
        surfaces = tuple((a, b, int(symmetry.sense(a))) for a, b in symmetry.surfaces.items())
        if model.mirrored(segments.closure, modes, surfaces):
            return True
    if model.slopes is not None and not keeps(orbit.system, segments, model, model.slopes):
        return False
    return keeps(orbit.system, segments, model, model)


def keeps(system: System, segments: Segments, model: BallModel, matrices: BallModel) -> bool:
    """Tell whether the images of fields, surfaces and resets (or of their slopes) are those of the model."""
    symmetry, resets = system.model.symmetry, matrices.resets
    assert symmetry is not None
    if any((name in resets) != (to in resets) for name, to in symmetry.surfaces.items()):
        return False
    matrix, image = closure_matrix(segments, model, True), mirror_mode(system.model)
    gaps = [
        matrices.fields[image[mode]] * matrix - matrix * matrices.fields[mode]
        for mode in {mode for mode, _ in system.itinerary}
    ]
    gaps += [
        matrices.surfaces[to] * matrix - matrices.surfaces[name] * symmetry.sense(name)
        for name, to in symmetry.surfaces.items()
    ]
    gaps += [
        resets[to] * matrix - matrix * resets[name]
        for name, to in symmetry.surfaces.items()
        if name in resets
    ]
    return all(x.is_zero() for gap in gaps for x in gap.entries())


def _acts_alike(system: System) -> bool:
    """Tell whether the problem of the whole orbit asks what its half does, and the image of that."""
    model, count = system.model, system.segments
    try:
        whole = build_system(model, whole_of(model, system.itinerary, True), system.periods)
    except ValueError:  # the image of a reset leads nowhere
        return False
    symmetry, names = model.symmetry, [s.name for s in model.surfaces]
    assert symmetry is not None

    def image(i: int, surface: int, sign: int, *where: int) -> tuple[int, ...]:
        name = names[surface]
        to = names.index(symmetry.surfaces[name])
        return i + count, to, symmetry.sense(name) * sign, *where

    rows = _rows(system.layout)
    return _rows(whole.layout) == rows | {(what, image(*row)) for what, row in rows}


def _rows(layout: Layout) -> set[tuple[str, tuple[int, ...]]]:
    """Return what a problem asks of each segment: sides of surfaces, its exit, the reset before it."""
    interior, joint = layout.interior.tolist(), layout.joint.tolist()
    signs = layout.exit_signs.astype(int).tolist()
    exits = zip(range(len(signs)), layout.exits.tolist(), signs, strict=True)
    resets = ((i, surface, 0) for i, surface in enumerate(layout.resets.tolist()) if surface >= 0)
    asked = {"interior": interior, "joint": joint, "exit": exits, "reset": resets}
    return {(what, tuple(row)) for what, rows in asked.items() for row in rows}
