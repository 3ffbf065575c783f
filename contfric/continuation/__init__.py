"""One branch: pseudo-arclength continuation of periodic orbits, and the events on it.

The joints z of an orbit solve ``F(z, p) = 0`` (:mod:`contfric.orbit`). A branch is the curve of solutions
(z, p), followed by a predictor along its tangent and Newton's method normal to it (H. B. Keller, 1977). At
each point two kinds of test functions are evaluated: *margins*, the distances to the violation of an
inequality (a sliding event: CS, SS, AS, GS, T), and functions of the Floquet multipliers, such as
``det(I - M)``, ``det(I + M)`` and the modulus of a complex pair less 1 (SN, BP, PD, NS). A change of sign is
located along the curve. What can follow an event is in :mod:`contfric.events`. Sliding events have the
names of M. di Bernardo, C. J. Budd, A. R. Champneys, P. Kowalczyk, Piecewise-smooth Dynamical Systems
(Springer 2008), chapter 8.
"""
