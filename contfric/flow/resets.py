"""The reset of a model without resets: the identity."""

from __future__ import annotations

from contfric.compiled import kernel, reset_signature


@kernel(reset_signature, counts=False)
def no_reset(k, t, y, p, which, y1, jac):  # type: ignore[no-untyped-def]
    """Return the state unchanged, with the derivatives of that."""
    for i in range(y.shape[0]):
        y1[i] = y[i]
        if jac.shape[0] > 0:
            for j in range(jac.shape[1]):
                jac[i, j] = 1.0 if j == 1 + i else 0.0
