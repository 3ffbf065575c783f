"""A curve's point, march and location, compiled, over the core that it shares with branches."""
