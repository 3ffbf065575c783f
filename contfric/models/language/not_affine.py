"""What says that a formula is not affine; apart from what needs sympy to find it out."""


class NotAffineError(Exception):
    """Says why a formula is not affine."""
