"""Exact solutions, a file per kind; `catalogue` has all of them by name."""
