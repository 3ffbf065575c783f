"""Where contacts rest that never slip along an orbit."""
