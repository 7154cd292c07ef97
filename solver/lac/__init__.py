"""Frictionless contact by the Local Average Contact (LAC) method, on scikit-fem's own meshes.

`LocalAverageContact` cuts the slave's mesh and assembles the contact of two boundaries; `contact`
documents it. The kernel is the one that the batch verifies (`solver.mechanics.mortar`).
"""

from .contact import ContactState, LocalAverageContact

__all__ = ["ContactState", "LocalAverageContact"]
