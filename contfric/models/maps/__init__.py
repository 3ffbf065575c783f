"""What a definition is asked for by name: what follows a domain, chatter, sections."""
