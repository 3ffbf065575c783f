"""All solutions that are released in an interval of phases."""
