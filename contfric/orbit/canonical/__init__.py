"""Tests whether two orbits are the same solution, whatever joints and sections they are solved with."""
