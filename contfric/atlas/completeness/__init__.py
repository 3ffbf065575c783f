"""Checks that a diagram is complete: restarts from its own branches, and balances of indices."""
