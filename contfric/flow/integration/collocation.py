"""Coefficients of collocation at the Radau nodes, from Legendre polynomials.

Source: E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II", 2nd edition, Springer 1996,
section IV.5. They are good to a few units in the last place for the 3 to 9 stages that are of use.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre

from contfric.flow.integration.variations import FloatArray


def radau_nodes(s: int) -> FloatArray:
    """Return the nodes in [0, 1]: the zeros of ``P_s - P_{s-1}`` (Legendre), the last one 1."""
    zeros = legendre.legroots([0.0] * (s - 1) + [-1.0, 1.0])
    series = np.array([0.0] * (s - 1) + [-1.0, 1.0])
    for _ in range(3):  # Newton's method removes what the eigenvalues leave
        zeros = zeros - legendre.legval(zeros, series) / legendre.legval(
            zeros, legendre.legder(series)
        )
    zeros = np.sort(zeros.real)
    zeros[-1] = 1.0
    return np.asarray(0.5 * (1.0 + zeros))


def collocation_matrix(nodes: FloatArray) -> FloatArray:
    """Return ``A_ij``, the integral of the j-th Lagrange polynomial from 0 to node i, by Legendre series."""
    s, x = len(nodes), 2.0 * nodes - 1.0
    values = legendre.legvander(x, s)
    integrals = np.empty((s, s))
    integrals[:, 0] = nodes
    for k in range(1, s):
        integrals[:, k] = 0.5 * (values[:, k + 1] - values[:, k - 1]) / (2 * k + 1)
    return np.asarray(np.linalg.solve(values[:, :s].T, integrals.T).T)


def values_at_start(nodes: FloatArray) -> FloatArray:
    """Return the values of the Lagrange polynomials at 0."""
    others = [np.delete(nodes, i) for i in range(len(nodes))]
    return np.array([np.prod(-o / (c - o)) for c, o in zip(nodes, others, strict=True)])
