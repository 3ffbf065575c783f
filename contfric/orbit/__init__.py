"""One periodic orbit: boundary-value problem, Newton, multipliers, admissibility, simulation."""
