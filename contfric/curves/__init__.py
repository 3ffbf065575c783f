"""Curves of bifurcations in two parameters: conditions, march in the plane, points of codimension two."""
