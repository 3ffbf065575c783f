"""What every package may use: files, YAML, tables, lazy names, interrupts, memory, optional packages."""
