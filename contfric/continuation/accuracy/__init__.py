"""How well an event is known: its parameter value, and the signs that are read near it."""
