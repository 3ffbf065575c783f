"""One periodic orbit: found from a simulation, solved, measured; its stops, its slides, its index.

Its boundary-value problem is in :mod:`contfric.bvp`, simulation in :mod:`contfric.simulation`.
"""
