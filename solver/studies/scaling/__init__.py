"""Scaling: the cost of one problem on ever finer meshes, with fitted exponents."""
