"""Period adding: which itineraries over two orbits have windows next to a bridge."""
