"""Lyapunov exponents of single solutions and on grids of two parameters.

``docs/lyapunov.md`` has the derivation, what the numbers mean, and how to spread a map over machines.
"""
