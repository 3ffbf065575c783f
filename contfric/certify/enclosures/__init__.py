"""Interval arithmetic of no model: matrices on a chord, and zeros that are proved to exist and be unique."""
