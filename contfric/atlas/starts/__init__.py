"""Starting points of an exploration: attractors of simulations, and orbits inside one mode."""
