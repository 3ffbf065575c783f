"""The tables of a plane and of a map: curves, points of codimension two, regions, motions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from contfric.atlas.plane import Plane
from contfric.chaos.status import Motion
from contfric.study.tables import write_table

if TYPE_CHECKING:
    from contfric.chaos.map import LyapunovMap


def write_curves(path: Path, plane: Plane) -> None:
    """Write one row for each point of each curve."""
    names = plane.model.parameter_names
    rows = (
        (number, curve.label, kind.value, *values, bool(stable))
        for number, curve in enumerate(plane.curves, start=1)
        for kind, stable, *values in zip(
            curve.kinds, curve.stable, *(curve.params[n].tolist() for n in names), strict=True
        )
    )
    write_table(path, ["curve", "label", "kind", *names, "stable"], rows)


def write_special(path: Path, plane: Plane) -> None:
    """Write one row for each point of codimension two."""
    names = plane.model.parameter_names
    rows = (
        (s.name, s.kind.name, s.orbit.name, *(s.params[n] for n in names), s.located)
        for s in plane.special
    )
    write_table(path, ["name", "kind", "signature", *names, "located"], rows)


def write_regions(path: Path, plane: Plane) -> None:
    """Write one row for each region: a point inside, what bounds it, what lives there."""
    rows = (
        (
            number,
            *region.point.values(),
            region.share,
            " ".join(sorted({plane.curves[k].label for k in region.bounds})),
            "; ".join(map(str, region.families)),
            region.sampled,
            "; ".join(map(str, region.disputed)),
        )
        for number, region in enumerate(plane.regions, start=1)
    )
    header = ["region", *plane.parameters, "share", "bounds", "families", "sampled", "disputed"]
    write_table(path, header, rows)


def write_motions(path: Path, lmap: LyapunovMap) -> None:
    """Write one row for each motion of a map of Lyapunov exponents."""
    (first, across), (second, up) = lmap.axes.items()
    count = lmap.exponents.shape[-1]
    names = [motion.name.lower() for motion in Motion]
    rows = (
        (
            across[i].item(),
            up[j].item(),
            k + 1,
            *lmap.exponents[i, j, k].tolist(),
            lmap.errors[i, j, k].item(),
            names[lmap.motions[i, j, k]],
            lmap.periods[i, j, k].item(),
            lmap.followed[i, j, k].item(),
        )
        for i, j, k in np.ndindex(*lmap.motions.shape)
    )
    exponents = [f"exponent_{k + 1}" for k in range(count)]
    tail = ["error", "motion", "periods", "followed"]
    write_table(path, [first, second, "start", *exponents, *tail], rows)
