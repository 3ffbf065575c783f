"""Which solution an orbit is, whatever joints, section and number of turns it is solved with."""
