"""How a model is read, from a file, a class or a mechanism: its schema, and every mistake in its place."""
