"""One smooth segment forward, with derivatives, stationary points and first roots."""
