"""Structures of masses, springs and contacts: as declared, and as the modes that they come down to."""
