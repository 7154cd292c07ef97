"""Finite elements on arrays."""
