"""A branch in overlapping boxes, from event to event."""
