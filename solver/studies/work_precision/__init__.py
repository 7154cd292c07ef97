"""Error against run time: which treatment reaches which accuracy, at what cost."""
