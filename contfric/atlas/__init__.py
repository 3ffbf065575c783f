"""Diagrams: exploration of branches through their events, and planes of two parameters.

A queue holds the events that were found. For each of them, every solution that may leave it is proposed,
solved and followed, until nothing is left to try (:mod:`~contfric.atlas.explore`,
:mod:`~contfric.atlas.follow`). A branch that is known already is recognised by its orbits
(:mod:`~contfric.atlas.matching`). Two checks of a diagram follow: exploring it again from its own branches,
and the balance of fixed-point indices, which cannot change with the parameter
(:mod:`~contfric.atlas.completeness.verification`; theory and sources in ``docs/bridges.md``).
"""
