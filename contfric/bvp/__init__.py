"""The boundary-value problem of an orbit: equations, inequalities, Newton's method, multipliers.

An orbit with N segments has the joints z_i = (t_i, y_i). Segment i moves with the flow phi of its mode to
the surface g = 0 at which it ends, and the last joint is the first one again, n periods T later::

    y_(i+1) = phi(t_i, y_i, t_(i+1) - t_i),    g_i(t_(i+1), y_(i+1)) = 0,    z_N = z_0 + (n T, 0).

(A symmetric orbit is solved on half a period, closed by the symmetry.) This multi-segment problem is that
of H. Dankowicz, F. Schilder, Recipes for Continuation (SIAM 2013). Its Jacobian is exact, its elimination
costs as much as there are segments (:mod:`~contfric.bvp.cyclic`), and gives the derivative M of the
return map, whose eigenvalues are the Floquet multipliers. A solution is *admissible* if no inequality is
violated inside a segment; that is decided at all stationary points of the observables. See
``docs/numerics.md``.

What to find where:

* the problem of an itinerary: ``system`` (and ``assembly``, ``margins``, ``holds``, ``segment_starts``);
* its equations: ``equations``, ``after_reset``, ``short_exits``, ``blocks``;
* its solution: ``newton`` with ``convergence``, ``cyclic``; one orbit outside of the engine ``linear``;
* inequalities: ``monitor``, ``stationary_points``, ``stationary_values``, ``crossed_surfaces``;
* Floquet multipliers: ``spectrum``, ``pencil``, ``saltation``, ``passages``, ``conserved``;
* derivatives of the joints: ``joint_derivatives``; orbits with given outcomes: ``prescribed_outcomes``.
"""
