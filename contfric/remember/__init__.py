"""Results of long functions, kept on disk or computed ahead on another core, so that a run can continue."""
