"""The closure of a turn: how rows at its end read at its start, and whether the symmetry of a half is one.

Over whole periods the extended state ``(y, 1, cos w_k t, sin w_k t)`` is the same. Over half a period,
with ``w_k T = 2 pi n_k``, it is ``D (y, 1, ...)``, D = diag(K, 1, (-1)^n_k). The second half of a
symmetric orbit is the image of the first one if the images of fields and surfaces are those of the image
mode:

    M_m' D = D M_m,        g_F' D = -g_F .
"""

from __future__ import annotations

from flint import arb, arb_mat

from contfric.certify.chain import Segments
from contfric.certify.zeros import Closing
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import numbers, zeros
from contfric.orbit.orbit import Orbit
from contfric.orbit.structure import mirror_mode
from contfric.orbit.system import System


def closure_matrix(segments: Segments, model: BallModel, half: bool) -> arb_mat:
    """Return the matrix D of the closure on the extended state."""
    size, n = model.size, model.states
    rows = zeros(size, size)
    for a in range(n):
        for b in range(n):
            rows[a][b] = arb(segments.closure[a][b])
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
    if symmetry is None or symmetry.fraction != 0.5 or orbit.periods % 2 == 0 or model.resets:
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
    """Tell whether the images of fields and surfaces (or of their slopes) are those of the image mode."""
    symmetry = system.model.symmetry
    assert symmetry is not None
    matrix, image = closure_matrix(segments, model, True), mirror_mode(system.model)
    gaps = [
        matrices.fields[image[mode]] * matrix - matrix * matrices.fields[mode]
        for mode in {mode for mode, _ in system.itinerary}
    ]
    gaps += [
        matrices.surfaces[to] * matrix - matrices.surfaces[name] * symmetry.sense(name)
        for name, to in symmetry.surfaces.items()
    ]
    return all(x.is_zero() for gap in gaps for x in gap.entries())
