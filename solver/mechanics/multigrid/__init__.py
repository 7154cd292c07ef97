"""Multigrid for large systems in space, with compiled loops: one more factor in `linear.choice`."""
