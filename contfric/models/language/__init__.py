"""The language of a model's formulas: read as data, differentiated, evaluated."""
