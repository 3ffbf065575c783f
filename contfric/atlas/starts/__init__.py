"""Where an exploration starts: attractors of simulations, and orbits inside one mode."""
