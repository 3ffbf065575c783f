"""What every package may use: files, YAML, texts, interrupts, memory, extras, digests of the sources."""
