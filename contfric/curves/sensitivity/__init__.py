"""How an event moves with the parameters, and its position at other parameters."""
