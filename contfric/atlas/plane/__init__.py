"""A plane of two parameters: its curves and sections, and which orbits live between the curves."""
