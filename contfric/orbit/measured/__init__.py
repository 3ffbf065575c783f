"""Measures of a solved orbit: states along it, stops, extrema, quantities by name."""
