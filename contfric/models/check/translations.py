"""Positions on which nothing depends: a robot on a plane, a rotor and its load that turn together.

Fields, surfaces and resets are the same where some states are moved by constants, each by its share. A
solution that moves on so repeats itself, and yet is not periodic; others have a second multiplier 1.
"""

from __future__ import annotations

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.models.check.period import same
from contfric.models.check.probe import Probe
from contfric.models.check.report import ModelReport, Topic

#: States that are drawn for each mode, and at most asked: what is so at four random ones is so everywhere.
_DRAWN = (40, 4)
#: Rounding of gradients relative to their size, and of entries of a direction.
_NULL, _SMALL = 1e-9, 1e-8
#: By how much states are moved, to see that nothing changes.
_FAR = 1.7


def check_translations(report: ModelReport, probe: Probe) -> None:
    """Warn of states that nothing depends on but by their differences."""
    if not probe.model.definition:
        return
    report.count(Topic.UNDECLARED)
    for shares in translations(probe):
        if np.count_nonzero(shares) > 1:  # of a single state another check tells
            report.warn(Topic.UNDECLARED, of_translation(probe, shares))


def of_translation(probe: Probe, shares: FloatArray) -> str:
    """Return what to say of states that may be moved together."""
    moved = {s: c for s, c in zip(probe.model.states, shares.tolist(), strict=True) if c}
    place = ", ".join(f"{s} {'-' if c < 0 else '+'} {_factor(c)}c" for s, c in moved.items())
    if len(moved) == 1:
        return f"nothing depends on state '{next(iter(moved))}': leave it out"
    return (
        f"fields, surfaces and resets are the same at {place}, whatever c is: solutions that move on so are "
        "not periodic, and others have a multiplier 1 more. Write the difference of positions as a state, "
        "and leave out these"
    )


def _factor(share: float) -> str:
    return "" if abs(share) == 1.0 else f"{abs(share):.6g}*"


def translations(probe: Probe) -> list[FloatArray]:
    """Return independent directions in which states may be moved, the largest entry of each 1."""
    model = probe.model
    places = [
        (mode.name, *place) for mode in model.modes for place in probe.places(mode.name, *_DRAWN)
    ]
    if not places:
        return []
    rows = [probe.slopes(mode, t, y)[:, 1:] for mode, t, y in places]
    rows += [probe.slope(s.name, t, y)[None, 1:] for _, t, y in places for s in model.surfaces]
    gradients = np.concatenate(rows)
    sizes = np.linalg.norm(gradients, axis=1)
    if not np.all(np.isfinite(sizes)):
        return []
    gradients = gradients[sizes > 0.0] / sizes[sizes > 0.0, None]
    _, values, basis = np.linalg.svd(gradients)
    free = basis[np.count_nonzero(values > _NULL * len(gradients)) :]
    return [shares for shares in _few_entries(free) if _changes_nothing(probe, places, shares)]


def _few_entries(basis: FloatArray) -> list[FloatArray]:
    """Return the basis of the same space in which each vector alone has one of the entries."""
    from scipy.linalg import qr

    if not len(basis):
        return []
    order = qr(basis, pivoting=True, mode="r")[1][: len(basis)]
    found = np.linalg.solve(basis[:, order], basis)
    found[np.abs(found) < _SMALL] = 0.0
    return [np.round(row / row[np.argmax(np.abs(row))], 9) for row in found]


def _changes_nothing(
    probe: Probe, places: list[tuple[str, float, FloatArray]], shares: FloatArray
) -> bool:
    """Tell whether states that are moved far have the same rates, observables and resets, moved as far."""
    model, step = probe.model, _FAR * shares
    return (
        all(same(probe.field(m, t, y), probe.field(m, t, y + step)) for m, t, y in places)
        and all(
            same(probe.height(s.name, t, y), probe.height(s.name, t, y + step))
            for s in model.surfaces
            for _, t, y in places
        )
        and all(
            same(probe.reset(r.surface, t, y) + step, probe.reset(r.surface, t, y + step))
            for r in model.resets
            for _, t, y in places
        )
    )
