"""Ends of a branch: at an event, the range, a vertex, or a value that a quantity takes."""
