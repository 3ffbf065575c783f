"""Positions of contacts that never slip along an orbit."""
