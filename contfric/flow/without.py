"""What stands in for an optional function that a flow does not have."""

from __future__ import annotations

from contfric.compiled import kernel, second_signature


@kernel(second_signature)
def no_second(mode, c, t0, y0, d, p, which, along, jac, room):  # type: ignore[no-untyped-def]
    """Say that there are no second derivatives: the engine takes differences of the first ones."""
    return 0
