"""The error that says that a formula is not affine; in its own module, so that sympy is not imported."""


class NotAffineError(Exception):
    """Says why a formula is not affine."""
