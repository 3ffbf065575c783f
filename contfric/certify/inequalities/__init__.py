"""Signs that are proved over whole segments."""
