"""Closed form of affine modes: ``y' = A(p) y`` plus constants and harmonics, in any number of states."""
