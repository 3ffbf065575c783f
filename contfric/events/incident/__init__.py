"""Which orbits an event joins: the outcomes at all its locations together, over one or several periods."""
