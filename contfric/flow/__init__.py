"""One smooth segment forward in time: state, derivatives, stationary points and first roots.

``phi(t, y, d)`` is the state after the duration d of a solution of ``y' = f(t, y)`` that starts at (t, y).
For affine fields it has a closed form (matrix exponentials and the response to each harmonic); other fields
are integrated. The *first root* of an observable along a segment is the earliest time at which it takes a
level. It is found from bounds of the observable, so that none is missed. See ``docs/numerics.md`` and
``docs/integration.md``.
"""
