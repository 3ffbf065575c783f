"""What the record of a run says of a plane and of a map."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from contfric.atlas.plane import Plane
    from contfric.chaos.map import LyapunovMap


def plane_entries(plane: Plane) -> dict[str, Any]:
    """Return the curves, points of codimension two and regions of a plane."""
    return {
        "parameters": list(plane.parameters),
        "complete": plane.complete,
        "curves": [
            {
                "curve": number,
                "label": curve.label,
                "points": len(curve),
                "twin_of": plane.twins[number - 1] + 1,
                "signatures": [name for _, name in curve.signatures],
                "ends": [str(end) for end in curve.ends],
            }
            for number, curve in enumerate(plane.curves, start=1)
        ],
        "special": [{"name": s.name, "params": s.params} for s in plane.special],
        "regions": [
            {
                "point": region.point,
                "share": region.share,
                "bounds": [k + 1 for k in region.bounds],
                "families": [str(f) for f in region.families],
            }
            for region in plane.regions
        ],
        "notes": list(plane.notes),
    }


def map_entries(lmap: LyapunovMap) -> dict[str, Any]:
    """Return what the motions of a map turned out to be."""
    return {
        "grid": {
            name: [float(values[0]), float(values[-1]), len(values)]
            for name, values in lmap.axes.items()
        },
        "params": lmap.params,
        "starts": lmap.starts,
        "complete": lmap.complete,
        "motions": {motion.name.lower(): count for motion, count in lmap.counts().items()},
        "largest": float(np.nanmax(lmap.values, initial=-np.inf)),
    }
