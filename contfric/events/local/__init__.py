"""What a solution does where an event happens: it touches, rests, or leaves rest with an acceleration."""
