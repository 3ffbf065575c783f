"""Ensembles: bifurcation diagrams of random parameters, and the statistics of what they hold."""

from __future__ import annotations
