"""Look-up tables of a model's definition: what follows a domain, chatter, sections."""
