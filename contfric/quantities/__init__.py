"""Quantities of periodic orbits: integrals, extrema, harmonics, expressions of them, and derivatives."""
