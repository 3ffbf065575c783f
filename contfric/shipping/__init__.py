"""Kernels that are compiled ahead: for ``contfric doctor --compile``, and for a wheel."""
