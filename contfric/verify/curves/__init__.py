"""Curves of orbits, their events and tubes: a second program, on top of the checker of orbits."""
