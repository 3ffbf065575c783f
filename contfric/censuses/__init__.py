"""Census: all periodic orbits at given parameters, up to a number of periods and stops.

Every orbit that sticks is a periodic point of a map of curves (the section of the releases has dimension
one), and all others meet the section of the stops. A grid of starts on these sections is simulated, cells
whose return may close are refined, and Newton's method solves for the orbits there. See ``docs/census.md``.
"""
