"""Models in balls: their matrices at given parameters, enclosed (python-flint)."""
