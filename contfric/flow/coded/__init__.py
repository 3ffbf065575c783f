"""Affine modes whose formulas are tables of numbers: nothing is compiled for a model."""
