"""Kernels compiled ahead of everybody who would wait for them, and those that come with a wheel."""
