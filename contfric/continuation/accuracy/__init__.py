"""Accuracy of events: errors of their parameters, and of the signs of test functions near them."""
