"""Census: all periodic orbits at given parameters, by one search on each section that orbits meet."""
