"""In which order an orbit passes what: its itinerary, and the signature that says it."""
