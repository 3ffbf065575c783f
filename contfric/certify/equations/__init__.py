"""What an orbit or an event solves, in balls: equations, derivatives, what they keep, multipliers."""
