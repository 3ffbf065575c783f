"""What vanishes along a curve, compiled: conditions, bordered functions and their exact gradients."""
