"""Conditions that vanish along a curve, compiled: bordered functions and their exact gradients."""
