"""Results on disk: orbits, branches and diagrams in one file, written and read exactly."""

from contfric.base.files import replacing
from contfric.results.archive import FORMAT, Saveable, load, save

__all__ = ["FORMAT", "Saveable", "load", "replacing", "save"]
