"""From a solution to a verdict."""
