"""Results on disk: orbits, branches and diagrams in one file, written and read exactly."""

from contfric.results.archive import FORMAT, Saveable, load, save
from contfric.results.files import replacing

__all__ = ["FORMAT", "Saveable", "load", "replacing", "save"]
