"""Parameters from measurements: least squares on solved orbits, with exact gradients."""
