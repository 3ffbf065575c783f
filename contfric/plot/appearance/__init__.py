"""The appearance of figures: names, labels and colours; and writing them to files."""
