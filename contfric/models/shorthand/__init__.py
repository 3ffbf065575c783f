"""What a model file says in short, each in a module: clocks, angles, units, derived sliding, chatter."""
