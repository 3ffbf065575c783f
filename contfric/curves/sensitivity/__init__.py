"""How an event moves with the parameters, and where it is at others."""
