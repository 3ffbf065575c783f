"""One smooth segment forward, with derivatives, turning points and first roots."""
