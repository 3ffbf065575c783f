"""A model as plain data: what was written, in one form, and its value at points."""
