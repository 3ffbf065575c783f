"""Where disturbances grow by many powers of ten in a turn, signs and small multipliers are known.

A rigid block that rocks is a saddle: between impacts it loses no area, and each impact takes the restitution
of it twice (its rate, and the time of the next crossing). So the product of the two multipliers is known.
"""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf


@pytest.fixture(scope="module")
def diagram() -> cf.Diagram:
    return cf.explore(cf.find_orbit("rocking-block"), "W", (0.1, 2.0))


def test_the_small_multiplier_is_that_of_the_areas(diagram: cf.Diagram) -> None:
    """Also where the large one has 40 digits: it was rounding of the large one, of any size."""
    branches = {b.system.segments: b for b in diagram.branches if b.system.segments >= 4}
    assert set(branches) == {4, 8}
    for impacts, branch in branches.items():
        large, small = branch.multipliers.T
        assert np.abs(large).max() > 1e30
        off = np.abs(small - 0.85 ** (2 * impacts) / large)
        assert np.median(off) < 1e-14
        assert np.mean(off < 1e-8) > 0.99


def test_nothing_happens_where_it_is_unstable(diagram: cf.Diagram) -> None:
    """Signs of rounding made thousands of points, and steps that were cut short, where there is no event."""
    kinds = {b.kind.name for branch in diagram.branches for b in branch.bifurcations}
    assert kinds == {"BP", "PD", "GS"}
    for branch in diagram.branches:
        far = np.abs(branch.multipliers[:, 0]) > 1e6
        assert len(branch) < 5000
        smooth = [b for b in branch.bifurcations if b.kind.name in ("BP", "PD")]
        assert not any(far[np.argmin(np.abs(branch.arc - b.position))] for b in smooth)
