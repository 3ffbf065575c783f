"""Many families: exploring through events."""
