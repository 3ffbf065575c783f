"""Quantities of periodic orbits: integrals, extrema, harmonics, expressions of them, and derivatives.

An integral ``Q = int_0^T g(t, y, p) dt`` is a sum of Gauss-Legendre panels over the segments. As the joints
z of the orbit solve ``F(z, p) = 0``, its derivative is ``dQ/dp = Q_p - Q_z F_z^(-1) F_p``. See
``docs/quantities.md``.
"""
