"""Events between two points of a branch, located on it."""
