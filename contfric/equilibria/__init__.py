"""Equilibria of models without excitation: all of them, their branches, and the cycles that are born there.

The theory, with its sources, is in docs/equilibria.md.
"""
