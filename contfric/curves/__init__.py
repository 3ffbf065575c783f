"""Bifurcations in two parameters: their equations, continuation, and points of codimension two.

Unknowns are the joints z and both parameters w. A curve solves ``F(z, w) = 0``, the equations of the orbit,
and one condition ``g(z, w) = 0``: a margin for sliding events, and the bordered function of the singular
Jacobian for SN, BP and PD (A. Griewank, G. W. Reddien, 1984; W. Govaerts, 2000). ``docs/curves.md`` has the
derivation.
"""
