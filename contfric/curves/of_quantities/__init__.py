"""Curves of orbits that share a value of a quantity, an extremum, or a pair of multipliers."""
