"""Shape functions of every cell type in the file's node order, and quadrature that suffices."""

from ...lac.cells.quadrature import face_rule, mortar_degree, simplex_rule, volume_rule
from ...lac.cells.shape import ShapeFunctions, has_straight_edges, shape_functions

__all__ = [
    "ShapeFunctions",
    "face_rule",
    "has_straight_edges",
    "mortar_degree",
    "shape_functions",
    "simplex_rule",
    "volume_rule",
]
