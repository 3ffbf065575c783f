"""The local behaviour of a solution at an event: it touches, rests, or leaves rest with an acceleration."""
