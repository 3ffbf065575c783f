"""What can follow an event at one of its locations."""
