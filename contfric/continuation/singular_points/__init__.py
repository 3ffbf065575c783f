"""Folds, branch points and period doublings: where the equations of an orbit are singular."""
