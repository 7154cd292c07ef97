"""Around the mortar kernel `solver.lac`: other treatments, rigid surfaces, edges of contact.

Examples in this package use the surfaces that `solver.lac` describes.
"""
