"""The forced oscillator with a constant friction force on each side, in closed form."""
