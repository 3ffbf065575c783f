"""Where a branch ends: at an event, the range, a vertex, or a value that a quantity takes."""
