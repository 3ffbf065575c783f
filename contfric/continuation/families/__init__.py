"""Continua: families of orbits at one value of the parameter."""
