"""Proofs by interval arithmetic: orbits, events and branches become theorems."""
