"""Proofs by interval arithmetic of orbits, events, branches and diagrams.

Existence and uniqueness of a zero of ``F(z) = 0`` near a computed z_0 follow if the Krawczyk operator

    ``K = z_0 - C F(z_0) + (I - C F'(X)) (X - z_0)``

maps the box X into its interior (R. Krawczyk, Computing 4 (1969) 187-201). All numbers are balls of Arb
(python-flint). ``docs/certificates.md`` has the method.
"""
