"""Verification of mortar contact: meshes, solves, checks and reports cases."""
