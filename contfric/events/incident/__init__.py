"""Orbits that an event joins: outcomes at all its locations together, over one or several periods."""
