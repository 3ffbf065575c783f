"""The possible outcomes of an event at one of its locations."""
