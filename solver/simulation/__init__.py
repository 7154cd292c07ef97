"""From a case and its mesh to a solution."""
