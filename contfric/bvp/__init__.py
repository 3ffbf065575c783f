"""The boundary-value problem of an orbit: its equations and inequalities, Newton's method, multipliers."""
