"""How figures look: names, labels, colours; and how they are written to files."""
