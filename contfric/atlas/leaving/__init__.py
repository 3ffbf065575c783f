"""Branches that leave an event: which orbits, on which side of it, and how close to it they start."""
