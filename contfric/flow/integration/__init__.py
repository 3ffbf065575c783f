"""Numerical integration of one segment: steps, dense output, stationary points and first roots."""
