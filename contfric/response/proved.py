"""The chaos of a release map, proved."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from contfric.base.extras import need_flint
from contfric.response.release import image_of, release_of
from contfric.response.returns import ReleaseMap

if TYPE_CHECKING:
    from contfric.certify.horseshoe import Horseshoe

#: Releases of the long orbit that says where the window may be, and those that are left out before.
_ORBIT, _SETTLED = 3000, 200


def horseshoe_of(releases: ReleaseMap, most: int) -> Horseshoe:
    """Return what is proved of a release map; see :meth:`contfric.response.returns.ReleaseMap.horseshoe`."""
    need_flint()
    from contfric.certify.horseshoe import Sampled, find_horseshoe
    from contfric.certify.returns import Release

    model = releases.model
    way, rests = release_of(model, releases.surface)
    image = image_of(model, way)
    surfaces = [s.name for s in model.surfaces]
    release = Release(
        releases.mode,
        releases.surface,
        rests,
        way.following,
        way.on,
        surfaces[image[1]] if image else "",
    )
    longest = max(releases.branches, key=lambda pair: len(pair[0]), default=(np.zeros(1),) * 2)
    starts = longest[0][:: max(1, len(longest[0]) // 5)]
    orbits = [releases.cobweb(float(t), _ORBIT)[_SETTLED:] for t in starts]
    orbit = max(orbits, key=lambda x: len(np.unique(x.round(6))))
    if not len(orbit):
        orbit = releases.phases
    sampled = Sampled(releases.phases, releases.images, releases.branch, orbit, releases.period)
    return find_horseshoe(model, releases.vector, release, sampled, most)
