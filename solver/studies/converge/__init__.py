"""Uncertainty of a case's results from solves on refined meshes."""
