"""Results of long calls, on disk and ahead of time: a run that was interrupted goes on from them."""
