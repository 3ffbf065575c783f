"""From the formulas of a model to compiled functions, or to tables that compiled functions read."""
