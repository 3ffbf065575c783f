"""Diagrams drawn: branches with their stability and events, insets, legend, and their graph."""
