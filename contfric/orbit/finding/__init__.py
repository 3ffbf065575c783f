"""From a simulation to a periodic orbit: its returns, where it rests, when it is given up."""
