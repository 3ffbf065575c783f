"""Responses by simulation: sweeps of a parameter, return maps, basins of attraction, stable sets.

``docs/response.md`` has examples, what the numbers mean, and how to spread basins over machines.
"""
