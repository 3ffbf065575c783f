"""A scene: from a YAML file to the plan that computes only what it names, and its results."""
