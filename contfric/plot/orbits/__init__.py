"""Orbits and trajectories drawn: in a plane, in time, moving."""
