"""Integrals and extrema over a whole orbit with their gradients, compiled."""
