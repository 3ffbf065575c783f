"""What leaves an event: which orbits, on which side of it, and at how small a distance."""
