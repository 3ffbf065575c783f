"""A family of orbits: arclength continuation, events, their location, and what leaves them."""
