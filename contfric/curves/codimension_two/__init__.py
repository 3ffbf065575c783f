"""Points of codimension two: how they are recognised on a curve, located and named."""
