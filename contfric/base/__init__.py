"""Tools that every package may use: files, YAML, tables, lazy names, interrupts, memory."""
