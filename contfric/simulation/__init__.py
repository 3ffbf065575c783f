"""Simulation from an initial condition: from event to event, without time steps."""
