"""Short forms in a model file, a module each: clocks, angles, units, derived sliding, chatter."""
