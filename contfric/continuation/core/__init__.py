"""The core of branches and curves, compiled: predictor, corrector, step control, brackets, location."""
