"""From a description to a definition: domains, sections, where resets and slides lead."""
